"""How many observers an experiment needs, which pairs to ask next, and when to stop."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, xlogy
from scipy.stats import binom

from impasto.errors import OptionError, Problem, raise_problems
from impasto.psychophysics.scaling.comparisons import Comparisons, components, count_choices
from impasto.psychophysics.scaling.likelihood import pair_design
from impasto.psychophysics.scaling.limits import half_width, limits
from impasto.psychophysics.scaling.posterior import posterior
from impasto.psychophysics.scaling.resampling import resample_experiments
from impasto.psychophysics.scaling.trials import read_trials

_MOST_OBSERVERS = 500
# Of observers in each simulated experiment: the power is known to less than these can change.
_DRAWS = 200
# Nodes of the quadrature over a normal distribution; 21 are exact to 1e-6 here.
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(21)


@dataclass(frozen=True)
class Plan:
    """A number of observers and what it achieves.

    Parameters
    ----------
    observers : int
        The fewest that reach the power.
    power : float
        Share of the simulated experiments in which the limits of the smallest difference leave out 0.
    power_error : float
        Standard error of `power` by the number of simulations; 0 where it is computed exactly.
    tried : tuple of (int, float)
        Numbers of observers and the power of each.
    """

    observers: int
    power: float
    power_error: float
    tried: tuple[tuple[int, float], ...]


def observers_needed(
    difference: float,
    *,
    conditions: int = 2,
    power: float = 0.8,
    level: float = 0.95,
    answers: int = 1,
    variety: float = 0.0,
    simulations: int = 1000,
    seed: int = 0,
) -> Plan:
    """Return how many observers it takes to tell two conditions apart.

    Parameters
    ----------
    difference : float
        The distance to be found, in standard deviations of a difference, between neighbours on the scale.
    conditions : int, optional
        How many are compared, each with each, equally spaced.
    power : float, optional
        Probability with which two neighbours are to be told apart.
    level : float, optional
        Of the limits that have to leave out 0.
    answers : int, optional
        Answers of each observer to each pair, as under several angles that are pooled.
    variety : float, optional
        Standard deviation, between observers, of the scale value of each condition.
    simulations : int, optional
    seed : int, optional

    Returns
    -------
    Plan

    Raises
    ------
    OptionError
        If an argument is out of its range, or 500 observers do not suffice.

    Notes
    -----
    Two conditions with one answer per observer are computed exactly, from the binomial test. Otherwise
    experiments are simulated and judged as `limits.limits` does by "observers".

    The power of the exact test is not monotonic in the number of observers: the number returned is the least
    from which on the power stays above the one that is asked for, up to half as many more.
    """
    _check_plan(difference, conditions, power, level, answers, variety, simulations)
    exact = conditions == 2 and answers == 1
    tried: dict[int, float] = {}

    def reached(observers: int) -> float:
        if observers not in tried:
            tried[observers] = (
                _exact_power(observers, difference, level, variety)
                if exact
                else _simulated_power(
                    observers, difference, conditions, level, answers, variety, simulations, seed
                )
            )
        return tried[observers]

    low, high = 2, 4
    while reached(high) < power:
        low, high = high, high * 2
        if low > _MOST_OBSERVERS:
            raise OptionError(
                Problem(
                    where=f"difference {difference}",
                    what=f"{_MOST_OBSERVERS} observers find it with a probability of {reached(low):.2f} only",
                    do="Ask for a larger difference, for less power, or for more answers of each observer",
                )
            )
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reached(middle) >= power else (middle, high)
    searched = sorted(tried)
    if exact:
        failing = [number for number in range(high, high + high // 2 + 1) if reached(number) < power]
        high = failing[-1] + 1 if failing else high
    found = reached(high)
    error = 0.0 if exact else float(np.sqrt(found * (1 - found) / simulations))
    return Plan(high, found, error, tuple((n, tried[n]) for n in sorted({*searched, high})))


def _check_plan(
    difference: float,
    conditions: int,
    power: float,
    level: float,
    answers: int,
    variety: float,
    simulations: int,
) -> None:
    raise_problems(
        OptionError,
        [
            Problem(f"{name} {value}", f"must be {wanted}", "Correct it")
            for name, value, right, wanted in (
                ("difference", difference, 0 < difference < 5, "between 0 and 5"),
                ("conditions", conditions, 2 <= conditions <= 20, "from 2 to 20"),
                ("power", power, 0 < power < 1, "between 0 and 1"),
                ("level", level, 0 < level < 1, "between 0 and 1"),
                ("answers", answers, answers >= 1, "1 or more"),
                ("variety", variety, variety >= 0, "0 or more"),
                ("simulations", simulations, simulations >= 100, "100 or more"),
            )
            if not right
        ],
    )


def _exact_power(observers: int, difference: float, level: float, variety: float) -> float:
    """Return the probability that the exact binomial test finds the difference in the right direction."""
    probability = ndtr(difference / np.sqrt(1 + 2 * variety**2))
    # The least count that is significant: its upper tail under a fair coin is half of 1 − level at most.
    least = int(binom.isf((1 - level) / 2, observers, 0.5)) + 1
    return float(binom.sf(least - 1, observers, probability))


def _simulated_power(
    observers: int,
    difference: float,
    conditions: int,
    level: float,
    answers: int,
    variety: float,
    simulations: int,
    seed: int,
) -> float:
    random = np.random.default_rng(seed)
    design, first, second = pair_design(conditions)
    scale = difference * np.arange(conditions) + random.normal(
        0, variety, (simulations, observers, conditions)
    )
    chosen = random.binomial(answers, ndtr(scale @ design.T)).astype(np.float64)
    estimate, independent, drawn = resample_experiments(
        chosen, answers - chosen, conditions=conditions, draws=_DRAWS, random=random
    )
    # The second of two neighbours is to be found higher.
    neighbours = -design[second == first + 1]
    independent, drawn = (
        np.einsum("ki,mij,kj->mk", neighbours, covariance, neighbours) for covariance in (independent, drawn)
    )
    spread = half_width(independent, drawn, level, observers if answers > 1 else None)
    return float(np.mean(estimate @ neighbours.T - spread > 0))


def information_gain(counts: NDArray[np.float64], precision: float = 0.1) -> NDArray[np.float64]:
    """Return how much one more answer to each pair is expected to tell about the scale.

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j so far.
    precision : float, optional
        Inverse variance of the prior of every scale value.

    Returns
    -------
    ndarray of shape (C, C), float64
        In bits; symmetric, with 0 on the diagonal.

    Notes
    -----
    The mutual information between the answer and the distance, H(E p) − E H(p), over the posterior of the
    distance [Houlsby2011]_.
    """

    def entropy(share: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(-(xlogy(share, share) + xlogy(1 - share, 1 - share)) / np.log(2))

    mean, variance = posterior(counts, precision).differences()
    nodes = mean[..., None] + np.sqrt(np.maximum(variance, 0))[..., None] * _NODES
    weights = _WEIGHTS / _WEIGHTS.sum()
    gain = entropy(ndtr(mean / np.sqrt(1 + variance))) - entropy(ndtr(nodes)) @ weights
    return np.asarray(np.maximum(gain, 0) * ~np.eye(len(counts), dtype=bool))


def next_pairs(counts: NDArray[np.float64], precision: float = 0.1) -> tuple[tuple[int, int], ...]:
    """Return the pairs that the next observer should be asked, the most telling first.

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j so far; there may be no answers.
    precision : float, optional
        Inverse variance of the prior of every scale value.

    Returns
    -------
    tuple of (int, int)
        C − 1 pairs that connect all conditions: the tree of the greatest `information_gain`, so that a batch
        is chosen at once and no condition is left alone [Mikhailiuk2021]_.
    """
    from scipy.sparse.csgraph import minimum_spanning_tree

    gain = information_gain(counts, precision)
    # Entries of 0 would mean that there is no edge.
    tree = minimum_spanning_tree(np.triu(gain.max() + 1 - gain, 1)).toarray()
    pairs = [(int(i), int(j)) for i, j in np.argwhere(tree)]
    return tuple(sorted(pairs, key=lambda pair: -gain[pair]))


@dataclass(frozen=True)
class Stopping:
    """Whether an experiment may stop.

    Parameters
    ----------
    stop : bool
    widest : float
        The largest half-width of the limits of any difference, in standard deviations of a difference.
    why : str
    """

    stop: bool
    widest: float
    why: str


def stopping_rule(
    comparisons: Comparisons, *, within: float = 0.3, least: int = 18, most: int = 100, level: float = 0.95
) -> Stopping:
    """Tell whether to stop: when every difference is known well enough, or at the last observer.

    Parameters
    ----------
    comparisons : Comparisons
        Of complete sessions only.
    within : float, optional
        Half-width to be reached by the limits of all differences.
    least, most : int, optional
        Observers before whom it never stops, and with whom it always does.
    level : float, optional

    Returns
    -------
    Stopping

    Notes
    -----
    The rule looks at how wide the limits are and never at where they lie: stopping at the first significant
    difference would find one by chance in far more than 5 % of all experiments [Anscombe1953]_. State all
    four numbers before the experiment.
    """
    observers = len(comparisons.observers)
    counts = comparisons.counts
    widest = float("inf")
    if len(components(counts + counts.T > 0)) == 1 and observers > 1:
        found = limits(comparisons, method="observers", level=level)
        widest = float(np.max(found.difference_high - found.difference_low) / 2)
    if observers < least:
        return Stopping(False, widest, f"{observers} of at least {least} observers")
    if widest <= within:
        return Stopping(True, widest, f"every difference is known to ±{widest:.2f}")
    if observers >= most:
        return Stopping(True, widest, f"{observers} observers, the most that were planned")
    return Stopping(False, widest, f"a difference is known to ±{widest:.2f} only, not to ±{within:g}")


@dataclass(frozen=True)
class ObserversSummary:
    """What `observers` found.

    Parameters
    ----------
    plan : Plan or None
        None if no difference was asked for.
    stopping : Stopping or None
        None without trials.
    next_pairs : tuple of (str, str)
        What the next observer should be asked.
    simulated : int
        How many of the observers in the trials are no persons.
    """

    plan: Plan | None
    stopping: Stopping | None
    next_pairs: tuple[tuple[str, str], ...]
    simulated: int


def observers(
    difference: float | None = None,
    *,
    conditions: int = 2,
    power: float = 0.8,
    level: float = 0.95,
    answers: int = 1,
    variety: float = 0.0,
    trials: str | PathLike[str] | None = None,
    within: float = 0.3,
    least: int = 18,
    most: int = 100,
) -> ObserversSummary:
    """Tell how many observers an experiment needs, when to stop it, and which pairs to ask next.

    Parameters
    ----------
    difference : float, optional
        Distance to be found between neighbours on the scale, in standard deviations of a difference.
    conditions, power, level, answers, variety : optional
        See `observers_needed`.
    trials : path, optional
        Answers so far.
    within, least, most : optional
        See `stopping_rule`.

    Returns
    -------
    ObserversSummary

    Raises
    ------
    OptionError
        If neither a difference nor trials are given, or an argument is out of its range.
    TrialsError
        If the trials cannot be used.
    """
    if difference is None and trials is None:
        raise OptionError(
            Problem("observers", "is asked about nothing", "Give a difference to plan for, or trials so far")
        )
    plan = stopping = None
    pairs: tuple[tuple[str, str], ...] = ()
    simulated = 0
    if difference is not None:
        plan = observers_needed(
            difference, conditions=conditions, power=power, level=level, answers=answers, variety=variety
        )
    if trials is not None:
        read = [trial for trial in read_trials(trials) if trial.kind == "test"]
        comparisons = count_choices(read)
        stopping = stopping_rule(comparisons, within=within, least=least, most=most, level=level)
        names = comparisons.conditions
        pairs = tuple((names[i], names[j]) for i, j in next_pairs(comparisons.counts))
        simulated = len({trial.observer for trial in read if trial.simulated})
    return ObserversSummary(plan, stopping, pairs, simulated)
