"""Place a light from where several spheres see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from impasto.calibrate.mirror import Reflection
from impasto.geometry import Array

# A distance that is this uncertain is worse than none.
_LARGEST_SHARE = 0.2
# Directions are never known better than this.
_LEAST_SD = np.radians(0.05)


@dataclass(frozen=True)
class Placed:
    """Where a light stands.

    Parameters
    ----------
    direction : ndarray of shape (3,)
        Unit vector from the painting's centre.
    position_mm : ndarray of shape (3,)
        NaN where the distance cannot be told.
    distance_sd_mm : float
        Standard deviation of the distance; NaN likewise.
    disagreement_deg : float
        Greatest angle between where a sphere sees the light and where it was placed; NaN for one sphere.
    """

    direction: Array
    position_mm: Array
    distance_sd_mm: float
    disagreement_deg: float


def place_light(views: Sequence[Reflection], *, near: bool, sd: float | None) -> Placed:
    """Place a light.

    Parameters
    ----------
    views : sequence of Reflection
        At least one.
    near : bool
        Whether lengths are in mm, so that a distance can be told.
    sd : float, optional
        Standard deviation of a direction, radians; from the views of this light alone without it.

    Notes
    -----
    The position is the one whose directions from the points on the spheres differ least, in angle, from those
    seen. Its distance counts where its standard deviation is under a fifth of it.
    """
    seen = np.array([view.direction for view in views])
    mean = seen.sum(axis=0)
    mean /= np.linalg.norm(mean)
    unknown = np.full(3, np.nan)
    if len(views) < 2:
        return Placed(mean, unknown, np.nan, np.nan)
    if near:
        points = np.array([view.point for view in views])
        position = _nearest_to_lines(points, seen)

        def off(at: Array) -> Array:
            towards = at - points
            return np.asarray((towards / np.linalg.norm(towards, axis=1, keepdims=True) - seen).ravel())

        if (position - points.mean(axis=0)) @ mean > 0:
            fit = least_squares(off, position, x_scale=np.linalg.norm(position))
            residual = float(np.linalg.norm(fit.fun) / np.sqrt(max(1, 2 * len(views) - 3)))
            spread = max(residual if sd is None else sd, _LEAST_SD)
            distance = float(np.linalg.norm(fit.x))
            direction = fit.x / distance
            covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * spread**2
            distance_sd = float(np.sqrt(direction @ covariance @ direction))
            if distance_sd < _LARGEST_SHARE * distance:
                apart = np.linalg.norm(fit.fun.reshape(-1, 3), axis=1).max()
                return Placed(direction, fit.x, distance_sd, float(np.degrees(apart)))
    apart = np.arccos(np.clip(seen @ mean, -1, 1)).max()
    return Placed(mean, unknown, np.nan, float(np.degrees(apart)))


def _nearest_to_lines(points: Array, directions: Array) -> Array:
    """Return the point with the least sum of squared distances from lines."""
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    return np.asarray(
        np.linalg.lstsq(across.sum(axis=0), (across @ points[:, :, None]).sum(axis=0)[:, 0], rcond=None)[0]
    )
