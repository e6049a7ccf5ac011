"""How strong each light was, and where it stood, as far as the photographs themselves tell it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.arm import find_arm
from impasto.fit.choice import WORTH_DB, choose
from impasto.fit.light_directions import MIN_LIGHTS, USUAL_ERROR_DEG, correct_directions
from impasto.fit.light_distances import find_distances
from impasto.fit.light_evidence import least_radiance, log_ratio
from impasto.fit.light_rotation import find_rotation, rotated
from impasto.fit.strength import find_strength
from impasto.fit.trend import find_trend
from impasto.geometry import Array, Lights, degrees_between

# Rounds of fitting the pixels and then the lights; the strengths change by less than 1 % in the last.
_ROUNDS = 3

Values = NDArray[np.float32]


class PixelFit(Protocol):
    """Some pixels that can be fitted and rendered under other lights than those stated."""

    def fit(self, lights: Lights) -> stores.Maps:
        """Return the maps of the pixels, fitted as if their photographs had been taken under `lights`."""

    def radiance(self, maps: stores.Maps, lights: Lights, *, highlights: bool = True) -> Values:
        """Return the radiance (L, N, C) that maps give under lights, with or without their highlights."""

    def measured(self) -> Values:
        """Return the radiance (L, N, C) of the photographs, NaN where it is missing."""

    def clipped(self) -> NDArray[np.bool_]:
        """Return which samples (L, N, C) are clipped."""

    def crosses(self) -> Values:
        """Return the radiance (L, M, 4) around other pixels, NaN where not known; see `find_rotation`."""

    @property
    def extent_mm(self) -> float:
        """Longer side of the picture in mm, or in pixels where nothing is known of its scale."""

    def left_out_db(self, lights: Lights) -> float:
        """Return to how many decibels lights left out one by one are met; see `remainder.left_out_db`."""


@dataclass(frozen=True)
class Calibration:
    """What the photographs tell of their lights.

    Parameters
    ----------
    lights : Lights
        As they are to be used: with the strengths' departures from their trend, and the directions found.
    gain : ndarray of shape (L, C)
        Strength found over strength stated, of median 1.
    trend : ndarray of shape (L, C)
        The part of it that is a quadratic function of direction, where there is one, and is left in the
        photographs: a painting that is brighter under all lights from one side cannot be told from lights
        that are stronger there.
    directions : dict
        Whether corrected directions are used, and why; empty where none were sought.
    distances : dict
        The same of distances.
    """

    lights: Lights
    gain: Array
    trend: Array
    directions: dict[str, Any] = field(default_factory=dict)
    distances: dict[str, Any] = field(default_factory=dict)

    @property
    def departure(self) -> Array:
        """Logarithms (L, C) of the strengths that the photographs are divided by."""
        return np.log(self.gain / self.trend)

    def attributes(self) -> dict[str, Any]:
        """Return what was found, for the attributes of a fit."""
        return {
            "gain": np.round(self.gain, 5).tolist(),
            "trend": np.round(self.trend, 5).tolist(),
            **({"directions": self.directions} if self.directions else {}),
            **({"distances": self.distances} if self.distances else {}),
        }


def found_lights(attributes: Mapping[str, Any], lights: Lights, extent_mm: float) -> Lights:
    """Return the lights of a fit as it found them, of what `Calibration.attributes` says.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    lights : Lights
        Of the fit, in order, as stated.
    extent_mm : float
        Longer side of the picture in mm, or in pixels where nothing is known of its scale.
    """
    found = attributes.get("self_calibration")
    if not found:
        return lights
    distances, directions = found.get("distances", {}), found.get("directions", {})
    if distances.get("used", "stated") != "stated":
        distance = np.broadcast_to(distances[distances["used"]], len(lights)) * extent_mm
        lights = replace(lights, position_mm=lights.direction * distance[:, None])
    if directions.get("used"):
        direction = np.array(directions["corrected"])
        distance = np.linalg.norm(lights.position_mm, axis=1)
        lights = replace(lights, direction=direction, position_mm=direction * distance[:, None])
    return replace(lights, intensity=lights.intensity * np.array(found["gain"]) / np.array(found["trend"]))


def self_calibrate(
    pixels: PixelFit, thinned: PixelFit, lights: Lights, *, directions: bool, distances: bool
) -> Calibration:
    """Estimate strength, distance and direction of each light from the photographs.

    Parameters
    ----------
    pixels, thinned : PixelFit
        A sample of the painting, and fewer pixels of it, which are enough for directions and distances.
    lights : Lights
        As stated.
    directions : bool
        Whether directions may be corrected. They are where lights left out one by one are then met closer by
        `WORTH_DB`, or more where lights turn far, and where the lights are enough to tell them.
    distances : bool
        Whether distant lights may be placed near, under the same conditions; a distance for each only where
        that meets lights left out closer by as much again than one for all.
    """
    enough = len(lights) >= MIN_LIGHTS and not find_arm(lights.direction).planar
    if distances and enough and not lights.near:
        stated = _place(pixels, thinned, lights)
    else:
        stated = find_strengths(pixels, lights)
    if not directions or not enough:
        return stated
    placed = replace(stated.lights, intensity=lights.intensity)
    corrected = find_strengths(pixels, correct_directions(thinned, placed))
    rotation = find_rotation(pixels.crosses(), corrected.lights, USUAL_ERROR_DEG)
    corrected = replace(corrected, lights=rotated(corrected.lights, rotation))
    ways = {"stated": stated, "corrected": corrected}
    turned = degrees_between(lights.direction, corrected.lights.direction)
    # The further lights turn, the less likely is it that they were stated so badly.
    worth_db = WORTH_DB * max(1.0, float(np.square(turned).mean()) / USUAL_ERROR_DEG**2)
    choice = choose(list(ways), lambda way: pixels.left_out_db(ways[way].lights), worth_db)
    found = {
        "used": choice.used == "corrected",
        "left_out_db": choice.left_out_db,
        "turned_deg": np.round(turned, 3).tolist(),
        "rotated_deg": round(float(np.degrees(rotation)), 3),
        "corrected": np.round(corrected.lights.direction, 6).tolist(),
    }
    return replace(ways[choice.used], directions=found, distances=stated.distances)


def _place(pixels: PixelFit, thinned: PixelFit, lights: Lights) -> Calibration:
    """Return the strengths of lights at the distances found, where lights left out bear these out."""
    used, best = "stated", find_strengths(pixels, lights)
    near = find_distances(thinned, lights)
    if not near:
        return replace(best, distances={"used": used})
    error = {used: pixels.left_out_db(best.lights)}
    distance = {}
    for name, placed in near.items():
        found = find_strengths(pixels, placed)
        error[name] = pixels.left_out_db(found.lights)
        distance[name] = np.linalg.norm(placed.position_mm, axis=1) / pixels.extent_mm
        if error[name] - error[used] > WORTH_DB:
            used, best = name, found
    distances: dict[str, Any] = {
        "used": used,
        "left_out_db": error,
        "common": round(float(distance["common"][0]), 4),
        "own": np.round(distance["own"], 4).tolist(),
    }
    if used != "stated":
        distances["told"] = _told(lights.direction, distance[used])
    return replace(best, distances=distances)


def _told(direction: Array, distance: Array) -> dict[str, Any]:
    """Describe the distances (L,) for lights between those that were photographed."""
    logarithm = np.log(distance)
    middle = float(np.median(logarithm))
    told = find_strength(direction, (logarithm - middle)[:, None]) if np.ptp(logarithm) else None
    return {
        "distance": float(f"{np.exp(middle):.7g}"),
        **(told or {}),
    }


def find_strengths(pixels: PixelFit, lights: Lights) -> Calibration:
    """Estimate the strength of each light together with the pixels, by alternating robust steps.

    Parameters
    ----------
    pixels : PixelFit
        A sample of the painting.
    lights : Lights
        As stated.

    Notes
    -----
    A strength is the weighted median, over the pixels, of measured over modelled radiance; see `log_ratio`.
    """
    measured, clipped = pixels.measured(), pixels.clipped()
    stated = np.broadcast_to(lights.intensity, (len(lights), measured.shape[2])).astype(np.float64)
    least = least_radiance(measured)
    used = replace(lights, intensity=stated)
    log_gain = trend = np.zeros(stated.shape)
    for _ in range(_ROUNDS + 1):
        maps = pixels.fit(used)
        radiance = pixels.radiance(maps, used)
        matte = pixels.radiance(maps, used, highlights=False)
        log_gain = log_gain - trend + _log_strength(measured, radiance, matte, clipped, least)
        log_gain -= np.median(log_gain)
        trend = find_trend(lights.direction, log_gain)
        used = replace(used, intensity=stated * np.exp(log_gain - trend))
    return Calibration(used, np.exp(log_gain), np.exp(trend))


def _log_strength(
    measured: Values, radiance: Values, matte: Values, clipped: NDArray[np.bool_], least: float
) -> Array:
    """Return for each light and channel the weighted median of ln(measured / radiance), shape (L, C)."""
    result = np.zeros((measured.shape[0], measured.shape[2]))

    def find(place: tuple[int, int]) -> None:
        light, channel = place
        one = (light, slice(None), channel)
        ratio, weight = log_ratio(measured[one], radiance[one], matte[one], clipped[one], least)
        usable = weight > 0.0
        if usable.sum() >= 16:
            result[place] = _weighted_median(ratio[usable], weight[usable])

    with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="strengths") as pool:
        list(pool.map(find, np.ndindex(result.shape)))
    return result


def _weighted_median(values: Values, weights: Values) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])
