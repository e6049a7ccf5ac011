"""Thurstone's Case V with ties: Glenn and David's threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, xlogy
from scipy.stats import chi2

from impasto.psychophysics.scaling.batch import BatchFit, fit_batch, hazards, inverses
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.likelihood import Fit, existence, pair_design

_ITERATIONS = 100
_TOLERANCE = 1e-9
_LONGEST_STEP = 1.0
_SMALLEST = 1e-300


@dataclass(frozen=True)
class TiesFit:
    """A scale with the width of indifference.

    Parameters
    ----------
    fit : Fit
        The scale, in standard deviations of a difference; its deviance is against the proportions of wins,
        losses and ties themselves.
    threshold, threshold_error : float
        Distance below which an observer answers with a tie, and its standard error.
    log_likelihood : float
    """

    fit: Fit
    threshold: float
    threshold_error: float
    log_likelihood: float


def fit_ties(comparisons: Comparisons) -> TiesFit:
    """Fit scale and threshold by maximum likelihood.

    Parameters
    ----------
    comparisons : Comparisons

    Returns
    -------
    TiesFit

    Notes
    -----
    With η = s_i − s_j, i is chosen with probability Φ(η − τ) and refused with Φ(−η − τ); else the answer is
    a tie [GlennDavid1960]_. Standard errors come from the observed information.
    """
    conditions = len(comparisons.conditions)
    design, first, second = pair_design(conditions)
    wins, ties = comparisons.wins.sum(axis=0), comparisons.ties.sum(axis=0)
    chosen, refused, tied = wins[first, second], wins[second, first], ties[first, second]
    compared = chosen + refused + tied > 0
    design, chosen, refused, tied = design[compared], chosen[compared], refused[compared], tied[compared]
    status, parts = existence(comparisons.counts)
    if status == "converged" and not (chosen + refused).any():
        status = "unbounded"
    degrees = 2 * len(chosen) - conditions
    if status != "converged":
        nothing = np.full(conditions, np.nan)
        unknown = np.full((conditions, conditions), np.nan)
        return TiesFit(Fit(nothing, unknown, status, parts, np.nan, degrees, np.nan), np.nan, np.nan, np.nan)
    fitted = fit_ties_batch(design, chosen[None], refused[None], tied[None], conditions=conditions)
    parameters, covariance = fitted.parameters[0], fitted.covariance[0]
    scale, threshold = parameters[:-1], float(parameters[-1])
    predictor = design @ scale
    trials = chosen + refused + tied
    probabilities = (ndtr(predictor - threshold), ndtr(-predictor - threshold), _tie(predictor, threshold))
    answers = (chosen, refused, tied)
    likelihood = float(sum(xlogy(n, p).sum() for n, p in zip(answers, probabilities, strict=True)))
    deviance = 2 * (float(sum(xlogy(n, n / trials).sum() for n in answers)) - likelihood)
    return TiesFit(
        fit=Fit(
            scale=scale,
            covariance=covariance[:-1, :-1],
            status="converged" if fitted.converged[0] else "not converged",
            parts=parts,
            deviance=deviance,
            degrees_of_freedom=degrees,
            p_value=float(chi2.sf(deviance, degrees)) if degrees > 0 else float("nan"),
        ),
        threshold=threshold,
        threshold_error=float(np.sqrt(covariance[-1, -1])),
        log_likelihood=likelihood,
    )


def _tie(predictor: NDArray[np.float64], threshold: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Return the probability of a tie, without loss of digits in the tails."""
    far = np.abs(predictor)
    return np.asarray(np.maximum(ndtr(threshold - far) - ndtr(-threshold - far), _SMALLEST))


