"""Confidence limits of scale values and of their differences."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import log_expit, log_ndtr, ndtri
from scipy.stats import beta, binomtest, chi2, norm
from scipy.stats import t as student

from impasto.errors import OptionError, Problem
from impasto.psychophysics.scaling.batch import Link, fit_batch
from impasto.psychophysics.scaling.closed_form import fit_closed_form
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.likelihood import JOD, pair_design
from impasto.psychophysics.scaling.resampling import resample_observers

Method = Literal["auto", "observers", "percentile", "likelihood", "montag", "exact"]
METHODS: dict[str, str] = {
    "auto": "exact for two conditions with one answer per observer, observers otherwise",
    "observers": "bootstrap over observers, never narrower than independent answers would make them",
    "percentile": "percentiles of the bootstrap over observers",
    "likelihood": "profile likelihood, as if all answers were independent",
    "montag": "Montag's formula for the scale in closed form",
    "exact": "exact binomial limits, for two conditions with one answer per observer",
}

# Fewer observers than this cannot show how much observers differ.
_FEW_OBSERVERS = 6
_FARTHEST = 12.0
# From the first to the last stimulus: up to here Montag's limits cover 93 % (benchmarks/coverage.md).
_CLOSE = 1.2


@dataclass(frozen=True)
class Limits:
    """Limits of a scale.

    Parameters
    ----------
    method : str
        How they were found; never "auto".
    level : float
        Probability with which a limit pair is to cover, such as 0.95.
    low, high : ndarray of shape (C,), float64
        Of the scale of mean 0, in the units of the scale; infinite where the data do not bound it.
    difference_low, difference_high : ndarray of shape (C, C), float64
        Of s_i − s_j.
    notes : tuple of str
        What limits these limits.
    p_value : float
        For two conditions and the exact method: of counts as uneven if both were the same; else NaN.
    """

    method: str
    level: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    difference_low: NDArray[np.float64]
    difference_high: NDArray[np.float64]
    notes: tuple[str, ...] = field(default=())
    p_value: float = float("nan")


def limits(
    comparisons: Comparisons,
    *,
    method: Method = "auto",
    level: float = 0.95,
    draws: int = 1000,
    seed: int = 0,
    link: Link = "probit",
) -> Limits:
    """Return confidence limits of all scale values and differences.

    Parameters
    ----------
    comparisons : Comparisons
        Connected.
    method : {"auto", "observers", "percentile", "likelihood", "montag", "exact"}, optional
        See `METHODS`.
    level : float, optional
        Probability of covering, between 0 and 1.
    draws : int, optional
        How often observers are drawn.
    seed : int, optional
        Of the draws.
    link : {"probit", "logit"}, optional

    Returns
    -------
    Limits

    Raises
    ------
    OptionError
        If there is no such method, or it cannot be used with these data.

    Notes
    -----
    "observers" centres on the estimate with its first-order bias removed [Firth1993]_, which is finite where
    all agree, and takes the larger of two half-widths: that of the bootstrap over observers and that of
    independent answers. Where an observer's answers to a pair are pooled, Student's t with one degree of
    freedom less than there are observers multiplies the first. A plain bootstrap sees no variance where all
    agree: for that reason its limits cover as little as half of the time.
    """
    if method not in METHODS:
        raise OptionError(
            Problem(f"limits by {method}", "there is no such method", f"Choose among {', '.join(METHODS)}")
        )
    if not 0 < level < 1:
        raise OptionError(
            Problem(f"level {level}", "is not between 0 and 1", "Give a probability such as 0.95")
        )
    single = not comparisons.has_repeats
    two = len(comparisons.conditions) == 2
    if method == "auto":
        if two and single:
            method = "exact"
        else:
            method = "observers" if len(comparisons.observers) > 1 else "likelihood"
    if method == "exact":
        return _exact(comparisons, level, single=single)
    if method == "montag":
        return _montag(comparisons, level, single=single)
    if method == "likelihood":
        return _likelihood(comparisons, level, link, single=single)
    return _resampled(comparisons, method, level, draws, seed, link)


def _contrasts(conditions: int) -> NDArray[np.float64]:
    """Return the weights of the scale values in each value of mean 0, then in each difference."""
    design, _, _ = pair_design(conditions)
    return np.vstack([np.eye(conditions) - 1 / conditions, design])


def _assemble(
    conditions: int,
    method: str,
    level: float,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    notes: list[str],
) -> Limits:
    _, first, second = pair_design(conditions)
    difference_low, difference_high = np.zeros((2, conditions, conditions))
    difference_low[first, second], difference_high[first, second] = low[conditions:], high[conditions:]
    difference_low[second, first], difference_high[second, first] = -high[conditions:], -low[conditions:]
    return Limits(
        method,
        level,
        low[:conditions],
        high[:conditions],
        difference_low,
        difference_high,
        tuple(notes),
    )


def _resampled(
    comparisons: Comparisons, method: str, level: float, draws: int, seed: int, link: Link
) -> Limits:
    observers = len(comparisons.observers)
    if observers < 2:
        raise OptionError(
            Problem(
                where=f"limits by {method}",
                what="there is one observer, and observers cannot be drawn",
                do="Take the limits by likelihood, which hold for this observer only",
            )
        )
    notes = []
    if observers < _FEW_OBSERVERS:
        notes.append(f"{observers} observers are too few to tell how much observers differ")
    found = resample_observers(comparisons, draws=draws, seed=seed, link=link)
    if not found.converged:
        notes.append("the fit with its bias removed did not converge; the limits are not to be used")
    if found.unusable:
        notes.append(f"{found.unusable} of {draws} draws of observers gave no scale and were left out")
    contrasts = _contrasts(len(comparisons.conditions))
    centre = contrasts @ found.scale
    tail = (1 - level) / 2
    if method == "percentile":
        low, high = np.quantile(found.drawn @ contrasts.T, [tail, 1 - tail], axis=0)
        notes.append("percentiles cover less often than they should with few observers or where all agree")
    else:
        spread = half_width(
            _along(contrasts, found.covariance),
            _along(contrasts, found.drawn_covariance),
            level,
            observers if comparisons.has_repeats else None,
        )
        low, high = centre - spread, centre + spread
    return _assemble(len(comparisons.conditions), method, level, low, high, notes)


def _along(contrasts: NDArray[np.float64], covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ki,...ij,kj->...k", contrasts, covariance, contrasts))


def half_width(
    variance: NDArray[np.float64], drawn_variance: NDArray[np.float64], level: float, pooled: int | None
) -> NDArray[np.float64]:
    """Return half the distance between the limits by the method "observers".

    Parameters
    ----------
    variance : ndarray, float64
        If all answers were independent.
    drawn_variance : ndarray, float64
        Over the draws of observers; NaN where there is none.
    level : float
    pooled : int or None
        Number of observers if several answers of one observer are pooled, else None.

    Returns
    -------
    ndarray, float64
    """
    tail = (1 - level) / 2
    factor = norm.isf(tail)
    factor_drawn = factor if pooled is None else student.isf(tail, pooled - 1)
    independent = factor * np.sqrt(np.maximum(variance, 0))
    drawn = factor_drawn * np.sqrt(np.maximum(drawn_variance, 0))
    return np.asarray(np.fmax(independent, drawn))


def _exact(comparisons: Comparisons, level: float, *, single: bool) -> Limits:
    """Return Clopper and Pearson's limits of the proportion, as deviates [ClopperPearson1934]_."""
    if len(comparisons.conditions) != 2 or not single:
        what = (
            f"there are {len(comparisons.conditions)} conditions"
            if single
            else "observers answered repeatedly"
        )
        raise OptionError(
            Problem(
                where="limits by exact",
                what=f"{what}, and these limits are for two with one answer per observer",
                do="Leave the choice to auto",
            )
        )
    first, second = (int(comparisons.wins.sum(axis=0)[i, 1 - i]) for i in (0, 1))
    ties, tail = int(comparisons.ties.sum() / 2), (1 - level) / 2
    notes = [f"{ties} ties were left out"] if ties else []
    lowest = ndtri(beta.ppf(tail, first, second + 1)) if first else -np.inf
    highest = ndtri(beta.isf(tail, first + 1, second)) if second else np.inf
    low = np.array([lowest / 2, -highest / 2, lowest])
    high = np.array([highest / 2, -lowest / 2, highest])
    found = _assemble(2, "exact", level, low, high, notes)
    p_value = float(binomtest(first, first + second).pvalue) if first + second else float("nan")
    return Limits(**{**found.__dict__, "p_value": p_value})


