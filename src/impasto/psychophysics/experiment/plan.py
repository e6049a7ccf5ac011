"""Which trials an observer sees, in which order, and on which side each candidate stands.

Chance decides, but evenly: sessions come in twos. The second of two sees the trials of the first in reverse
order, with the candidates' sides exchanged; so over both each pair stands once on each side, and its mean
position is the middle of the session.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

Kind = Literal["practice", "test", "repeat", "catch"]

_REPEAT_DISTANCE = 10
"""Trials between a pair and its repetition, where the session is long enough."""


@dataclass(frozen=True)
class Pair:
    """Two candidates to be compared with one reference.

    Parameters
    ----------
    sample, angle : str
        Whose photograph under which light is the reference.
    condition_a, condition_b : str
        What the candidates are, in the order of the manifest.
    """

    sample: str
    angle: str
    condition_a: str
    condition_b: str

    @property
    def reference(self) -> tuple[str, str]:
        """What two trials with the same reference have in common."""
        return self.sample, self.angle


@dataclass(frozen=True)
class PlannedTrial:
    """A trial of a session.

    Parameters
    ----------
    kind : {'practice', 'trial', 'repeat', 'catch'}
        A repeat shows a pair of the session once more, with the sides exchanged; a catch trial has an obvious
        answer.
    pair : Pair
    a_left : bool
        Whether candidate A stands on the left, or is the first where candidates alternate.
    """

    kind: Kind
    pair: Pair
    a_left: bool


def plan_session(
    pairs: Sequence[Pair],
    catches: Sequence[Pair],
    *,
    seed: int,
    number: int,
    repeats: int = 0,
    catch_every: int = 0,
    practice: int = 0,
) -> list[PlannedTrial]:
    """Return the trials of a session.

    Parameters
    ----------
    pairs : sequence of Pair
        Each is shown once.
    catches : sequence of Pair
        Pairs with an obvious answer.
    seed : int
        Of the experiment; the same seed and number give the same session.
    number : int
        Of the session among all of the experiment, from 0.
    repeats : int, optional
        How many pairs are shown a second time.
    catch_every : int, optional
        One catch trial is put among so many others; 0 for none.
    practice : int, optional
        Trials before the first that counts.

    Returns
    -------
    list of PlannedTrial
    """
    first_of_two = np.random.default_rng((seed, number // 2))
    own = np.random.default_rng((seed, number // 2, number % 2))
    trials = [
        PlannedTrial("test", pair, bool(side))
        for pair, side in zip(pairs, _balanced_sides(pairs, first_of_two), strict=True)
    ]
    trials = _apart([trials[index] for index in first_of_two.permutation(len(trials))], first_of_two)
    if number % 2:
        trials = [replace(trial, a_left=not trial.a_left) for trial in reversed(trials)]
    tests = list(trials)
    trials = _with_repeats(trials, min(repeats, len(tests)), own)
    trials = _with_catches(trials, catches, catch_every, own)
    rehearsed = own.permutation(len(tests))[:practice]
    return [replace(tests[index], kind="practice") for index in rehearsed] + trials


def _balanced_sides(pairs: Sequence[Pair], rng: np.random.Generator) -> list[bool]:
    """Return a side for each pair, so that for each two conditions A stands left in half of their trials."""
    sides = [False] * len(pairs)
    groups: dict[tuple[str, str], list[int]] = {}
    for index, pair in enumerate(pairs):
        groups.setdefault((pair.condition_a, pair.condition_b), []).append(index)
    # Where a group is odd, one side gets one more; these alternate, so that the session as a whole is even.
    more_left = bool(rng.integers(2))
    for members in groups.values():
        order = rng.permutation(len(members))
        half = len(members) // 2
        if len(members) % 2:
            half += more_left
            more_left = not more_left
        for index in order[:half]:
            sides[members[index]] = True
    return sides


def _apart(trials: list[PlannedTrial], rng: np.random.Generator) -> list[PlannedTrial]:
    """Return the trials so that neighbours have different references, as far as that can be had.

    References are drawn with the chance of their remaining trials, but never twice in a row, and one that
    makes up half of what remains comes at once, because later it could not be kept apart.
    """
    waiting: dict[tuple[str, str], list[PlannedTrial]] = {}
    for trial in trials:
        waiting.setdefault(trial.pair.reference, []).append(trial)
    ordered: list[PlannedTrial] = []
    last: tuple[str, str] | None = None
    for left in range(len(trials), 0, -1):
        open_to = [reference for reference in waiting if waiting[reference] and reference != last]
        open_to = open_to or [reference for reference in waiting if waiting[reference]]
        counts = np.array([len(waiting[reference]) for reference in open_to])
        most = int(counts.argmax())
        urgent = 2 * counts[most] > left
        chosen = open_to[most if urgent else int(rng.choice(len(open_to), p=counts / counts.sum()))]
        ordered.append(waiting[chosen].pop(0))
        last = chosen
    return ordered


def _with_repeats(trials: list[PlannedTrial], count: int, rng: np.random.Generator) -> list[PlannedTrial]:
    """Return the trials with some of the first half repeated later, the sides exchanged."""
    early = max(count, len(trials) // 2)
    for index in sorted(rng.permutation(early)[:count], reverse=True):
        again = replace(trials[index], kind="repeat", a_left=not trials[index].a_left)
        soonest = min(int(index) + 1 + _REPEAT_DISTANCE, len(trials))
        trials.insert(int(rng.integers(soonest, len(trials) + 1)), again)
    return trials


def _with_catches(
    trials: list[PlannedTrial], catches: Sequence[Pair], every: int, rng: np.random.Generator
) -> list[PlannedTrial]:
    """Return the trials with one catch trial at a random place in each full stretch of `every`."""
    if not every or not catches:
        return trials
    count = max(1, len(trials) // every)
    sides = rng.permutation([bool(index % 2) for index in range(count)])
    chosen = rng.permutation(len(catches))
    for stretch in range(count - 1, -1, -1):
        start = stretch * every
        place = start + int(rng.integers(1, max(2, min(every, len(trials) - start))))
        pair = catches[chosen[stretch % len(catches)]]
        trials.insert(place, PlannedTrial("catch", pair, bool(sides[stretch])))
    return trials
