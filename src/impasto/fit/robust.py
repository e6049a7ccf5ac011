"""Least squares by iterative reweighting with Cauchy weights, for few unknowns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.geometry import Array

_ROUNDS = 10


def cauchy_scale(rest: Array) -> Array:
    """Return the size of a residual at which its weight is one half: two standard deviations.

    Parameters
    ----------
    rest : ndarray of shape (N, ...)
        The median size along the first axis tells the standard deviation as of normal errors.

    Returns
    -------
    ndarray of shape (...)
    """
    result: Array = 2.0 * 1.4826 * np.median(np.abs(rest), axis=0) + 1e-9
    return result


def cauchy_weight(rest: Array, scale: ArrayLike) -> Array:
    """Return the weights 1 / (1 + (r / s)²) of residuals r (N, ...) at a scale s of shape (...)."""
    result: Array = 1.0 / (1.0 + np.square(rest / np.asarray(scale)))
    return result


def robust_fit(
    terms: Array, values: Array, weight: Array, precision: Array, mean: Array
) -> NDArray[np.floating[Any]]:
    """Return the combination of terms that robustly describes values, under a normal prior.

    Parameters
    ----------
    terms : ndarray of shape (N, T)
    values : ndarray of shape (N,)
    weight : ndarray of shape (N,)
        How much each value counts before it is known how far off it is; 1 in the mean.
    precision, mean : ndarray of shape (T,)
        Of the independent priors of the T factors; 0 for a factor that is free.

    Returns
    -------
    ndarray of shape (T,)

    Notes
    -----
    The variance of the values, over which the prior's counts, is that of what is left of them.
    """
    found: NDArray[np.floating[Any]] = np.zeros(terms.shape[1])
    own = weight
    for _ in range(_ROUNDS):
        weighted = terms * own[:, None]
        scale = cauchy_scale(values - terms @ found)
        prior = precision * (scale / 2.0) ** 2
        found = np.linalg.solve(terms.T @ weighted + np.diag(prior), weighted.T @ values + prior * mean)
        own = weight * cauchy_weight(values - terms @ found, scale)
    return found
