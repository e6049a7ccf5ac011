"""The pictures that observers compare: renderings and the photograph, through the same display chain.

Reference and candidates of a sample are cut alike, reduced alike and shown at the same exposure, so that they
differ by nothing but the rendering.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.colour import quantise
from impasto.colour.rendition import Rendition
from impasto.errors import OptionError, Problem
from impasto.images import write_png
from impasto.light_strength import scale_photographed
from impasto.render import render_bands
from impasto.store import Fit, Stack

_BAND_ROWS = 256
_LIGHTS_AT_A_TIME = 8
# What is shown as this share of the display's white, and which share of the samples may be brighter.
_BRIGHT_SHOWN_AS, _BRIGHTER = 0.8, 0.02
# Overexposed samples may be infinite, of which there is no mean.
_BRIGHTEST = np.float32(1e6)


@dataclass(frozen=True)
class View:
    """Which part of a painting is shown, and how far it is reduced.

    Parameters
    ----------
    rows, columns : slice
        With start and stop; their lengths are multiples of `factor`.
    factor : int
        So many pixels along a side are averaged to one, in linear light.
    """

    rows: slice
    columns: slice
    factor: int

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of the pictures in pixels."""
        height, width = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        return height // self.factor, width // self.factor

    @property
    def crop_px(self) -> tuple[int, int, int, int]:
        """Left, top, width and height in pixels of the photographs."""
        height, width = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        return self.columns.start, self.rows.start, width, height


def choose_view(shape: tuple[int, int], crop: tuple[int, int, int, int] | None, longest: int) -> View:
    """Return the part that is shown, reduced until its longer side is `longest` pixels at most.

    Parameters
    ----------
    shape : (int, int)
        Height and width of the photographs in pixels.
    crop : (int, int, int, int) or None
        Left, top, width and height; None for all. What does not fill a pixel of the picture at the right and
        the bottom is left away.
    longest : int

    Raises
    ------
    OptionError
        If the crop does not lie within the photographs.
    """
    height, width = shape
    left, top, across, down = crop or (0, 0, width, height)
    if not (0 <= left < left + across <= width and 0 <= top < top + down <= height):
        raise OptionError(
            Problem(
                where=f"--crop {left},{top},{across},{down}",
                what=f"does not lie within the photographs of {width} x {height} px",
                do="Give left, top, width and height in pixels of the photographs",
            )
        )
    factor = -(-max(across, down) // longest)
    factor = max(1, min(factor, across, down))
    return View(
        rows=slice(top, top + down // factor * factor),
        columns=slice(left, left + across // factor * factor),
        factor=factor,
    )


class _Reduced:
    """Averages rows of pictures as they come, leaving missing samples out."""

    def __init__(self, count: int, view: View, channels: int) -> None:
        self._view = view
        shape = (count, *view.size, channels)
        self._sum, self._samples = np.zeros(shape), np.zeros(shape, np.int64)

    def add(self, rows: slice, radiance: NDArray[np.float32]) -> None:
        """Take in radiance (L, rows, W, C) of whole rows of the painting."""
        view = self._view
        first, last = max(rows.start, view.rows.start), min(rows.stop, view.rows.stop)
        if first >= last:
            return
        part = radiance[:, first - rows.start : last - rows.start, view.columns]
        blocks = part.reshape(len(part), last - first, view.size[1], view.factor, -1)
        known = ~np.isnan(blocks)
        target = (np.arange(first, last) - view.rows.start) // view.factor
        for total, values in (
            (self._sum, np.where(known, np.minimum(blocks, _BRIGHTEST), 0).sum(axis=3, dtype=np.float64)),
            (self._samples, known.sum(axis=3)),
        ):
            for row, place in enumerate(target):
                total[:, place] += values[:, row]

    def result(self) -> NDArray[np.float32]:
        """Return the pictures, NaN where there is nothing known."""
        with np.errstate(invalid="ignore"):
            return (self._sum / np.where(self._samples, self._samples, np.nan)).astype(np.float32)


def photographs(stack: Stack, view: View, lights: Sequence[int]) -> Iterator[NDArray[np.float32]]:
    """Yield what each photograph shows in a view: ndarrays of shape (H, W, C), relative radiance.

    Raises
    ------
    StoreError
        If the stack is damaged.
    """
    width = stack.shape[2]
    for light in lights:
        reduced = _Reduced(1, view, stack.shape[3])
        for top in range(view.rows.start, view.rows.stop, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, view.rows.stop))
            reduced.add(rows, stack.radiance(rows, slice(0, width), [light]))
        yield reduced.result()[0]


def renderings(fit: Fit, stack: Stack, view: View, lights: Sequence[int]) -> Iterator[NDArray[np.float32]]:
    """Yield what a fit shows under the lights of photographs; see `photographs`.

    Lights are as strong as the fit found them.

    Raises
    ------
    StoreError
        If the fit is damaged.
    """
    found = scale_photographed(fit.attributes, stack.lights)
    for start in range(0, len(lights), _LIGHTS_AT_A_TIME):
        group = list(lights[start : start + _LIGHTS_AT_A_TIME])
        reduced = _Reduced(len(group), view, stack.shape[3])
        for band in render_bands(fit, found.select(group), stack.camera):
            reduced.add(band.rows, band.radiance)
        yield from reduced.result()


def per_unit_of_light(stack: Stack, light: int, radiance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return radiance (H, W, C) as it would be under a light of intensity 1.

    Photographs differ in exposure and lamps in strength, and both stand in the light's intensity; without
    them the exposure on the display is the same for all angles.
    """
    return radiance / np.float32(stack.lights.intensity[light].mean())


def choose_exposure(pictures: Sequence[NDArray[np.float32]]) -> float:
    """Return the exposure at which 98 % of the samples are shown below 0.8 of the display's white.

    Parameters
    ----------
    pictures : sequence of ndarray of shape (H, W, C)
        Radiance per unit of light, of the photographs without a highlight where there are any.
    """
    brightest = np.concatenate([picture.max(axis=-1).ravel() for picture in pictures])
    brightest = brightest[np.isfinite(brightest)]
    level = float(np.quantile(brightest, 1 - _BRIGHTER)) if len(brightest) else 0.0
    return _BRIGHT_SHOWN_AS / level if level > 0 else 1.0


def write_stimulus(path: Path, radiance: NDArray[np.float32], rendition: Rendition) -> None:
    """Write the picture of radiance (H, W, C) as a display is sent it, with the display's profile.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_png(path, quantise(rendition(radiance).drive), rendition.profile)
