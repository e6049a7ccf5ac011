"""Where each light stood, as far as the photographs themselves tell it.

A direction is told by the relief: a light further to the left brightens all slopes that face left. What is
common to all pixels is no evidence, because a light's strength and what the model does not know of the
material look alike there.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from impasto.fit.robust import cauchy_weight
from impasto.geometry import Array, Lights, zenith_azimuth
from impasto.residual import kernel

if TYPE_CHECKING:
    from impasto.fit.self_calibration import PixelFit, Values

# Five left the directions' errors on a simulated painting as three did.
_ROUNDS = 3
_REWEIGHTINGS = 2
_BLOCK = 256
# Unknowns of a pixel's own.
_OWN = 5
_STEP = np.radians(0.5)

USUAL_ERROR_DEG = 2.0
"""By how much directions are usually misstated: the root mean square, over both angles."""

# Standard deviations of what is to be found: of each of a light's two angles, 2° in all, in radians; of the
# strengths' logarithm, which are found only to be set aside, so wide that the photographs alone tell them.
_DIRECTION_SD = np.radians(1.41)
_STRENGTH_SD = 0.5

# Of what all pixels share and the model does not know, per function: depending on the zenith angle alone, as
# the fall-off of an unknown material does on a flat painting, or, of strengths, on the whole direction. A
# material that is the same from all sides seems to turn lights up or down, never around.
_ZENITH_LENGTH = np.radians(15.0)
_SHARED_LENGTH = 0.7
_STRENGTH_SHARED_SD = (0.3, 0.1)
_DIRECTION_SHARED_SD = 0.05

# Of what a single pixel leaves over, in the logarithm: a smooth function of direction, and noise. A factor on
# all of it is each pixel's own, because a model meets one paint closer than another; no pixel is trusted
# beyond the least.
_PIXEL_SD, _PIXEL_LENGTH = 0.4, 1.0
_NOISE_SD = 0.05
_LEAST_FACTOR = 0.01
# A highlight is known to its own strength only: what is wrong about it must not turn lights.
_HIGHLIGHT_SD = 1.0
# Samples further off than this factor are in a cast shadow, or not of the painting.
_FURTHEST = 0.5

MIN_LIGHTS = 24
"""Fewer lights leave too little once each function that all pixels share is set aside."""


@dataclass(frozen=True)
class _Linearised:
    """The logarithm of pixels' radiance around the current lights.

    Parameters
    ----------
    rest : ndarray of shape (L, N)
        Measured over modelled, in the logarithm; 0 where not usable.
    slope : ndarray of shape (3, L, N)
        Its change with a light's log strength and with the two angles of `_axes`.
    own : ndarray of shape (L, 5, N)
        Its change with the pixel's own normal, albedo, highlight and ambient term.
    variance : ndarray of shape (L, N)
        Of the noise; very large where not usable.
    """

    rest: Array
    slope: Array
    own: Array
    variance: Array


def correct_directions(pixels: PixelFit, lights: Lights) -> Lights:
    """Return the lights with directions estimated together with strengths and pixels.

    Parameters
    ----------
    pixels : PixelFit
        A sample of the painting.
    lights : Lights
        As stated, at least `MIN_LIGHTS` that do not lie in one plane; their strengths are kept.

    Notes
    -----
    Gauss-Newton steps for strengths and directions of all lights, the pixels' own unknowns eliminated as in
    bundle adjustment [Triggs2000]_. A pixel's residuals over the lights are no white noise: what a model gets
    wrong is smooth over direction, so they have the covariance of a Gaussian process, and only what departs
    from neighbouring lights is evidence. How large that process is at each pixel is estimated with the
    corrections. A pixel's normal moves its highlight too, and is eliminated with it: a highlight fitted under
    wrong lights would bear them out. Of the corrections found, the part is taken that the prior expects
    of independent errors rather than of a function that all lights share. So are the ambiguities settled that
    relief and lights have in common, such as a flatter relief under lights that stand lower
    [Belhumeur1999]_.
    """
    prior, shared = _priors(lights.direction)
    correction = np.zeros((3, len(lights)))
    for _ in range(_ROUNDS):
        current = _turned(lights, correction[1:])
        current = replace(current, intensity=lights.intensity * np.exp(correction[0])[:, None])
        found = _solve(_linearise(pixels, current, _axes(lights)), current, correction, prior)
        independent = prior - shared
        correction = np.reshape(independent @ np.linalg.solve(prior, found.ravel()), found.shape)
        correction[0] -= np.median(correction[0])
    # The last digits depend on how many threads solved the equations.
    return _turned(lights, np.round(correction[1:], 9))


def _axes(lights: Lights) -> Array:
    """Return for each light the unit vectors of rising zenith and azimuth angle, shape (2, L, 3)."""
    zenith, azimuth = zenith_azimuth(lights.direction)
    down = [np.cos(zenith) * np.cos(azimuth), np.cos(zenith) * np.sin(azimuth), -np.sin(zenith)]
    around = [-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)]
    return np.stack([np.stack(down, axis=1), np.stack(around, axis=1)])


def _turned(lights: Lights, angle: Array, axes: Array | None = None) -> Lights:
    """Return lights turned by small angles (2, L) along axes, by default their own."""
    along = _axes(lights) if axes is None else axes
    direction = lights.direction + np.einsum("kl,klx->lx", angle, along)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    distance = np.linalg.norm(lights.position_mm, axis=1, keepdims=True)
    return replace(lights, direction=direction, position_mm=direction * distance)


def _priors(direction: Array) -> tuple[Array, Array]:
    """Return the covariance (3L, 3L) of all corrections, and the part of it that lights share."""
    count = len(direction)
    zenith, _ = zenith_azimuth(direction)
    along_zenith = np.exp(-np.square((zenith[:, None] - zenith) / _ZENITH_LENGTH) / 2)
    anywhere = kernel(direction, direction, _SHARED_LENGTH)
    zonal, whole = np.square(_STRENGTH_SHARED_SD)
    shared, prior = np.zeros((2, 3, count, 3, count))
    # The overall strength means nothing.
    shared[0, :, 0] = zonal * along_zenith + whole * anywhere + 1.0
    shared[1, :, 1] = _DIRECTION_SHARED_SD**2 * along_zenith
    for place, sd in enumerate((_STRENGTH_SD, _DIRECTION_SD, _DIRECTION_SD)):
        prior[place, :, place] = shared[place, :, place] + sd**2 * np.eye(count)
    return prior.reshape(3 * count, -1), shared.reshape(3 * count, -1)


def _linearise(pixels: PixelFit, lights: Lights, axes: Array) -> _Linearised:
    measured = pixels.measured().mean(axis=2, dtype=np.float64)
    maps = pixels.fit(lights)

    def render(under: Lights = lights, normal: Values = maps["normal"], *, highlights: bool = True) -> Array:
        rendered = pixels.radiance(maps | {"normal": normal}, under, highlights=highlights)
        mean: Array = rendered.mean(axis=2, dtype=np.float64)
        return mean

    radiance, matte = render(), render(highlights=False)
    floor = 0.05 * float(np.nanmean(measured))
    usable = (measured > floor) & (radiance > floor) & ~pixels.clipped().any(axis=2)
    slope = np.ones((3, *radiance.shape))
    tilt = np.zeros((2, *radiance.shape))
    for axis in range(2):
        angle = np.zeros((2, len(lights)))
        angle[axis] = _STEP
        sides = [render(_turned(lights, sign * angle, axes)) for sign in (1.0, -1.0)]
        # Where a side is dark the pixel turns away from the light, and a logarithm has no slope.
        usable &= (sides[0] > floor / 10) & (sides[1] > floor / 10)
        high, low = np.where(usable, sides, 1.0)
        slope[1 + axis] = np.log(high / low) / (2 * _STEP)
        high, low = (render(normal=_tilted(maps["normal"], axis, sign * _STEP)) for sign in (1.0, -1.0))
        tilt[axis] = (high - low) / (2 * _STEP)
    usable &= (measured < radiance * np.exp(_FURTHEST)) & (measured > radiance * np.exp(-_FURTHEST))
    chosen = usable.mean(axis=0) > 0.6
    usable, slope, tilt = usable[:, chosen], slope[:, :, chosen], tilt[:, :, chosen]
    measured, radiance, matte = (
        np.where(usable, values[:, chosen], 1.0) for values in (measured, radiance, matte)
    )
    highlight = 1.0 - matte / radiance
    variance = _NOISE_SD**2 + np.square(_HIGHLIGHT_SD * highlight) + np.square(0.1 * floor / measured)
    even = np.broadcast_to(radiance.mean(axis=0), radiance.shape)
    own = np.stack([*tilt, matte, radiance - matte, even], axis=1)
    return _Linearised(
        rest=np.log(measured / radiance),
        slope=np.where(usable, slope, 0.0),
        own=np.where(usable[:, None], own / radiance[:, None], 0.0),
        variance=np.where(usable, variance, 1e4),
    )


def _tilted(normal: Values, axis: int, angle: float) -> Values:
    """Return unit vectors (N, 3) tilted by a small angle towards x or y."""
    tilted = normal.copy()
    tilted[:, axis] += angle
    result: Values = tilted / np.linalg.norm(tilted, axis=1, keepdims=True)
    return result


def _solve(around: _Linearised, lights: Lights, correction: Array, prior: Array) -> Array:
    """Return the corrections (3, L), counted from the lights as stated, that the pixels tell."""
    count, pixels = around.rest.shape
    smooth = _PIXEL_SD**2 * kernel(lights.direction, lights.direction, _PIXEL_LENGTH)
    target = around.rest + np.einsum("kl,klp->lp", correction, around.slope)
    weight, factor = np.ones_like(target), np.ones(pixels)
    found = correction
    prior_precision = np.linalg.inv(prior)
    blocks = [slice(first, first + _BLOCK) for first in range(0, pixels, _BLOCK)]
    with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="directions") as pool:
        for _ in range(_REWEIGHTINGS):
            eliminated = pool.map(partial(_eliminate, around, smooth, target, weight, factor), blocks)
            # Summed in the order of the blocks: the result does not depend on the threads.
            normal, right, precisions = zip(*eliminated, strict=True)
            matrix = sum(normal).reshape(3 * count, -1) + prior_precision
            found = np.linalg.solve(matrix, sum(right).ravel()).reshape(3, count)
            error = target - np.einsum("kl,klp->lp", found, around.slope)
            weight, factor = _weights(error, precisions, factor)
    return found


def _eliminate(
    around: _Linearised, smooth: Array, target: Array, weight: Array, factor: Array, part: slice
) -> tuple[Array, Array, Array]:
    """Return what pixels tell of the corrections once their own unknowns are eliminated.

    Returns
    -------
    normal : ndarray of shape (3, L, 3, L)
        Matrix of the normal equations.
    right : ndarray of shape (3, L)
        Their right side.
    precision : ndarray of shape (P, L, L)
        Inverse covariance of each pixel's residuals.
    """
    count = len(target)
    own, slope = around.own[:, :, part].transpose(2, 0, 1), around.slope[:, :, part].transpose(2, 0, 1)
    covariance = own @ own.transpose(0, 2, 1) + smooth
    diagonal = np.arange(count)
    covariance[:, diagonal, diagonal] += (around.variance[:, part] / weight[:, part]).T
    precision = np.asarray(np.linalg.inv(covariance), np.float64) / factor[part, None, None]
    projected = (precision[:, :, None, :] * slope[:, None, :, :]).reshape(len(precision), count, -1)
    # Light by light, over the pixels.
    normal = slope.transpose(2, 1, 0) @ projected.transpose(1, 0, 2)
    whitened = (precision @ target[:, part].T[:, :, None])[:, None, :, 0]
    right: Array = (slope * whitened).sum(axis=0)
    return normal.transpose(1, 0, 2).reshape(3, count, 3, count), right, precision


def _weights(error: Array, precisions: Sequence[Array], factor: Array) -> tuple[Array, Array]:
    """Return the weights of samples and the factors of pixels by what is left over of them.

    Parameters
    ----------
    error : ndarray of shape (L, N)
        What is left over.
    precisions : sequence of ndarray of shape (P, L, L)
        By blocks, the inverse covariance that was assumed of it.
    factor : ndarray of shape (N,)
        On each pixel's covariance, so far.

    Returns
    -------
    weight : ndarray of shape (L, N)
        Cauchy's, by how far each sample is from what the pixel's others let expect.
    factor : ndarray of shape (N,)
        That makes the mean square of what is left over, in standard deviations, one.
    """
    departures, squares = [], []
    for number, precision in enumerate(precisions):
        part = error[:, number * _BLOCK : (number + 1) * _BLOCK].T
        whitened = (precision @ part[:, :, None])[:, :, 0]
        departures.append(whitened / np.sqrt(np.diagonal(precision, axis1=1, axis2=2)))
        squares.append((whitened * part).sum(axis=1))
    weight = cauchy_weight(np.concatenate(departures).T, 2.0)
    free = len(error) - _OWN
    return weight, np.maximum(factor * np.concatenate(squares) / free, _LEAST_FACTOR)
