"""Find the set of lights with the least criterion: greedily with exchanges, or among all there are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from impasto.angles.criterion import Criterion

# An exchange must lower the criterion by this share, or rounding could go on for ever.
_WORTH = 1e-9


def greedy_exchange(criterion: Criterion, size: int) -> tuple[int, ...]:
    """Choose lights greedily, then exchange them while that helps.

    Once they are added one by one to none, each the best beside those there are, and once left out one by one
    of all, each the least missed; of the two sets that exchanges lead to, the better one counts.

    Parameters
    ----------
    criterion : Criterion
    size : int
        How many to choose.

    Returns
    -------
    tuple of int
        In rising order. No exchange of one of them for another candidate lowers the criterion
        [Fedorov1972]_, ch. 3.
    """
    starts = {tuple(sorted(order(criterion)[:size])) for order in (_added, _left_out)}
    return min((_exchanged(criterion, start) for start in sorted(starts)), key=criterion.value)


@lru_cache(maxsize=4)
def _added(criterion: Criterion) -> tuple[int, ...]:
    """Return all candidates in the order in which they would be added."""
    chosen: list[int] = []
    while len(chosen) < criterion.lights:
        gains = criterion.gains(criterion.covariance(chosen))
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
    return tuple(chosen)


@lru_cache(maxsize=4)
def _left_out(criterion: Criterion) -> tuple[int, ...]:
    """Return all candidates in the reverse of the order in which they would be left out."""
    chosen, out = list(range(criterion.lights)), []
    while chosen:
        losses = criterion.losses(criterion.covariance(chosen))
        out.append(min(chosen, key=lambda light: losses[light]))
        chosen.remove(out[-1])
    return tuple(reversed(out))


def _exchanged(criterion: Criterion, start: tuple[int, ...]) -> tuple[int, ...]:
    """Exchange lights of a set for other candidates, each for the best there is, until none helps."""
    chosen = list(start)
    exchanged = len(chosen) < criterion.lights
    while exchanged:
        exchanged = False
        covariance, worth = criterion.covariance(chosen), _WORTH * criterion.value(chosen)
        for place, light in enumerate(chosen):
            gains = criterion.gains(criterion.without(covariance, light))
            own = gains[light]
            gains[chosen] = -np.inf
            best = int(np.argmax(gains))
            if gains[best] > own + worth:
                chosen[place] = best
                covariance = criterion.covariance(chosen)
                exchanged = True
    return tuple(sorted(chosen))


def exhaustive(criterion: Criterion, size: int) -> tuple[int, ...]:
    """Return the best of all sets of a size.

    Parameters
    ----------
    criterion : Criterion
        Of few candidates: up to 20 take seconds, and every further one about half as long again.
    size : int

    Returns
    -------
    tuple of int
        In rising order.

    Notes
    -----
    Branch and bound [Narendra1977]_: leaving out lights never lowers the criterion, so whatever is left of a
    set that is already worse than the best one known need not be looked at.
    """
    best = greedy_exchange(criterion, size)
    least = criterion.value(best)

    def leave_out(kept: tuple[int, ...], free: tuple[int, ...]) -> None:
        """Leave lights of `free` out of `kept`; those that are not free stay."""
        nonlocal best, least
        covariance = criterion.covariance(kept)
        now = criterion.value(kept)
        if now >= least:
            return
        if len(kept) == size:
            best, least = kept, now
            return
        losses = criterion.losses(covariance)
        worth = sorted(
            (light for light in free if now + losses[light] < least), key=lambda light: losses[light]
        )
        # Each set is reached once: a light that was tried stays in what is tried after it.
        missing = len(kept) - size
        for number, light in enumerate(worth):
            rest = tuple(worth[number + 1 :])
            if len(rest) < missing - 1:
                return
            leave_out(tuple(each for each in kept if each != light), rest)

    leave_out(tuple(range(criterion.lights)), tuple(range(criterion.lights)))
    return tuple(sorted(best))
