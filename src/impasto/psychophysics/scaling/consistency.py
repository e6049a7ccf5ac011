"""How far observers agree with themselves and with each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from impasto.psychophysics.scaling.trials import Trial

# Up to here the distribution of circular triads is exact; the chi-square is good beyond.
_EXACT = 7


@dataclass(frozen=True)
class CircularTriads:
    """Circular triads of a complete set of choices by one observer.

    Parameters
    ----------
    triads : int
        How often i was chosen over j, j over k, and k over i.
    most : int
        As many as are possible.
    consistency : float
        Kendall and Babington Smith's ζ: 1 without circular triads, 0 with as many as are possible.
    p_value : float
        Of as few triads or fewer, if every choice were a toss of a coin.
    """

    triads: int
    most: int
    consistency: float
    p_value: float


def circular_triads(wins: NDArray[np.float64]) -> CircularTriads:
    """Count circular triads [KendallBabingtonSmith1940]_.

    Parameters
    ----------
    wins : ndarray of shape (C, C), float64
        1 where i was chosen over j, 0 elsewhere; every pair once.

    Returns
    -------
    CircularTriads

    Raises
    ------
    ValueError
        If some pair was not answered exactly once.
    """
    size = len(wins)
    if not is_tournament(wins):
        raise ValueError("every pair needs exactly one choice")
    scores = wins.sum(axis=1)
    triads = round(size * (size - 1) * (2 * size - 1) / 12 - np.sum(scores**2) / 2)
    most = (size**3 - size) // 24 if size % 2 else (size**3 - 4 * size) // 24
    return CircularTriads(
        triads=triads,
        most=most,
        consistency=1 - triads / most if most else float("nan"),
        p_value=_as_few_triads(size, triads),
    )


def is_tournament(wins: NDArray[np.float64]) -> bool:
    """Return whether every pair of at least three conditions was answered exactly once.

    Parameters
    ----------
    wins : ndarray of shape (C, C), float64

    Returns
    -------
    bool
    """
    return len(wins) > 2 and bool((wins + wins.T + np.eye(len(wins)) == 1).all())


def _as_few_triads(size: int, triads: int) -> float:
    if size <= _EXACT:
        squares = size * (size - 1) * (2 * size - 1) / 6 - 2 * triads
        few = sum(number for total, number in _tournaments(size).items() if total >= squares)
        return float(few / 2 ** comb(size, 2))
    degrees = size * (size - 1) * (size - 2) / (size - 4) ** 2
    statistic = 8 / (size - 4) * (comb(size, 3) / 4 - triads + 0.5) + degrees
    return float(chi2.sf(statistic, degrees))


@lru_cache
def _tournaments(size: int) -> Counter[int]:
    """Return how many tournaments have each sum of squared scores."""
    tables = Counter({(0,) * size: 1})
    for pair in combinations(range(size), 2):
        step: Counter[tuple[int, ...]] = Counter()
        for scores, number in tables.items():
            for winner in pair:
                grown = list(scores)
                grown[winner] += 1
                step[tuple(grown)] += number
        tables = step
    squares: Counter[int] = Counter()
    for scores, number in tables.items():
        squares[sum(score * score for score in scores)] += number
    return squares


@dataclass(frozen=True)
class Agreement:
    """Agreement between observers.

    Parameters
    ----------
    u : float
        Kendall's coefficient of agreement: 1 if all choices are equal.
    least : float
        The least that is possible with as many observers.
    chi_square : float
        With continuity correction.
    degrees_of_freedom : float
    p_value : float
        Of as much agreement or more, if every choice were a toss of a coin.
    """

    u: float
    least: float
    chi_square: float
    degrees_of_freedom: float
    p_value: float


def agreement(counts: NDArray[np.float64]) -> Agreement | None:
    """Return Kendall's coefficient of agreement [KendallBabingtonSmith1940]_.

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j, without ties.

    Returns
    -------
    Agreement or None
        None unless every pair was answered equally often, at least three times.
    """
    size = len(counts)
    numbers = np.unique((counts + counts.T)[~np.eye(size, dtype=bool)])
    if len(numbers) != 1 or numbers[0] < 3 or (counts != np.round(counts)).any():
        return None
    observers, pairs = int(numbers[0]), comb(size, 2)
    agreeing = float(np.sum(counts * (counts - 1)) / 2)
    degrees = pairs * observers * (observers - 1) / (observers - 2) ** 2
    expected = 0.5 * pairs * comb(observers, 2) * (observers - 3) / (observers - 2)
    statistic = 4 / (observers - 2) * (agreeing - 1 - expected)
    return Agreement(
        u=2 * agreeing / (comb(observers, 2) * pairs) - 1,
        least=-1 / (observers - 1) if observers % 2 == 0 else -1 / observers,
        chi_square=statistic,
        degrees_of_freedom=degrees,
        p_value=float(chi2.sf(statistic, degrees)),
    )


@dataclass(frozen=True)
class Repeats:
    """How often answers were the same when asked again.

    Parameters
    ----------
    asked : int
        Answers to pairs that the observer had answered before.
    same : int
        Those that agreed with the first answer.
    """

    asked: int
    same: int


def repeats(trials: Iterable[Trial]) -> dict[str, Repeats]:
    """Count per observer the answers that stayed the same.

    Parameters
    ----------
    trials : iterable of Trial
        In the order of the answers; both marked repeats and the same pair under the same sample and angle.

    Returns
    -------
    dict of str to Repeats
        Observers who were asked something twice.
    """
    first: dict[tuple[str, ...], str | None] = {}
    asked: Counter[str] = Counter()
    same: Counter[str] = Counter()
    for trial in trials:
        if trial.kind not in ("test", "repeat"):
            continue
        pair = tuple(sorted((trial.condition_A, trial.condition_B)))
        key = (trial.observer, trial.sample, trial.angle, *pair)
        answer = {1: trial.condition_A, -1: trial.condition_B, 0: None}[trial.choice]
        if key in first:
            asked[trial.observer] += 1
            same[trial.observer] += answer == first[key]
        else:
            first[key] = answer
    return {name: Repeats(number, same[name]) for name, number in asked.items()}
