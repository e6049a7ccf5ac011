"""How strong each light was and where it stood, as far as the photographs themselves tell it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.geometry import Array, Lights
from impasto.residual import encode

# Rounds of fitting the pixels and then the lights; the strengths change by less than 1 % in the last.
_ROUNDS = 3

# What a direction may be off by, as far as is known before: about what holding a light by hand does.
_DIRECTION_PRIOR_DEG = 3.0
_DIRECTION_LIMIT_DEG = 8.0

_PROBE = 0.01  # radians, of the differences that stand for slopes

Values = NDArray[np.float32]


class PixelFit(Protocol):
    """Some pixels that can be fitted and rendered under other lights than those stated."""

    def fit(self, lights: Lights) -> stores.Maps:
        """Return the maps of the pixels, fitted as if their photographs had been taken under `lights`."""

    def radiance(self, maps: stores.Maps, lights: Lights) -> Values:
        """Return the radiance (L, N, C) that maps give under lights."""

    def measured(self) -> Values:
        """Return the radiance (L, N, C) of the photographs, NaN where it is missing."""

    def clipped(self) -> NDArray[np.bool_]:
        """Return which samples (L, N, C) are clipped."""


@dataclass(frozen=True)
class Calibration:
    """What the photographs tell of their lights.

    Parameters
    ----------
    lights : Lights
        As they are to be used: with the strengths' departures from their trend, and the directions.
    gain : ndarray of shape (L, C)
        Strength found over strength stated, of median 1.
    trend : ndarray of shape (L, C)
        The part of it that changes smoothly with direction, and is left in the photographs: a painting that
        is brighter under all lights from one side cannot be told from lights that are stronger there.
    turn_deg : ndarray of shape (L,)
        Angle between direction used and direction stated.
    """

    lights: Lights
    gain: Array
    trend: Array
    turn_deg: Array

    def attributes(self) -> dict[str, Any]:
        """Return what was found, for the attributes of a fit."""
        return {
            "gain": np.round(self.gain, 5).tolist(),
            "trend": np.round(self.trend, 5).tolist(),
            "direction": np.round(self.lights.direction, 7).tolist(),
            "turn_deg": np.round(self.turn_deg, 3).tolist(),
        }


def self_calibrate(pixels: PixelFit, lights: Lights, toe: float, *, directions: bool = False) -> Calibration:
    """Estimate strength and direction of each light together with the pixels, by alternating robust steps.

    Parameters
    ----------
    pixels : PixelFit
        A sample of the painting.
    lights : Lights
        As stated.
    toe : float
        Of the encoding in which directions are fitted; see `impasto.residual.encode`.
    directions : bool, optional
        Whether directions are corrected too; lights at a stated position keep it.

    Notes
    -----
    A strength is the weighted median, over the pixels, of measured over modelled radiance; the weight is the
    smaller of both, which keeps highlights that the model misses and shadows that it does not know from
    counting. A direction is a robust least-squares step along the slopes of the radiance. The part of all
    steps that a linear map of the directions would make too is taken out: normals can follow it, as in the
    bas-relief ambiguity [Belhumeur1999]_.
    """
    measured, clipped = pixels.measured(), pixels.clipped()
    channels = measured.shape[2]
    stated = np.broadcast_to(lights.intensity, (len(lights), channels)).astype(np.float64)
    floor = 0.05 * float(np.nanmean(measured))
    used = replace(lights, intensity=stated)
    log_gain = np.zeros((len(lights), channels))
    for number in range(_ROUNDS + 1):
        radiance = pixels.radiance(maps := pixels.fit(used), used)
        log_gain += _log_strength(measured, radiance, clipped, floor)
        log_gain -= np.median(log_gain)
        trend = np.stack([_trend(lights.direction, column) for column in log_gain.T], axis=1)
        direction = used.direction
        if directions and not lights.near and 0 < number < _ROUNDS:
            used = replace(used, intensity=stated * np.exp(log_gain - trend))
            step = _direction_steps(pixels, maps, used, measured, clipped, toe)
            direction = _turned(lights.direction, direction, step)
        used = replace(used, intensity=stated * np.exp(log_gain - trend), direction=direction)
    cosine = np.clip((used.direction * lights.direction).sum(axis=1), -1.0, 1.0)
    return Calibration(used, np.exp(log_gain), np.exp(trend), np.degrees(np.arccos(cosine)))


def _log_strength(measured: Values, radiance: Values, clipped: NDArray[np.bool_], floor: float) -> Array:
    """Return for each light and channel the weighted median of ln(measured / radiance), shape (L, C)."""
    result = np.zeros((measured.shape[0], measured.shape[2]))
    usable = (measured > floor) & (radiance > floor) & ~clipped
    for place in np.ndindex(result.shape):
        light, channel = place
        here = usable[light, :, channel]
        if here.sum() < 16:
            continue
        one, other = measured[light, here, channel], radiance[light, here, channel]
        result[place] = _weighted_median(np.log(one / other), np.minimum(one, other))
    return result


def _weighted_median(values: Values, weights: Values) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, sums[-1] / 2)])


def _trend(direction: Array, log_gain: Array) -> Array:
    """Return the quadratic function of direction that robustly describes values (L,), at the lights."""
    x, y, z = direction.T
    terms = np.stack([np.ones_like(x), x, y, z, x * x, y * y, x * y], axis=1)
    if len(direction) < 3 * terms.shape[1]:
        return np.full_like(log_gain, np.median(log_gain))
    ridge = 0.1 * np.eye(terms.shape[1])
    ridge[0, 0] = 0.0
    weight = np.ones_like(log_gain)
    fitted = log_gain
    for _ in range(20):
        weighted = terms * weight[:, None]
        fitted = terms @ np.linalg.solve(terms.T @ weighted + ridge, weighted.T @ log_gain)
        rest = log_gain - fitted
        scale = 2.0 * 1.4826 * np.median(np.abs(rest)) + 1e-9
        weight = 1.0 / (1.0 + np.square(rest / scale))
    return fitted


def _tangents(direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each of (L, 3) directions."""
    other = np.where(np.abs(direction[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    first = np.cross(direction, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(direction, first)


def _direction_steps(
    pixels: PixelFit,
    maps: stores.Maps,
    lights: Lights,
    measured: Values,
    clipped: NDArray[np.bool_],
    toe: float,
) -> Array:
    """Return by how much each direction (L, 3) should move, as robust least squares tells it."""
    irradiance = lights.irradiance()
    tangents = _tangents(lights.direction)

    def rendered(direction: Array) -> Values:
        return encode(pixels.radiance(maps, replace(lights, direction=direction)) / irradiance, toe)

    here = rendered(lights.direction)
    slopes = [
        (rendered(lights.direction + _PROBE * along) - rendered(lights.direction - _PROBE * along))
        / (2 * _PROBE)
        for along in tangents
    ]
    # The third unknown is the strength, lest a direction make up for it.
    root = np.float32(np.sqrt(toe))
    slopes.append((np.square(here + root) - np.float32(toe)) / (2 * (here + root)))
    rest = encode(measured / irradiance, toe) - here
    usable = np.isfinite(measured) & ~clipped
    prior = np.diag([np.radians(_DIRECTION_PRIOR_DEG) ** -2] * 2 + [1.0])
    steps = np.zeros_like(lights.direction)
    for light in range(len(lights)):
        chosen = usable[light]
        target = rest[light][chosen].astype(np.float64)
        terms = np.stack([slope[light][chosen] for slope in slopes], axis=1).astype(np.float64)
        if len(target) < 64:
            continue
        step = np.zeros(3)
        for _ in range(5):
            left = target - terms @ step
            scale = 1.4826 * np.median(np.abs(left)) + 1e-6
            weight = 1.0 / (1.0 + np.square(left / (2.0 * scale)))
            weighted = terms * weight[:, None]
            normal = terms.T @ weighted + scale**2 * prior
            step = np.linalg.solve(normal, weighted.T @ target)
        steps[light] = step[0] * tangents[0][light] + step[1] * tangents[1][light]
    return steps


def _turned(stated: Array, direction: Array, step: Array) -> Array:
    """Return directions moved by steps, without what all share as a linear map, and within limits."""
    offset = direction + step - stated
    shared = np.linalg.solve(stated.T @ stated + 1e-3 * np.eye(3), stated.T @ offset)
    offset = offset - stated @ shared
    offset -= (offset * stated).sum(axis=1, keepdims=True) * stated
    length = np.linalg.norm(offset, axis=1, keepdims=True)
    offset *= np.minimum(1.0, np.radians(_DIRECTION_LIMIT_DEG) / np.maximum(length, 1e-12))
    turned = stated + offset
    turned[:, 2] = np.maximum(turned[:, 2], 0.02)
    result: Array = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return result
