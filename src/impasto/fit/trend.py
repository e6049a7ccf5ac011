"""What lights have in common over their directions, which may as well be the painting's."""

from __future__ import annotations

import numpy as np

from impasto.fit.robust import cauchy_scale, cauchy_weight
from impasto.fit.strength import TELLING
from impasto.geometry import Array

_ROUNDS = 20


def find_trend(direction: Array, values: Array, *, told: bool = True) -> Array:
    """Return the quadratic function of direction that robustly describes values of lights, at the lights.

    It is each column's median where there are too few lights.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
    values : ndarray of shape (L, C)
    told : bool, optional
        Whether it is the median too where lights, left out, are not told by that function: of values that
        have nothing to do with direction, the trend is chance.

    Returns
    -------
    ndarray of shape (L, C)
    """
    x, y, z = direction.T
    terms = np.stack([np.ones_like(x), x, y, z, x * x, y * y, x * y], axis=1)
    level = np.broadcast_to(np.median(values, axis=0), values.shape)
    if len(direction) < 3 * terms.shape[1]:
        return level
    fitted, left_out = zip(*(_robust_fit(terms, column) for column in values.T), strict=True)
    if told and np.abs(left_out).mean() > TELLING * np.abs(values - level).mean():
        return level
    return np.stack(fitted, axis=1)


def _robust_fit(terms: Array, values: Array) -> tuple[Array, Array]:
    """Return the combination of terms (L, T) that robustly describes values (L,), and its left-out errors.

    Unlike `robust_fit` it has no prior of a known width, but a small ridge whatever the errors' size, so that
    what is fitted is linear in the values, and the left-out errors follow without fits of their own.
    """
    ridge = 0.1 * np.eye(terms.shape[1])
    ridge[0, 0] = 0.0
    weight = np.ones_like(values)
    hat = np.eye(len(values))
    for _ in range(_ROUNDS):
        weighted = terms * weight[:, None]
        hat = terms @ np.linalg.solve(terms.T @ weighted + ridge, weighted.T)
        rest = values - hat @ values
        weight = cauchy_weight(rest, cauchy_scale(rest))
    fitted = hat @ values
    return fitted, (values - fitted) / (1.0 - np.diag(hat))
