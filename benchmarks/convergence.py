"""How often the joint fit finds the least of what it minimises, from its default start.

`python -m benchmarks.convergence FOLDER` draws materials of FOLDER's measured_brdf.npz, tilts of the surface
and views, and fits each in RGB by Torrance-Sparrow, with one shape for the channels and a highlight in the
light's colour. What is found is held against a search that knows nothing of the fit's start: for a normal
that is known, every c of a fine grid, with magnitudes by exhaustion; for a normal that is fitted too, the
normal held at each point of a grid around the true one, coarse and then fine, with every starting shape
tried at each.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from benchmarks.measured_materials import ANGLES_DEG
from numpy.typing import NDArray

Array = NDArray[np.float64]

MODEL = "torrance-sparrow"
SHARE = 0.995
"""Of the fits that must converge."""
TOLERANCE = 0.01
"""By which the error may exceed the least one."""
HIGHEST_TILT_DEG = 20.0
HIGHEST_VIEW_DEG = 30.0
HIGHEST_LIGHT_DEG = 75.0
NOISE = (1e-3, 0.0, 0.0)
"""The same for every sample, a thousandth of the brightest."""
_GRAZING = np.cos(np.radians(80.0))
_VIEWS = 100
# Median and logarithmic deviation of the prior on c, as in core/src/models/microfacet.rs.
_PRIOR_C = (0.15, 1.2)
# Normal (2), c, As and Ad of three channels.
_UNKNOWNS = 7
_C = np.geomspace(0.004, 30.0, 120)
# Steps of the search's grids in degrees, each grid around the best point of the one before.
_GRIDS_DEG = (np.linspace(-12.0, 12.0, 9), np.linspace(-2.0, 2.0, 5), np.linspace(-0.5, 0.5, 5))


@dataclass(frozen=True)
class Scenes:
    """Samples seen from one direction.

    Parameters
    ----------
    light_direction : ndarray of shape (L, 3)
    view_direction : ndarray of shape (3,)
    normal : ndarray of shape (P, 3)
    radiance : ndarray of shape (L, P, 3), float32
        Brightest sample 1 per pixel; NaN within 10° of grazing, where the materials are not known.
    """

    light_direction: Array
    view_direction: Array
    normal: Array
    radiance: NDArray[np.float32]


def arm() -> Array:
    """Return the directions of the study's lights."""
    from impasto.geometry import arm_direction

    return arm_direction(np.radians(ANGLES_DEG))


def dome() -> Array:
    """Return as many directions spread over a dome."""
    from impasto.geometry import dome_direction

    step = np.arange(len(ANGLES_DEG)) + 0.5
    zenith = np.radians(HIGHEST_LIGHT_DEG) * np.sqrt(step / len(step))
    return dome_direction(zenith, step * np.pi * (3 - np.sqrt(5)))


def draw(folder: Path, light: Array, count: int, seed: int = 1) -> list[Scenes]:
    """Return scenes with `count` samples in all: random materials, tilts and views."""
    from impasto.capture.simulate.measured import read_measured
    from impasto.geometry import dome_direction

    measured = read_measured(folder / "measured_brdf.npz")
    names = list(measured.weights)
    rng = np.random.default_rng(seed)
    scenes = []
    for share in np.array_split(np.arange(count), min(_VIEWS, count)):
        zenith = np.radians(HIGHEST_VIEW_DEG) * np.sqrt(rng.uniform())
        view = dome_direction(zenith, rng.uniform(0, 2 * np.pi))
        tilt = np.radians(HIGHEST_TILT_DEG) * np.sqrt(rng.uniform(size=len(share)))
        normal = dome_direction(tilt, rng.uniform(0, 2 * np.pi, len(share)))
        radiance = np.empty((len(light), len(share), 3))
        for pixel, direction in enumerate(normal):
            facing = light @ direction
            seen = measured.brdf(
                names[rng.integers(len(names))], np.broadcast_to(direction, light.shape), light, view
            )
            radiance[:, pixel] = np.where((facing > _GRAZING)[:, None], seen * facing[:, None], np.nan)
        radiance /= np.nanmax(radiance, axis=(0, 2), keepdims=True)
        scenes.append(Scenes(light, view, normal, radiance.astype(np.float32)))
    return scenes


def fit(scenes: Scenes, normal: Array | None = None) -> dict[str, NDArray[np.float32]]:
    """Fit the model from the default start, with the normals free or held."""
    from impasto.fit.tile import fit_tile
    from impasto.geometry import Camera, Lights
    from impasto.models import parse_model

    light = scenes.light_direction
    return fit_tile(
        parse_model(MODEL),
        scenes.radiance,
        lights=Lights(tuple(str(number) for number in range(len(light))), light),
        camera=Camera(scenes.view_direction),
        light_rgb=np.ones(3),
        clip_level=np.full(3, np.inf),
        noise=NOISE,
        normal=normal,
    )


