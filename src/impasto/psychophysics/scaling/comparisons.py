"""Count the answers of an experiment, per observer and pair of conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem
from impasto.psychophysics.scaling.trials import Trial, TrialsError, in_order


@dataclass(frozen=True)
class Comparisons:
    """Choices counted per observer and pair of conditions.

    Parameters
    ----------
    conditions : tuple of str, length C
    observers : tuple of str, length O
    wins : ndarray of shape (O, C, C), float64
        `wins[o, i, j]`: how often observer o chose i over j.
    ties : ndarray of shape (O, C, C), float64
        How often neither was chosen; symmetric.
    wins_left : ndarray of shape (C, C), float64
        The part of the wins of all observers in which i stood on the left and j on the right.
    wins_right : ndarray of shape (C, C), float64
        The same with i on the right.
    summed : bool, optional
        Whether only the sums over observers are known, each answer being that of another observer.
    """

    conditions: tuple[str, ...]
    observers: tuple[str, ...]
    wins: NDArray[np.float64]
    ties: NDArray[np.float64]
    wins_left: NDArray[np.float64]
    wins_right: NDArray[np.float64]
    summed: bool = False

    @property
    def counts(self) -> NDArray[np.float64]:
        """How often i was chosen over j by all observers, shape (C, C); a tie is half a choice for each."""
        return np.asarray((self.wins + 0.5 * self.ties).sum(axis=0))

    @property
    def has_ties(self) -> bool:
        """Whether some answer is a tie."""
        return bool(self.ties.any())

    @property
    def has_repeats(self) -> bool:
        """Whether some observer answered more than once on some pair."""
        answers = self.wins + np.swapaxes(self.wins, 1, 2) + self.ties
        return not self.summed and bool((answers > 1).any())

    @classmethod
    def of_counts(cls, counts: NDArray[np.float64], conditions: Sequence[str] = ()) -> Comparisons:
        """Return comparisons of which only the sums over observers are known.

        Parameters
        ----------
        counts : array-like of shape (C, C)
            How often i was chosen over j.
        conditions : sequence of str, optional

        Returns
        -------
        Comparisons

        Raises
        ------
        TrialsError
            If `counts` is not square or holds something that is no count.
        """
        table = np.asarray(counts, dtype=np.float64)
        square = table.ndim == 2 and table.shape[0] == table.shape[1] and len(table) > 1
        if not square or not (np.isfinite(table) & (table >= 0)).all() or table.trace():
            raise TrialsError(
                Problem(
                    where="counts",
                    what=f"has shape {table.shape}, must be square, with counts from 0 and a diagonal of 0",
                    do="Give how often condition i was chosen over condition j",
                )
            )
        names = tuple(conditions) or tuple(str(number + 1) for number in range(len(table)))
        nothing = np.zeros_like(table)
        return cls(names, ("all",), table[None], nothing[None], nothing, nothing, summed=True)


def count_choices(
    trials: Iterable[Trial], conditions: Sequence[str] = (), observers: Sequence[str] = ()
) -> Comparisons:
    """Count the choices of trials.

    Parameters
    ----------
    trials : iterable of Trial
        Those of kind "test" are counted.
    conditions, observers : sequence of str, optional
        Which, and in which order; by default all in the trials, sorted.

    Returns
    -------
    Comparisons
    """
    counted = [trial for trial in trials if trial.kind == "test"]
    conditions = tuple(conditions) or in_order(
        name for trial in counted for name in (trial.condition_A, trial.condition_B)
    )
    observers = tuple(observers) or in_order(trial.observer for trial in counted)
    column = {name: number for number, name in enumerate(conditions)}
    row = {name: number for number, name in enumerate(observers)}
    wins = np.zeros((len(observers), len(conditions), len(conditions)))
    ties = np.zeros_like(wins)
    sided = np.zeros((2, len(conditions), len(conditions)))
    for trial in counted:
        if trial.observer not in row or not {trial.condition_A, trial.condition_B} <= column.keys():
            continue
        observer, first, second = row[trial.observer], column[trial.condition_A], column[trial.condition_B]
        if trial.choice == 0:
            ties[observer, first, second] += 1
            ties[observer, second, first] += 1
            continue
        chosen, refused = (first, second) if trial.choice > 0 else (second, first)
        wins[observer, chosen, refused] += 1
        if trial.side:
            on_left = (trial.side == "left") == (trial.choice > 0)
            sided[0 if on_left else 1, chosen, refused] += 1
    return Comparisons(conditions, observers, wins, ties, sided[0], sided[1])


def components(compared: NDArray[np.bool_]) -> tuple[tuple[int, ...], ...]:
    """Return the sets of conditions that chains of comparisons connect.

    Parameters
    ----------
    compared : ndarray of shape (C, C), bool
        Whether i was compared with j.

    Returns
    -------
    tuple of tuple of int
    """
    return _parts(compared, "weak")


def dominating(wins: NDArray[np.float64]) -> tuple[tuple[int, ...], ...]:
    """Return the sets of conditions within which a scale is finite, one if the whole scale is.

    Parameters
    ----------
    wins : ndarray of shape (C, C), float64
        How often i was chosen over j.

    Returns
    -------
    tuple of tuple of int
        Between two sets all choices went one way, so that no finite distance is the likeliest
        [Ford1957]_.
    """
    return _parts(wins > 0, "strong")


def _parts(links: NDArray[np.bool_], connection: str) -> tuple[tuple[int, ...], ...]:
    from scipy.sparse.csgraph import connected_components

    number, labels = connected_components(links, directed=True, connection=connection)
    return tuple(tuple(int(i) for i in np.flatnonzero(labels == part)) for part in range(number))