def montag_sigma(conditions: int, observations: float) -> float:
    """Return the standard error that Montag's formula gives to each scale value [Montag2006]_.

    Parameters
    ----------
    conditions : int
        Number of stimuli.
    observations : float
        Answers per pair, more than 2.55.

    Returns
    -------
    float
        In standard deviations of a difference, for the scale as mean of the rows of deviates.

    Raises
    ------
    ValueError
        If there are too few observations.
    """
    if observations <= 2.55:
        raise ValueError("the formula needs at least 3 observations per pair")
    return float(1.76 * (conditions + 3.08) ** -0.613 * (observations - 2.55) ** -0.491)


def _montag(comparisons: Comparisons, level: float, *, single: bool) -> Limits:
    conditions = len(comparisons.conditions)
    counts = comparisons.counts
    observations = (counts + counts.T)[~np.eye(conditions, dtype=bool)]
    if observations.min() <= 2.55:
        raise OptionError(
            Problem(
                where="limits by montag",
                what=f"a pair has {observations.min():.0f} answers, and the formula needs at least 3 of each",
                do="Take the limits by observers",
            )
        )
    number = float(observations.mean())
    closed = fit_closed_form(counts)
    sigma = montag_sigma(conditions, number)
    notes = montag_notes(conditions, number, closed.scale)
    if not single:
        notes.append("Montag's formula takes pooled answers of an observer for independent: too narrow")
    if np.ptp(observations):
        notes.append("Montag's formula is for equally many answers per pair; their mean was taken")
    centre = _contrasts(conditions) @ closed.scale
    factor = norm.isf((1 - level) / 2) * sigma
    # The values of a scale of mean 0 are correlated by −1/(C − 1).
    of_difference = factor * np.sqrt(2 * conditions / (conditions - 1))
    spread = np.r_[np.full(conditions, factor), np.full(len(centre) - conditions, of_difference)]
    return _assemble(conditions, "montag", level, centre - spread, centre + spread, notes)


