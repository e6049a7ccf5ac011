"""Fit a linear scale to many tables of choices at once, by maximum likelihood or with its bias removed.

The resampling of observers and the Monte Carlo studies need hundreds of thousands of small fits; all of them
share one design and go through the same matrix products.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, expit, ndtr

Link = Literal["probit", "logit"]

_ITERATIONS = 60
_TOLERANCE = 1e-9
# Longest step of a parameter: the likelihood is flat where all answers agree.
_LONGEST_STEP = 1.5


@dataclass(frozen=True)
class BatchFit:
    """Fits of B tables.

    Parameters
    ----------
    parameters : ndarray of shape (B, P), float64
        The scale, of mean 0, then what the design has beside it.
    covariance : ndarray of shape (B, P, P), float64
        Inverse of the expected information at the parameters.
    converged : ndarray of shape (B,), bool
    """

    parameters: NDArray[np.float64]
    covariance: NDArray[np.float64]
    converged: NDArray[np.bool_]


def hazards(predictor: NDArray[np.float64], link: Link) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the derivatives of log p and of −log(1 − p) with respect to the predictor, stable in the tails.

    Parameters
    ----------
    predictor : ndarray, float64
    link : {"probit", "logit"}

    Returns
    -------
    for_chosen, for_refused : ndarray, float64
    """
    if link == "logit":
        return expit(-predictor), expit(predictor)
    scaled = predictor * np.sqrt(0.5)
    return np.sqrt(2 / np.pi) / erfcx(-scaled), np.sqrt(2 / np.pi) / erfcx(scaled)


def probability(predictor: NDArray[np.float64], link: Link) -> NDArray[np.float64]:
    """Return the probability of the first condition being chosen.

    Parameters
    ----------
    predictor : ndarray, float64
    link : {"probit", "logit"}

    Returns
    -------
    ndarray, float64
    """
    return np.asarray(ndtr(predictor) if link == "probit" else expit(predictor))


def fit_batch(
    design: NDArray[np.float64],
    chosen: NDArray[np.float64],
    refused: NDArray[np.float64],
    *,
    conditions: int,
    link: Link = "probit",
    reduce_bias: bool = False,
    precision: float = 0.0,
    offset: NDArray[np.float64] | None = None,
    start: NDArray[np.float64] | None = None,
    iterations: int = _ITERATIONS,
    tolerance: float = _TOLERANCE,
) -> BatchFit:
    """Fit B tables of choices by Fisher scoring.

    Parameters
    ----------
    design : ndarray of shape (K, P), float64
        Row k gives the predictor of cell k: +1 and −1 for the two conditions, then other effects.
    chosen, refused : ndarray of shape (B, K), float64
        How often the first condition of the cell was chosen, and the second; may be fractions.
    conditions : int
        How many of the P parameters are scale values, of which only differences are known.
    link : {"probit", "logit"}, optional
        Thurstone's Case V (unit: standard deviation of a difference) or Bradley-Terry (unit: log odds).
    reduce_bias : bool, optional
        Whether to remove the first-order bias, which keeps every estimate finite, also where all agree.
    precision : float, optional
        Inverse variance of a normal prior of every parameter, of mean 0.
    offset : ndarray of shape (B, K), float64, optional
        Known part of the predictors.
    start : ndarray of shape (B, P), float64, optional
    iterations : int, optional
    tolerance : float, optional
        Largest change of a parameter at which a fit is done.

    Returns
    -------
    BatchFit

    Notes
    -----
    With the derivatives d and d' of the probability with respect to the predictor η, the score is corrected
    by Σ h d' / (2 d) x, h being the leverage of the cell [Firth1993]_, [KosmidisFirth2009]_; for the probit
    link d'/d is −η, for the logit 1 − 2p.
    """
    batch, (cells, size) = len(chosen), design.shape
    outer = (design[:, :, None] * design[:, None, :]).reshape(cells, size * size)
    # The scale has no origin: this makes the information regular and holds the mean at 0.
    origin = np.zeros((size, size))
    origin[:conditions, :conditions] = 1.0
    prior = precision * np.eye(size)
    trials = chosen + refused
    parameters = np.zeros((batch, size)) if start is None else start.copy()
    covariance = np.zeros((batch, size, size))
    converged = np.zeros(batch, dtype=bool)
    open_ = np.arange(batch)
    for _ in range(iterations):
        predictor = parameters[open_] @ design.T
        if offset is not None:
            predictor += offset[open_]
        up, down = hazards(predictor, link)
        weight = trials[open_] * up * down
        inverse = inverses((weight @ outer).reshape(-1, size, size) + origin + prior)
        residual = chosen[open_] * up - refused[open_] * down
        if reduce_bias:
            leverage = weight * (inverse.reshape(-1, size * size) @ outer.T)
            curvature = -predictor if link == "probit" else up - down
            residual = residual + 0.5 * leverage * curvature
        step = np.einsum("bpq,bq->bp", inverse, residual @ design - precision * parameters[open_])
        longest = np.abs(step).max(axis=1, keepdims=True, initial=0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
        parameters[open_] += step
        covariance[open_] = inverse
        done = longest[:, 0] < tolerance
        converged[open_[done]] = True
        open_ = open_[~done]
        if not len(open_):
            break
    # The inverse stands at the step before last, which differs by less than the tolerance.
    shift = np.zeros((size, size))
    shift[:conditions, :conditions] = 1.0 / max(conditions, 1) ** 2
    return BatchFit(parameters, covariance - shift, converged)


def inverses(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverses of matrices (B, P, P); where information vanishes, with a trace of it added."""
    try:
        return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.inv(matrices + 1e-10 * np.eye(matrices.shape[-1])), dtype=np.float64)
