"""Whether a highlight crosses the arm's plane; where none does, As and the shape are not identified.

A normal with φn = φv/2 mirrors the camera into the arm's plane. For a normal that is o away from it, the arm
sees the Trowbridge-Reitz lobe of width c as one of width √(c² + o²) and of (c²/(c² + o²))² the height, for
small angles: it cannot tell a wide, weak highlight from the foot of a narrow, strong one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impasto.geometry import Array, direction_tilts
from impasto.store import Maps

_QUANTILE = 0.99
# What a normal distribution has of its absolute values below that quantile, in standard deviations.
_QUANTILE_SIGMAS = 2.576
# Fits with the foot of the lobe alone are wrong by tens of per cent from here on.
_LARGEST_OFFSET = 0.64


@dataclass(frozen=True)
class Crossing:
    """How near the painting's normals come to the plane in which the arm sees their highlights.

    Parameters
    ----------
    view_phi : float
        φv, the camera's tilt out of the arm's plane, radians.
    reach : float
        How far normals are taken to tilt out of the plane, radians.
    c_apparent : float
        Width of the brightest pixel's highlight, as it looks from the arm.
    """

    view_phi: float
    reach: float
    c_apparent: float

    @property
    def offset(self) -> float:
        """How far the nearest normals stay from φv/2, radians."""
        return max(0.0, abs(self.view_phi) / 2 - self.reach)

    @property
    def c(self) -> float:
        """The width that a highlight seen from `offset` away must have to look like `c_apparent`."""
        return float(np.sqrt(max(0.0, self.c_apparent**2 - self.offset**2)))

    @property
    def identified(self) -> bool:
        """Whether As and the shape can be told."""
        return self.offset <= _LARGEST_OFFSET * self.c


def normal_reach(*fits: Maps, light_direction: Array, noise: tuple[float, float, float]) -> float:
    """Return how far the normals of a sample tilt, from their spread in the arm's plane.

    Relief is taken to be as steep across the arm as along it.

    Parameters
    ----------
    fits : dict of str to ndarray of shape (N[, k])
        Fits of some pixels of the sample; what makes one of them err, such as tails of highlights or a
        highlight in another colour, the other may bear, so the one with the smaller spread counts.
    light_direction : ndarray of shape (L, 3)
    noise : tuple of float
        (read, photon, relative), see `store.Stack.noise`.

    Returns
    -------
    float
        Radians: the 99th percentile of |θn − its median|, less what the noise explains.
    """
    return min(_reach(maps, light_direction, noise) for maps in fits)


def _reach(maps: Maps, light_direction: Array, noise: tuple[float, float, float]) -> float:
    fitted = np.isfinite(maps["normal"]).all(axis=-1)
    if not fitted.any():
        return 0.0
    theta, _ = direction_tilts(maps["normal"][fitted])
    spread = np.quantile(np.abs(theta - np.median(theta)), _QUANTILE)
    sigma = _theta_sd(theta, maps["diffuse"][fitted].astype(np.float64), light_direction, noise)
    return float(np.sqrt(max(0.0, spread**2 - (_QUANTILE_SIGMAS * sigma) ** 2)))


def _theta_sd(
    theta: Array, diffuse: Array, light_direction: Array, noise: tuple[float, float, float]
) -> float:
    """Return the standard deviation of θn, fitted with Ad to Ad cos(θa − θn), in the mean over the pixels."""
    read, photon, relative = noise
    angle = np.arctan2(light_direction[:, 0], light_direction[:, 2])[:, None] - theta
    lit = np.cos(angle) > 0
    level = np.where(lit, np.cos(angle), 0.0)
    slope = np.where(lit, np.sin(angle), 0.0)
    # Ad is free: only what of the slope is no multiple of the level tells θn.
    slope -= level * (slope * level).sum(axis=0) / (level * level).sum(axis=0)
    squared = slope**2
    variance = np.zeros_like(theta)
    weight = np.zeros_like(theta)
    for channel in diffuse.T:
        radiance = channel * level
        of_sample = read**2 + photon * radiance + (relative * radiance) ** 2
        variance += channel**2 * (squared * of_sample).sum(axis=0)
        weight += channel**2 * squared.sum(axis=0)
    return float(np.sqrt(np.mean(variance / np.maximum(weight, 1e-30) ** 2)))