def montag_notes(conditions: int, observations: float, scale: NDArray[np.float64]) -> list[str]:
    """Return where Montag's formula does not hold for these data.

    Parameters
    ----------
    conditions : int
    observations : float
        Answers per pair.
    scale : ndarray of shape (C,), float64

    Returns
    -------
    list of str
        Empty inside its limits.
    """
    notes = []
    if conditions < 4:
        notes.append(f"Montag's formula is for 4 stimuli and more, not {conditions}: 8 to 12 % wide for two")
    if observations < 18:
        notes.append(f"Montag's formula is for 18 answers per pair and more, not {observations:.3g}")
    if (spread := float(np.ptp(scale))) > _CLOSE:
        notes.append(
            f"Montag's formula is for close stimuli, and these are {spread:.2g} z apart in all: from "
            f"{_CLOSE} z on its limits cover less than they say, by much where they are far"
        )
    return notes


def _likelihood(comparisons: Comparisons, level: float, link: Link, *, single: bool) -> Limits:
    """Return where twice the fall of the profile likelihood reaches the quantile of chi-square."""
    conditions = len(comparisons.conditions)
    design, first, second = pair_design(conditions)
    counts = comparisons.counts
    compared = (counts + counts.T)[first, second] > 0
    design = design[compared]
    chosen, refused = counts[first, second][compared], counts[second, first][compared]
    logarithm = log_ndtr if link == "probit" else log_expit
    reach = _FARTHEST if link == "probit" else _FARTHEST * JOD

    def value(predictor: NDArray[np.float64]) -> float:
        return float(chosen @ logarithm(predictor) + refused @ logarithm(-predictor))

    free = fit_batch(design, chosen[None], refused[None], conditions=conditions, link=link)
    scale = free.parameters[0]
    lowest = value(design @ scale) - chi2.ppf(level, 1) / 2

    def profile(at: float, contrast: NDArray[np.float64], across: NDArray[np.float64]) -> float:
        """Return the greatest likelihood with the contrast held at a value, less what it may fall to."""
        offset = at * (design @ contrast) / (contrast @ contrast)
        if across.shape[1]:
            rest = fit_batch(
                design @ across,
                chosen[None],
                refused[None],
                conditions=0,
                link=link,
                offset=offset[None],
                start=(across.T @ scale)[None],
                tolerance=1e-7,
            )
            offset = offset + design @ (across @ rest.parameters[0])
        return float(value(offset) - lowest)

    contrasts = _contrasts(conditions)
    bounds = np.empty((len(contrasts), 2))
    for number, contrast in enumerate(contrasts):
        # What is left of the scale when this contrast and the mean are held.
        across = np.linalg.svd(np.vstack([contrast, np.ones(conditions)]))[2][2:].T
        best = float(np.clip(contrast @ scale, -reach, reach))
        for side, end in enumerate((-reach, reach)):
            bounded = profile(end, contrast, across) < 0 < profile(best, contrast, across)
            bounds[number, side] = (
                brentq(profile, best, end, args=(contrast, across), xtol=1e-6)
                if bounded
                else np.copysign(np.inf, end)
            )
    notes = []
    if not single:
        notes.append("limits by likelihood take pooled answers of an observer for independent: too narrow")
    elif comparisons.summed:
        notes.append("limits by likelihood take all answers for independent")
    if comparisons.has_ties:
        notes.append("limits by likelihood count a tie as half a choice for each")
    return _assemble(conditions, "likelihood", level, bounds[:, 0], bounds[:, 1], notes)
