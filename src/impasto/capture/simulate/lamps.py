"""Where the lights of a simulated capture stand: on an arm, in a dome, near or far."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impasto.geometry import Lights, arm_direction

Array = NDArray[np.float64]

ARM_COUNT, DOME_COUNT = 37, 48
ARM_REACH_DEG = 72.0
# A dome leaves a hole for the camera, and its lowest lights must clear the table.
_DOME_ZENITH_DEG = (12.0, 76.0)
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5.0))


def arm_angles_deg(count: int = ARM_COUNT) -> Array:
    """Return the arm's angles, evenly from -72° to 72°: every 4° by default."""
    return np.linspace(-ARM_REACH_DEG, ARM_REACH_DEG, count) if count > 1 else np.zeros(1)


def dome_directions(count: int = DOME_COUNT) -> Array:
    """Return light directions spread evenly over a dome, ndarray of shape (count, 3).

    Notes
    -----
    A golden-angle spiral: equal areas of the sphere, no two lights at one azimuth, from zenith 12° to 76°.
    """
    top, bottom = np.cos(np.radians(_DOME_ZENITH_DEG))
    z = top + (bottom - top) * (np.arange(count) + 0.5) / count
    azimuth = GOLDEN_ANGLE * np.arange(count)
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=-1)


def arm_lights(count: int = ARM_COUNT) -> Lights:
    """Return the lights of an arm, named light-000, …"""
    return named(arm_direction(np.radians(arm_angles_deg(count))))


def dome_lights(count: int = DOME_COUNT) -> Lights:
    """Return the lights of a dome, named light-000, …"""
    return named(dome_directions(count))


def named(direction: Array) -> Lights:
    """Return distant lights of unit intensity at the given directions of shape (L, 3)."""
    direction = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    return Lights(tuple(f"light-{number:03d}" for number in range(len(direction))), direction)


def set_up(
    lights: Lights, *, distance_mm: float | None, gain_spread: float, angular_size_deg: float, seed: int
) -> Lights:
    """Return lights as they stand in the studio.

    Parameters
    ----------
    lights : Lights
    distance_mm : float or None
        Distance of each light that has no position from the painting's centre; None leaves it far away.
    gain_spread : float
        Standard deviation of the lamps' relative intensities.
    angular_size_deg : float
        Angular diameter of the lamps that state none.
    seed : int
        Decides the intensities.
    """
    rng = np.random.default_rng((seed, 2))
    spread = np.exp(gain_spread * rng.standard_normal(len(lights)))[:, None]
    position = lights.position_mm.copy()
    if distance_mm is not None:
        far = ~np.isfinite(position).all(axis=1)
        position[far] = distance_mm * lights.direction[far]
    size = np.where(np.isfinite(lights.angular_size_deg), lights.angular_size_deg, angular_size_deg)
    return Lights(lights.names, lights.direction, position, lights.intensity * spread, size)
