"""Surfaces that a capture is planned for: assumed from a range of gloss and relief, or taken from a fit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem, raise_problems
from impasto.evaluate.glossmeter import GLOSSMETERS
from impasto.evaluate.regions import WHOLE, sample_regions
from impasto.geometry import Array, tilt_direction
from impasto.models import basis, parse_model
from impasto.pixels import Pixels, pixels_of_maps
from impasto.store import fitted_models, open_fit

USUAL_GLOSS = (10.0, 70.0)
USUAL_RELIEF_DEG = 10.0
# Of 16-bit linear photographs whose noise nobody has stated; see docs/store.md.
USUAL_NOISE = (1e-4, 0.0, 0.005)

_MODEL = "torrance-sparrow"
_COUNT = 400
_WIDTHS = np.geomspace(0.006, 0.6, 15)
# A Rayleigh distribution's 95th percentile in units of its parameter.
_RAYLEIGH_95 = 2.448


@dataclass(frozen=True)
class Surface:
    """Pixels to plan for.

    Parameters
    ----------
    pixels : Pixels
    description : str
        Where they come from, in words.
    """

    pixels: Pixels
    description: str


def assumed_surface(
    gloss: tuple[float, float] = USUAL_GLOSS, relief_deg: float = USUAL_RELIEF_DEG
) -> Surface:
    """Return pixels of a varnish-like interface over matte paints, in random combinations.

    Parameters
    ----------
    gloss : tuple of float
        Range of gloss units at 60°, as a glossmeter would read them.
    relief_deg : float
        Tilt that 95 % of the normals stay below, degrees.

    Returns
    -------
    Surface

    Raises
    ------
    OptionError
        If a number is out of range.
    """
    low, high = gloss
    least, most = float(_gloss_units()[-1]), float(_gloss_units()[0])
    problems = []
    if not least <= low <= high <= most:
        problems.append(
            Problem(
                where=f"--gloss {low:g},{high:g}",
                what=f"is no range of gloss units at 60°; expected from {least:.0f} to {most:.0f}, rising",
                do="Matte paint has 2 to 10, satin 10 to 70, a glossy varnish more",
            )
        )
    if not 0.0 <= relief_deg <= 60.0:
        problems.append(
            Problem(
                "--relief", f"is {relief_deg:g} degrees, expected 0 to 60", "Try 10 for visible brushwork"
            )
        )
    raise_problems(OptionError, problems)
    rng = np.random.default_rng(0)
    ends = np.interp([low, high], _gloss_units()[::-1], np.log(_WIDTHS)[::-1])
    c = np.exp(rng.uniform(ends[1], ends[0], _COUNT))
    sigma = np.radians(relief_deg) / _RAYLEIGH_95
    maps = {
        "normal": tilt_direction(*sigma * rng.standard_normal((2, _COUNT))),
        "diffuse": np.exp(rng.uniform(np.log(0.05), np.log(0.7), (_COUNT, 1))),
        "specular": 1 / (4 * c**2),
        "c": c,
    }
    attributes = {"model": _MODEL, "light_rgb": [1.0], "index_of_refraction": 1.5, "fresnel": "facet"}
    places = np.arange(_COUNT)
    pixels = pixels_of_maps(
        attributes,
        (1, _COUNT),
        np.zeros_like(places),
        places,
        {name: np.asarray(values, np.float32) for name, values in maps.items()},
    )
    return Surface(
        pixels,
        f"a surface of {low:g} to {high:g} gloss units at 60°, 95 % of its normals tilted by less than "
        f"{relief_deg:g}°",
    )


def fitted_surface(store: Path, model: str) -> Surface:
    """Return pixels of a fit.

    Raises
    ------
    StoreError
        If there is no such store, or no such fit in it.
    OptionError
        If no pixel of the fit has all its parameters.
    """
    fit = open_fit(store, parse_model(model).name)
    pixels = sample_regions(fit, None, _COUNT, show=False)[WHOLE].pixels
    if not len(pixels):
        raise OptionError(
            Problem(
                where=f"{store}: {fit.group}",
                what="no pixel has all its parameters",
                do="State --gloss and --relief instead, or look at the status map",
            )
        )
    return Surface(pixels, f"the {fit.attributes['model']} fit in {store}")


def has_fit(store: Path, model: str) -> bool:
    """Return whether a store has a complete fit of a model."""
    return parse_model(model).name in fitted_models(store)


@cache
def _gloss_units() -> Array:
    """Return what a 60° glossmeter reads of a smooth interface, for each of `_WIDTHS`."""
    model, meter = parse_model(_MODEL), GLOSSMETERS[1]

    def reading(c: float) -> float:
        def radiance(light: Array, view: Array) -> Array:
            count = len(light)
            up = np.tile([0.0, 0.0, 1.0], (count, 1))
            _, lobe = basis(model, up, light, view, np.full((count, 1), c))
            return np.asarray(lobe[:, 0] / (4 * c**2))

        return meter.measure(radiance, log2_rays=12)

    return np.array([reading(float(c)) for c in _WIDTHS])
