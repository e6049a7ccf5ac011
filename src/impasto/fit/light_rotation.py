"""How far all lights are rotated about the painting's normal.

Pixels one by one do not tell: under lights that are all rotated alike their normals come out rotated alike,
and so do their highlights. Neighbours tell, because only the right normals belong to a surface.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from impasto.fit.robust import cauchy_scale, cauchy_weight, robust_fit
from impasto.geometry import Array, Lights, turn_about_z

# Lights nearer the normal show highlights, which least squares take for slopes: on simulated paintings they
# rotated lights that were stated right by 0.2°.
_HIGHLIGHTS_DEG = 50.0
_LEAST_LIGHTS = 12
# Slopes from four reweightings of least squares, of pixels of which no slope exceeds the limit.
_ROUNDS = 5
_STEEPEST = 4.0
_LEAST_CROSSES = 32
# What is wrong about normals is alike in all of a paint: more crosses tell no more than so many.
_INDEPENDENT = 400


def find_rotation(crosses: NDArray[np.floating], lights: Lights, error_deg: float) -> float:
    """Return the angle by which all lights have to be rotated about Z, from X towards Y, in radians.

    Parameters
    ----------
    crosses : ndarray of shape (L, M, 4)
        Radiance of the neighbours above, right of, below and left of some pixels; NaN where it is not known.
    lights : Lights
        As found otherwise.
    error_deg : float
        By how much their directions were misstated, independently of each other: the root mean square.

    Notes
    -----
    The slopes p = ∂z/∂x and q = ∂z/∂y of a surface fulfil ∂p/∂y = ∂q/∂x, which leaves no other linear map of
    all lights than a generalised bas-relief [Belhumeur1999]_, [Yuille1997]_. Of the other maps, highlights
    tell all but the rotation to some degree. Under lights that are rotated by -φ the slopes are so too, and

        ∂p/∂y - ∂q/∂x = tan φ (∂p/∂x + ∂q/∂y),

    fitted robustly over all crosses. Slopes are those of photometric stereo, which no fitted highlight has
    turned. The lights' independent errors have a mean rotation, too: the prior of φ. Where the
    slopes are mostly noise, as on a flat painting, it keeps the rotation small.
    """
    low = lights.direction[:, 2] < np.cos(np.radians(_HIGHLIGHTS_DEG))
    if low.sum() < _LEAST_LIGHTS:
        return 0.0
    strength = lights.intensity[low].mean(axis=1)
    radiance = crosses[low].reshape(len(strength), -1) / strength[:, None]
    slopes = _slopes(radiance, lights.direction[low]).reshape(2, -1, 4)
    slopes = slopes[:, np.isfinite(slopes).all(axis=(0, 2))]
    if slopes.shape[1] < _LEAST_CROSSES:
        return 0.0
    above, right, below, left = np.moveaxis(slopes, 2, 0)
    along_x, along_y = right - left, above - below
    curl, divergence = along_y[0] - along_x[1], along_x[0] + along_y[1]
    # A prior of one radian says nothing, but solves what a perfectly flat painting leaves open.
    free = float(robust_fit(divergence[:, None], curl, np.ones(len(curl)), np.ones(1), np.zeros(1))[0])
    noise, signal = (cauchy_scale(values) for values in (curl - free * divergence, divergence))
    variance = (noise / signal) ** 2 / min(len(curl), _INDEPENDENT)
    # Of the mean of errors of one angle, over lights at distances sin θ from the axis.
    prior = np.radians(error_deg) ** 2 / (2.0 * np.square(lights.direction[:, :2]).sum())
    return float(np.arctan(free) * prior / (prior + variance))


def rotated(lights: Lights, angle: float) -> Lights:
    """Return lights rotated about Z by an angle in radians, from X towards Y."""
    return replace(
        lights,
        direction=turn_about_z(lights.direction, angle),
        position_mm=turn_about_z(lights.position_mm, angle),
    )


def _slopes(radiance: Array, direction: Array) -> Array:
    """Return the slopes (2, N) of pixels of radiance (L, N); NaN where they are not told.

    Least squares with Cauchy weights, so that shadows and highlights do not count.
    """
    known = np.isfinite(radiance)
    values = np.where(known, radiance, 0.0)
    squares = (direction[:, :, None] * direction[:, None, :]).reshape(len(direction), 9)
    weight = known.astype(np.float64)
    for _ in range(_ROUNDS):
        matrix = (weight.T @ squares).reshape(-1, 3, 3) + 1e-9 * np.eye(3)
        scaled = np.linalg.solve(matrix, ((weight * values).T @ direction)[:, :, None])[:, :, 0].T
        rest = values - direction @ scaled
        weight = known * cauchy_weight(rest, cauchy_scale(rest))
    told = scaled[2] > np.hypot(scaled[0], scaled[1]) / _STEEPEST
    told &= known.sum(axis=0) >= _LEAST_LIGHTS
    return np.where(told, -scaled[:2] / np.where(told, scaled[2], 1.0), np.nan)
