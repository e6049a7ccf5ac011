"""Estimate the colour of the light from the highlights of a stack."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.stack.highlights import Array, Highlights, separate
from impasto.stack.samples import Samples
from impasto.store import ASSUMED_WHITE, StackHeader

# Pixels whose diffuse colours differ by less than this (natural logarithm) count as one paint.
_PAINT_WIDTH = 0.15
_PAINT_PIXELS = 8

# Pixels whose highlights are separated at a time, on each processor.
_BLOCK = 2048

# How a paint's highlights may be off, in natural logarithms: any way, by this; towards the paint's own
# colour, by this share of the way, because its diffuse reflection is not quite Lambert's; and by this where
# that colour is within `_TELLING` of the light's, because a metal looks so too.
_ANY_WAY = 0.02
_TOWARDS_PAINT = 0.25
_METAL = 0.5
_TELLING = 0.15
# Paints further off than this many standard deviations have no say.
_CUT = 3.0
# Two meeting points whose shares of the votes differ by less than this are as good as each other.
_AS_GOOD = 0.06

_STEPS = 40
_STEP_END = 1e-5

# What an estimate needs: this much of the paints behind it, and a standard deviation below this.
_LEAST_SUPPORT = 0.4
_LARGEST_SD = 0.025
# An estimate that is not further than this many standard deviations from neutral is neutral.
_SIGNIFICANT = 4.0

# Orthonormal coordinates of the logarithms of a colour, whatever its brightness.
_PLANE = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])


@dataclass(frozen=True)
class LightColour:
    """The colour of the light in the stack's own space.

    Parameters
    ----------
    rgb : tuple of float
        One per channel; their mean is 1.
    source : str
        ``estimated from N highlights`` or ``assumed white``.
    note : str
        The same in a sentence, with the reason; "" where there is nothing to say.
    """

    rgb: tuple[float, ...]
    source: str
    note: str


def light_colour(samples: Samples, header: StackHeader) -> LightColour:
    """Estimate the colour of the light from the highlights of a stack.

    Parameters
    ----------
    samples : Samples
        What was taken of the photographs, all of it.
    header : StackHeader

    Returns
    -------
    LightColour
        White where there is too little evidence, or where it does not contradict white. The same stack gives
        the same colour.

    Notes
    -----
    By the dichromatic model [Shafer1985]_, what the highlights of a paint add to its diffuse colour has the
    colour of the light. An error of the diffuse part moves it along the line between the two in the plane of
    chromaticities, and so does a metal, which colours its highlights; the lines of several paints meet in the
    light's colour [Lee1986]_. Each paint has one vote in proportion to the square root of its pixels, the
    votes are combined by Tukey's biweight, and what one paint alone says does not suffice.
    """
    channels = header.shape[3]
    if channels != 3:
        return LightColour((1.0,) * channels, ASSUMED_WHITE, "")
    return from_highlights(_highlights(samples, header))


def from_highlights(highlights: Highlights) -> LightColour:
    """Estimate the colour of the light from separated highlights of three channels; see `light_colour`."""
    found, body, votes = _paints(highlights)
    if len(votes) < 3:
        return _white(f"only {len(highlights.excess)} sampled pixels, of too few paints, have a highlight")
    colour, covariance, support, near = _meeting_point(found, body, votes)
    deviation = math.sqrt(np.linalg.eigvalsh(covariance)[-1])
    if support < _LEAST_SUPPORT:
        return _white("the highlights of the sampled pixels do not agree on one")
    if deviation > _LARGEST_SD:
        return _white(f"the paints with highlights are too few or too alike to tell it ({deviation:.0%})")
    count = int(votes[near].sum())
    source = f"estimated from {count} highlights"
    if colour @ np.linalg.solve(covariance, colour) < _SIGNIFICANT**2:
        return LightColour(
            (1.0, 1.0, 1.0), source, f"the light is neutral in the photographs, as {count} highlights tell"
        )
    rgb = np.exp(colour @ _PLANE)
    # Rounded so that no other order of additions, as on another processor, shows.
    red, green, blue = (round(float(value), 4) for value in rgb / rgb.mean())
    return LightColour(
        (red, green, blue),
        source,
        f"the light's colour in the photographs, and so that of the specular term, is "
        f"{red:.3f}, {green:.3f}, {blue:.3f} (R, G, B, within about {deviation:.1%}), {source}",
    )


def _white(reason: str) -> LightColour:
    note = f"the light is taken to be neutral in the photographs: {reason}"
    return LightColour((1.0, 1.0, 1.0), ASSUMED_WHITE, note)


def _highlights(samples: Samples, header: StackHeader) -> Highlights:
    """Separate the highlights of pixels all over the painting."""
    radiance = samples.values * header.scale + header.offset
    clip_level = [math.inf if level is None else level for level in header.clip_level]
    usable = np.isfinite(radiance) & (radiance < clip_level)
    radiance /= np.broadcast_to(header.lights.intensity, radiance.shape[1:])
    lights = _light_vectors(samples, header)

    def separated(part: slice) -> Highlights:
        here = lights if len(lights) == 1 else lights[part]
        return separate(radiance[part], np.all(usable[part], axis=-1), here, header.noise["read"])

    parts = [slice(first, first + _BLOCK) for first in range(0, len(radiance), _BLOCK)]
    with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="highlights") as pool:
        blocks = list(pool.map(separated, parts))
    return Highlights(
        excess=np.concatenate([block.excess for block in blocks]),
        diffuse=np.concatenate([block.diffuse for block in blocks]),
    )


def _light_vectors(samples: Samples, header: StackHeader) -> Array:
    """Return direction times relative irradiance of each light, shape (N or 1, L, 3)."""
    lights, mm_per_px = header.lights, header.camera.mm_per_px
    direction = lights.direction[np.newaxis]
    if not lights.near or mm_per_px is None:
        return direction
    on_painting = np.pad(samples.position_mm(mm_per_px), ((0, 0), (0, 1)))
    away = lights.position_mm - on_painting[:, np.newaxis]
    distance = np.linalg.norm(away, axis=-1, keepdims=True)
    at_centre = np.linalg.norm(lights.position_mm, axis=-1)[:, np.newaxis]
    return np.where(np.isfinite(distance), away * at_centre**2 / distance**3, direction)


def _paints(highlights: Highlights) -> tuple[Array, Array, NDArray[np.intp]]:
    """Sort pixels by their diffuse colour.

    Returns
    -------
    found, body : ndarray of shape (K, 2), float64
        Per paint, the colour of the highlights and of the diffuse part, in the coordinates of `_PLANE`.
    count : ndarray of shape (K,), int
        Pixels of the paint.
    """
    found = np.log(highlights.excess) @ _PLANE.T
    body = np.log(highlights.diffuse) @ _PLANE.T
    _, paint = np.unique(np.floor(body / _PAINT_WIDTH), axis=0, return_inverse=True)
    paint = paint.ravel()
    count = np.bincount(paint)
    common = np.flatnonzero(count >= _PAINT_PIXELS)
    medians = [
        np.reshape([np.median(colour[paint == number], axis=0) for number in common], (-1, 2))
        for colour in (found, body)
    ]
    return medians[0], medians[1], count[common]


def _meeting_point(
    found: Array, body: Array, count: NDArray[np.intp]
) -> tuple[Array, Array, float, NDArray[np.bool_]]:
    """Find where the lines of most paints meet.

    Returns
    -------
    colour : ndarray of shape (2,)
    covariance : ndarray of shape (2, 2)
    support : float
        Share of the votes behind it, 0 to 1.
    near : ndarray of shape (K,), bool
        The paints that have a say.
    """
    votes = np.sqrt(count) / np.sqrt(count).sum()
    # White is tried before all others, and so is taken of two that are as good.
    points = [_climb(start, found, body) for start in (np.zeros(2), *found)]
    weights = [_weigh(point, found, body) for point in points]
    supports = np.array([(votes * weight**1.5).sum() for weight, _, _ in weights])
    best = int(np.flatnonzero(supports > supports.max() - 1e-9)[0])
    weight, precision, distance2 = weights[best]
    information = (weight[:, None, None] * precision).sum(axis=0)
    covariance = np.linalg.inv(information + 1e-9 * np.eye(2))
    # Points nearly as good say how far the choice between them is arbitrary.
    rivals = np.array(points)[supports > supports[best] - _AS_GOOD] - points[best]
    apart = rivals[np.argmax((rivals**2).sum(axis=1))]
    covariance += np.outer(apart, apart) / 4
    return points[best], covariance, float(supports[best]), distance2 < _CUT**2


def _climb(start: Array, found: Array, body: Array) -> Array:
    """Return the meeting point that reweighted least squares reach from `start`."""
    colour = start
    for _ in range(_STEPS):
        weight, precision, _ = _weigh(colour, found, body)
        if not weight.any():
            break
        information = (weight[:, None, None] * precision).sum(axis=0)
        pull = (weight[:, None, None] * precision @ found[..., None]).sum(axis=0)[:, 0]
        before, colour = colour, np.linalg.solve(information, pull)
        if np.abs(colour - before).max() < _STEP_END:
            break
    return colour


def _weigh(colour: Array, found: Array, body: Array) -> tuple[Array, Array, Array]:
    """Return weight, precision (2 x 2), and squared distance in standard deviations, of each paint."""
    towards = body - colour
    length2 = (towards**2).sum(axis=-1)
    any_way = _ANY_WAY**2 + _METAL**2 * np.exp(-length2 / _TELLING**2)
    along = _TOWARDS_PAINT**2 / (any_way + _TOWARDS_PAINT**2 * length2)
    outer = towards[:, :, None] * towards[:, None, :]
    precision = (np.eye(2) - along[:, None, None] * outer) / any_way[:, None, None]
    off = found - colour
    distance2 = (off[:, None, :] @ precision @ off[:, :, None])[:, 0, 0]
    return np.maximum(0.0, 1.0 - distance2 / _CUT**2) ** 2, precision, distance2
