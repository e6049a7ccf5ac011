"""Ways to place lights without an expected error: evenly, by the highlights' places and width, at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from impasto.arm import find_arm
from impasto.fit.information import in_grey
from impasto.geometry import Array, Camera, Lights, turn_about_z
from impasto.pixels import Pixels, render_pixels

# How much of an informed placement goes where highlights are; the rest is spread for the diffuse term.
_HIGHLIGHT_SHARE = 0.5


def arm_angles_deg(direction: Array) -> Array | None:
    """Return the angles of lights (L, 3) on their arm, in degrees, or None if they lie in no plane."""
    arm = find_arm(direction)
    if not arm.planar:
        return None
    x, _, z = turn_about_z(direction, -arm.azimuth).T
    return np.asarray(np.degrees(np.arctan2(x, z)))


def even_lights(direction: Array, size: int) -> tuple[int, ...]:
    """Return lights spread evenly: at equal steps along an arm, else each as far from the others as can be.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
    size : int

    Returns
    -------
    tuple of int
        In rising order.
    """
    angle = arm_angles_deg(direction)
    if angle is not None:
        from scipy.optimize import linear_sum_assignment

        wanted = np.linspace(angle.min(), angle.max(), size) if size > 1 else np.array([np.median(angle)])
        _, chosen = linear_sum_assignment(np.abs(wanted[:, None] - angle))
        return tuple(sorted(chosen.tolist()))
    apart = _squared_angles(direction)
    first = int(apart.max(axis=1).argmax())
    even = [first]
    while len(even) < size:
        nearest = apart[even].min(axis=0)
        nearest[even] = -1.0
        even.append(int(nearest.argmax()))
    return tuple(sorted(even))


def highlight_density(pixels: Pixels, lights: Lights, camera: Camera) -> Array:
    """Return how many of the highlights fall on each light: the histogram of normals, as wide as the lobes.

    Parameters
    ----------
    pixels : Pixels
    lights : Lights
    camera : Camera

    Returns
    -------
    ndarray of shape (L,)
        Of sum 1, or zeros where no pixel has a highlight.
    """
    grey = in_grey(pixels)
    even = Lights(lights.names, lights.direction, lights.position_mm)
    matte = np.zeros_like(grey.diffuse)
    only = replace(grey, diffuse=matte, ambient=None if grey.ambient is None else matte)
    lobes = render_pixels(only, even, camera)[..., 0].astype(np.float64)
    total = lobes.sum(axis=0)
    shares = lobes[:, total > 0] / total[total > 0]
    return np.asarray(shares.mean(axis=1)) if shares.size else np.zeros(len(lights))


def informed_lights(direction: Array, density: Array, size: int) -> tuple[int, ...]:
    """Return lights placed by the density of highlights, half of them, and evenly [Chen2007]_.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
    density : ndarray of shape (L,)
        As `highlight_density` gives it.
    size : int

    Returns
    -------
    tuple of int
        In rising order: those for which the squared angle to the nearest chosen light, weighted by the
        density, is least.
    """
    count = len(direction)
    weight = _HIGHLIGHT_SHARE * density + (1 - _HIGHLIGHT_SHARE * density.sum()) / count
    apart = _squared_angles(direction)
    chosen: list[int] = []
    nearest = np.full(count, np.inf)
    while len(chosen) < size:
        cost = np.minimum(nearest, apart) @ weight
        cost[chosen] = np.inf
        chosen.append(int(cost.argmin()))
        nearest = np.minimum(nearest, apart[chosen[-1]])
    improved = size < count
    while improved:
        improved = False
        for place in range(size):
            others = [light for light in chosen if light != chosen[place]]
            rest = apart[others].min(axis=0) if others else np.full(count, np.inf)
            cost = np.minimum(rest, apart) @ weight
            cost[others] = np.inf
            best = int(cost.argmin())
            if cost[best] < cost[chosen[place]] * (1 - 1e-9):
                chosen[place] = best
                improved = True
    return tuple(sorted(chosen))


def random_lights(count: int, size: int, draws: int, *, seed: int = 0) -> list[tuple[int, ...]]:
    """Return `draws` sets of `size` of `count` lights, each as likely as any other."""
    rng = np.random.default_rng((seed, size))
    return [tuple(sorted(rng.choice(count, size, replace=False).tolist())) for _ in range(draws)]


def _squared_angles(direction: Array) -> Array:
    """Return the squared angle between each two lights, shape (L, L)."""
    return np.asarray(np.arccos(np.clip(direction @ direction.T, -1.0, 1.0)) ** 2)
