"""How far from the painting each light stood, as far as the photographs themselves tell it.

A lamp that is near is brighter, and shines from another direction, on the side of the painting towards which
it stands. Per pixel, that looks much like a slope: taken for distant, near lamps make a flat painting a bowl.
What tells them apart is that the slope would grow as tan θ of a light's zenith angle θ, and the lamp's
nearness as sin θ; and the highlights.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from impasto.fit.light_evidence import least_radiance, log_ratio
from impasto.fit.robust import robust_fit
from impasto.geometry import Array, Lights

if TYPE_CHECKING:
    from impasto.fit.self_calibration import PixelFit
    from impasto.store import Maps

# Of the picture's longer side over the distance: the search goes from one to the next as long as that helps.
_NEARNESS = (0.0, 0.1, 0.2, 0.4, 0.8, 1.6)

# Rounds of moving each light by itself and then all by one factor, and how large that may be.
_ROUNDS = 3
_FACTOR = 1.2
_STEP = 0.05

# Standard deviation, in the logarithm, of single distances from the one that describes all best; and how many
# pixels tell as much as one would of which the model knows everything.
_SPREAD = 0.3
_ALIKE = 30.0


@dataclass(frozen=True)
class _Compared:
    """Photographs beside the model that was fitted under given lights, in the mean over the channels.

    Parameters
    ----------
    maps : dict
    log_ratio : ndarray of shape (L, N)
        ln(measured / modelled); 0 where not usable.
    weight : ndarray of shape (L, N)
        How much a sample tells of its light; 0 where not usable.
    """

    maps: Maps
    log_ratio: Array
    weight: Array


def find_distances(pixels: PixelFit, lights: Lights) -> dict[str, Lights]:
    """Return lights at distances under which a model describes the photographs better than distant lights.

    Parameters
    ----------
    pixels : PixelFit
        A sample of the painting.
    lights : Lights
        As stated, far away.

    Returns
    -------
    dict of str to Lights
        With positions: ``common``, all at one distance, and ``own``, each at its own. Empty where the lights
        are so far away that the photographs do not tell it.

    Notes
    -----
    Under lights at each distance that is tried the pixels are fitted anew; what is left of a photograph once
    its strength is set aside is judged by its median size. Around the best common distance each light is
    moved by a robust step in the logarithm of its distance, then all by one factor, in turns.
    """

    def misfit(position: Array) -> float:
        return _misfit(_compare(pixels, replace(lights, position_mm=position)))

    def at(nearness: float) -> Array:
        return lights.direction * (pixels.extent_mm / nearness)

    best, least = 0, _misfit(_compare(pixels, lights))
    for number, nearness in enumerate(_NEARNESS[1:-1], start=1):
        here = misfit(at(nearness))
        if here >= least:
            break
        best, least = number, here
    if best == 0:
        return {}
    common = at(_least(lambda nearness: misfit(at(nearness)), _NEARNESS[best - 1], _NEARNESS[best + 1]))
    own = common
    for _ in range(_ROUNDS):
        steps = _single_steps(pixels, replace(lights, position_mm=own), common)
        own = _scaled(own * np.exp(steps)[:, None], misfit)
    return {"common": replace(lights, position_mm=common), "own": replace(lights, position_mm=own)}


def _scaled(position: Array, misfit: Callable[[Array], float]) -> Array:
    """Return positions times the factor that describes the photographs best."""
    return position * _least(lambda factor: misfit(position * factor), 1.0 / _FACTOR, _FACTOR)


def _compare(pixels: PixelFit, lights: Lights) -> _Compared:
    measured = pixels.measured().mean(axis=2, dtype=np.float64)
    maps = pixels.fit(lights)
    radiance, matte = (
        pixels.radiance(maps, lights, highlights=highlights).mean(axis=2, dtype=np.float64)
        for highlights in (True, False)
    )
    clipped = np.asarray(pixels.clipped().any(axis=2))
    return _Compared(maps, *log_ratio(measured, radiance, matte, clipped, least_radiance(measured)))


def _misfit(compared: _Compared) -> float:
    """Return the mean over the lights of the logarithm of what is left, their strengths aside."""
    sizes = []
    for ratio, weight in zip(compared.log_ratio, compared.weight, strict=True):
        usable = ratio[weight > 0.0]
        if len(usable):
            sizes.append(float(np.log(np.median(np.abs(usable - np.median(usable))) + 1e-9)))
    return float(np.mean(sizes)) if sizes else 0.0


def _least(misfit: Callable[[float], float], low: float, high: float) -> float:
    """Return where between two ends a function of one minimum is least, to 1 %, by golden sections."""
    share = (math.sqrt(5.0) - 1.0) / 2.0
    places = [high - share * (high - low), low + share * (high - low)]
    values = [misfit(place) for place in places]
    while high - low > 0.02 * high:
        if values[0] < values[1]:
            high = places[1]
            places = [high - share * (high - low), places[0]]
            values = [misfit(places[0]), values[0]]
        else:
            low = places[0]
            places = [places[1], low + share * (high - low)]
            values = [values[1], misfit(places[1])]
    return places[0] if values[0] < values[1] else places[1]


def _single_steps(pixels: PixelFit, lights: Lights, common: Array) -> Array:
    """Return by how much (L,) to change the logarithms of the lights' distances."""
    compared = _compare(pixels, lights)
    sides = [
        pixels.radiance(
            compared.maps, replace(lights, position_mm=lights.position_mm * np.exp(sign * _STEP))
        ).mean(axis=2, dtype=np.float64)
        for sign in (1.0, -1.0)
    ]
    usable = (compared.weight > 0.0) & (sides[0] > 0.0) & (sides[1] > 0.0)
    further, nearer = np.where(usable, sides, 1.0)
    slope = np.log(further / nearer) / (2.0 * _STEP)
    weight = np.where(usable, compared.weight, 0.0)
    departure = np.log(np.linalg.norm(lights.position_mm, axis=1) / np.linalg.norm(common, axis=1))
    steps = np.zeros(len(lights))
    for light, chosen in enumerate(usable):
        if chosen.sum() >= 16:
            steps[light] = _robust_step(
                compared.log_ratio[light, chosen],
                slope[light, chosen],
                weight[light, chosen],
                departure[light],
            )
    return steps


def _robust_step(ratio: Array, slope: Array, weight: Array, departure: float) -> float:
    """Return the change of a light's log distance that best explains ln(measured / modelled) of its pixels.

    Its strength is free; the prior draws the distance towards the common one, from which it departs so far.
    """
    terms = np.stack([np.ones_like(slope), slope], axis=1)
    precision, mean = np.array([0.0, _ALIKE / _SPREAD**2]), np.array([0.0, -departure])
    return float(robust_fit(terms, ratio, weight / weight.mean(), precision, mean)[1])