def fit_ties_batch(
    design: NDArray[np.float64],
    chosen: NDArray[np.float64],
    refused: NDArray[np.float64],
    tied: NDArray[np.float64],
    *,
    conditions: int,
    reduce_bias: bool = False,
    start: NDArray[np.float64] | None = None,
    tolerance: float = _TOLERANCE,
) -> BatchFit:
    """Fit B tables of wins, losses and ties by Newton's method.

    Parameters
    ----------
    design : ndarray of shape (K, C), float64
    chosen, refused, tied : ndarray of shape (B, K), float64
    conditions : int
    reduce_bias : bool, optional
        Whether to correct the score as in the model without ties, h being the leverage of the cell. That is
        an approximation here; it keeps every estimate finite.
    start : ndarray of shape (B, C + 1), float64, optional
    tolerance : float, optional

    Returns
    -------
    BatchFit
        The threshold is the last parameter; 0 for a table without ties, whose fit is that of the model
        without them.
    """
    batch, cells = chosen.shape
    size = conditions + 1
    some = np.asarray(tied.any(axis=1))
    if not some.all():
        return _with_tieless(design, chosen, refused, tied, some, conditions, reduce_bias, start, tolerance)
    # The predictors of "more than the threshold" and of "more than minus the threshold".
    upper = np.c_[design, -np.ones(cells)]
    lower = np.c_[design, np.ones(cells)]
    outer = [
        (one[:, :, None] * other[:, None, :]).reshape(cells, -1)
        for one, other in ((upper, upper), (lower, lower), (upper, lower))
    ]
    outer[2] = outer[2] + (lower[:, :, None] * upper[:, None, :]).reshape(cells, -1)
    scaled = (
        np.pad(design, ((0, 0), (0, 1)))[:, :, None] * np.pad(design, ((0, 0), (0, 1)))[:, None]
    ).reshape(cells, -1)
    origin = np.zeros((size, size))
    origin[:conditions, :conditions] = 1.0
    parameters = np.zeros((batch, size)) if start is None else start.copy()
    if start is None:
        parameters[:, -1] = 0.3
    covariance = np.zeros((batch, size, size))
    converged = np.zeros(batch, dtype=bool)
    for _ in range(_ITERATIONS):
        over, under = parameters @ upper.T, parameters @ lower.T
        win, _ = hazards(over, "probit")
        _, loss = hazards(under, "probit")
        tie = _tie(0.5 * (over + under), 0.5 * (under - over))
        at_over = np.exp(-0.5 * over**2) / np.sqrt(2 * np.pi) / tie
        at_under = np.exp(-0.5 * under**2) / np.sqrt(2 * np.pi) / tie
        slope_over = chosen * win - tied * at_over
        slope_under = -refused * loss + tied * at_under
        curve_over = chosen * win * (over + win) - tied * at_over * (over - at_over)
        curve_under = refused * loss * (loss - under) + tied * at_under * (under + at_under)
        curve_both = -tied * at_over * at_under
        information = curve_over @ outer[0] + curve_under @ outer[1] + curve_both @ outer[2]
        inverse = inverses(information.reshape(-1, size, size) + origin)
        gradient = slope_over @ upper + slope_under @ lower
        if reduce_bias:
            weight = curve_over + curve_under + 2 * curve_both
            leverage = weight * (inverse.reshape(-1, size * size) @ scaled.T)
            gradient[:, :conditions] -= (0.5 * leverage * 0.5 * (over + under)) @ design
        step = np.einsum("bpq,bq->bp", inverse, gradient)
        longest = np.abs(step).max(axis=1, keepdims=True)
        # Where there are ties the threshold is above 0, and no step may reach that.
        least = 0.5 * parameters[:, -1]
        parameters += step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, _SMALLEST))
        parameters[:, -1] = np.maximum(parameters[:, -1], least)
        covariance = inverse
        converged = longest[:, 0] < tolerance
        if converged.all():
            break
    shift = np.zeros((size, size))
    shift[:conditions, :conditions] = 1.0 / conditions**2
    return BatchFit(parameters, covariance - shift, converged)


def _with_tieless(
    design: NDArray[np.float64],
    chosen: NDArray[np.float64],
    refused: NDArray[np.float64],
    tied: NDArray[np.float64],
    some: NDArray[np.bool_],
    conditions: int,
    reduce_bias: bool,
    start: NDArray[np.float64] | None,
    tolerance: float,
) -> BatchFit:
    """Fit tables of which only `some` (B,) have ties: at a threshold of 0 Newton's steps would not end."""
    batch, size = len(chosen), conditions + 1
    found = BatchFit(np.zeros((batch, size)), np.zeros((batch, size, size)), np.zeros(batch, dtype=bool))
    without = fit_batch(
        design,
        chosen[~some],
        refused[~some],
        conditions=conditions,
        reduce_bias=reduce_bias,
        start=None if start is None else start[~some, :conditions],
        tolerance=tolerance,
    )
    found.parameters[~some, :conditions] = without.parameters
    found.covariance[~some, :conditions, :conditions] = without.covariance
    found.converged[~some] = without.converged
    if some.any():
        fitted = fit_ties_batch(
            design,
            chosen[some],
            refused[some],
            tied[some],
            conditions=conditions,
            reduce_bias=reduce_bias,
            start=None if start is None else start[some],
            tolerance=tolerance,
        )
        found.parameters[some] = fitted.parameters
        found.covariance[some] = fitted.covariance
        found.converged[some] = fitted.converged
    return found
