"""How far from its peak a highlight is still seen: the threshold between specular and diffuse lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impasto.fit.procedure import FitOptions
from impasto.geometry import Array, Camera, arm_direction, direction_tilts
from impasto.models import ModelSpec
from impasto.store import Maps

NEGLIGIBLE = 0.02
"""Share of the diffuse level below which a specular term counts as none."""

LEAST_DEG, MOST_DEG = 15.0, 60.0
"""Between which the threshold is chosen."""

# Of the pixels, how many shall be free of the specular term beyond the threshold.
_QUANTILE = 0.9


def lights_beyond(threshold: float, light_direction: Array, view_direction: Array) -> int:
    """Return how many lights are further from a flat pixel's brightest light than a threshold in radians.

    Parameters
    ----------
    threshold : float
    light_direction : ndarray of shape (L, 3)
        On an arm that sweeps the XZ plane.
    view_direction : ndarray of shape (3,)
    """
    mirror = view_direction * [-1.0, 0.0, 1.0]
    brightest = light_direction[(light_direction @ mirror).argmax()]
    return int(np.count_nonzero(light_direction @ brightest <= np.cos(threshold)))


def choose_threshold(
    model: ModelSpec,
    maps: Maps,
    light_direction: Array,
    camera: Camera,
    options: FitOptions,
    lights_needed: int,
) -> tuple[float, float]:
    """Choose the threshold from fits of some pixels.

    Parameters
    ----------
    model : ModelSpec
        Torrance-Sparrow.
    maps : dict of str to ndarray of shape (N[, k])
        A fit of some pixels, on an arm that sweeps the XZ plane.
    light_direction : ndarray of shape (L, 3)
    camera : Camera
    options : FitOptions
    lights_needed : int
        How many lights have to remain beyond the threshold.

    Returns
    -------
    threshold_deg : float
        Between 15 and 60 degrees, a whole number.
    seen_deg : float
        The angle from the peak beyond which nine tenths of the pixels have a specular term of less than 2 %
        of the diffuse one.
    """
    usable = maps["status"] == 0
    seen_deg = LEAST_DEG
    if usable.any():
        arm, _ = direction_tilts(light_direction)
        angles = [
            _seen_deg(model, maps, usable, side, end, camera, options)
            for side, end in ((-1.0, -arm.min()), (1.0, arm.max()))
        ]
        seen_deg = float(np.quantile(np.maximum(*angles), _QUANTILE))
    threshold_deg = float(np.ceil(np.clip(seen_deg, LEAST_DEG, MOST_DEG)))
    while (
        threshold_deg > LEAST_DEG
        and lights_beyond(np.radians(threshold_deg), light_direction, camera.view_direction) < lights_needed
    ):
        threshold_deg -= 1.0
    return threshold_deg, seen_deg


def _seen_deg(
    model: ModelSpec,
    maps: Maps,
    usable: NDArray[np.bool_],
    side: float,
    end: float,
    camera: Camera,
    options: FitOptions,
) -> Array:
    """Return the angle in degrees at which each pixel's lobe gets negligible on one side of its peak, (N,).

    `end` is where the arm ends on that side, radians; beyond it there is no light to be misled by.
    """
    from impasto import _core

    normal = maps["normal"][usable].astype(np.float64)
    level = maps["diffuse"][usable].astype(np.float64).mean(axis=-1)
    shape = np.concatenate([maps[name][usable, None] for name in model.shape_names], axis=1)
    theta, _ = direction_tilts(normal)
    mirror = 2 * theta - direction_tilts(camera.view_direction)[0]
    view = np.tile(camera.view_direction, (len(normal), 1))
    seen = np.zeros(len(normal))
    still = np.ones(len(normal), bool)
    for angle in np.arange(0.0, MOST_DEG + 1.0):
        arm = mirror + side * np.radians(angle)
        basis = _core.basis(
            model.name,
            normal,
            arm_direction(arm),
            view,
            shape.astype(np.float64),
            index=options.index,
            fresnel=options.fresnel,
        )
        still &= side * arm <= end
        still &= maps["specular"][usable] * basis[:, 1] > NEGLIGIBLE * level * basis[:, 0]
        seen = np.where(still, angle, seen)
    return seen