def least_error_of_shapes(scenes: Scenes) -> Array:
    """Return the least RMS residual at the true normal over a fine grid of c, shape (P,)."""
    return np.array([_least_error(scenes, pixel) for pixel in range(len(scenes.normal))])


def _least_error(scenes: Scenes, pixel: int) -> float:
    from impasto.models import basis, parse_model

    seen = np.isfinite(scenes.radiance[:, pixel, 0])
    light = scenes.light_direction[seen]
    radiance = scenes.radiance[seen, pixel].astype(np.float64)
    count = len(_C) * len(light)
    diffuse, lobe = basis(
        parse_model(MODEL),
        np.broadcast_to(scenes.normal[pixel], (count, 3)),
        np.tile(light, (len(_C), 1)),
        np.broadcast_to(scenes.view_direction, (count, 3)),
        np.repeat(_C, len(light))[:, None],
    )
    diffuse, lobe = diffuse[: len(light)], lobe.reshape(len(_C), len(light))
    best = np.inf
    # Every choice of channels whose diffuse magnitude is 0; the lobe is projected off those of the others.
    for free in product((False, True), repeat=3):
        shares = np.array(free)
        along = np.where(shares, radiance.T @ diffuse, 0.0) / (diffuse @ diffuse)
        of_lobe = (lobe @ diffuse) / (diffuse @ diffuse)
        left = radiance - diffuse[:, None] * along
        square = 3 * (lobe**2).sum(1) - shares.sum() * of_lobe**2 * (diffuse @ diffuse)
        specular = np.maximum((lobe @ left).sum(1) / np.maximum(square, 1e-300), 0.0)
        magnitude = along - np.outer(specular * of_lobe, shares)
        residual = (
            radiance - diffuse[:, None] * magnitude[:, None, :] - (specular[:, None] * lobe)[:, :, None]
        )
        squares = (residual**2).sum(axis=(1, 2))
        best = min(best, squares[(magnitude >= 0).all(1)].min(initial=np.inf))
    return float(np.sqrt(best / radiance.size))


def costs(scenes: Scenes, found: dict[str, NDArray[np.float32]], known: bool) -> Array:
    """Return what a fit minimises, as an RMS residual, shape (P,).

    With the normal known that is the residual. With it fitted, two weak priors count for as much as 1 of some
    180 samples each: on ln c, and on As c². Both are 0 where there is no lobe.
    """
    residual = found["residual_rms"].astype(np.float64)
    if known:
        return residual
    deviation = np.log(found["c"] / _PRIOR_C[0]) / _PRIOR_C[1]
    prior = np.where(found["specular"] > 0, deviation**2, 0.0) + (found["specular"] * found["c"] ** 2) ** 2
    samples = np.isfinite(scenes.radiance).sum(axis=(0, 2))
    return np.asarray(residual * np.sqrt(1 + prior / (samples - _UNKNOWNS)))


def least_cost_of_normals(scenes: Scenes) -> Array:
    """Return the least cost over grids of normals, shape (P,)."""
    best = np.full(len(scenes.normal), np.inf)
    centre = scenes.normal
    for grid in _GRIDS_DEG:
        nearest = centre
        for x, y in product(grid, grid):
            moved = centre + np.radians([x, y, 0.0])
            moved /= np.linalg.norm(moved, axis=1, keepdims=True)
            cost = costs(scenes, fit(scenes, moved), known=False)
            better = cost < best
            best = np.where(better, cost, best)
            nearest = np.where(better[:, None], moved, nearest)
        centre = nearest
    return best


def converged(scenes: Scenes, known: bool) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which fits ended by themselves, and which of these within `TOLERANCE` of the least cost."""
    found = fit(scenes, scenes.normal if known else None)
    least = least_error_of_shapes(scenes) if known else least_cost_of_normals(scenes)
    ended = np.isin(found["status"], (0, 2))
    return ended, ended & (costs(scenes, found, known) <= (1 + TOLERANCE) * least)


SETTINGS = {
    "arm, normal known": (arm, True),
    "dome, normal known": (dome, True),
    "dome, normal fitted": (dome, False),
    "arm, normal fitted": (arm, False),
}


def measure(folder: Path, setting: str, count: int) -> tuple[float, float]:
    """Return the shares of fits that ended by themselves, and that found the least error."""
    lights, known = SETTINGS[setting]
    found = [converged(scenes, known) for scenes in draw(folder, lights(), count)]
    ended, least = (np.concatenate(each) for each in zip(*found, strict=True))
    return float(ended.mean()), float(least.mean())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with measured_brdf.npz")
    parser.add_argument("--count", type=int, default=10_000)
    arguments = parser.parse_args()
    print(f"of {arguments.count} fits: ended by themselves, within {TOLERANCE:.0%} of the least cost")
    for setting in SETTINGS:
        ended, least = measure(arguments.folder, setting, arguments.count)
        print(f"{setting}: {ended:.2%}, {least:.2%}", flush=True)
