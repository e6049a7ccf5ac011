"""One look at a photograph, from which all checks are made: it is decoded once, in bands."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.steadiness import log_level, part_slices
from impasto.capture import CLIP_LEVEL
from impasto.capture.photographs import Photograph, read_photograph
from impasto.colour import linearisation_table

# The longer side of the reduced picture, which is what the page shows, and of the one that is fitted.
_REDUCED_PX, _SMALL_PX = 900, 48
_BAND_ROWS = 512
_BINS = 64
_BRIGHT_PERCENT = 95


@dataclass(frozen=True, eq=False)
class Look:
    """What is kept of a photograph that was seen.

    Parameters
    ----------
    photograph : Photograph
    pixels_sha256 : str
        Digest of the decoded values, which a copy shares whatever its name and metadata are; "" where all
        values are equal, as in dark frames and where everything is clipped.
    clipped : float
        Share of the samples at full scale.
    histogram : ndarray of shape (C, 64)
        Shares of the samples per channel, over the square root of the linear values; of every so many pixels.
    reduced : ndarray of shape (h, w, C), float32
        Relative radiance, means of blocks, at most 900 pixels on the longer side.
    reduced_clipped : ndarray of shape (h, w), bool
        Blocks in which a sample is clipped.
    parts : tuple of ndarray of shape (rows, columns), float16
        Parts of the frame in full resolution, logarithms of the luminance.
    parts_clipped : tuple of ndarray of shape (rows, columns), bool
        Where samples are clipped in them.
    """

    photograph: Photograph
    pixels_sha256: str
    clipped: float
    histogram: NDArray[np.float64]
    reduced: NDArray[np.float32]
    reduced_clipped: NDArray[np.bool_]
    parts: tuple[NDArray[np.float16], ...]
    parts_clipped: tuple[NDArray[np.bool_], ...]

    @property
    def bright(self) -> float:
        """Relative radiance that a twentieth of the picture reaches: dark surroundings do not count."""
        return float(np.percentile(np.minimum(self.reduced, 1.0), _BRIGHT_PERCENT))

    @property
    def small(self) -> NDArray[np.float32]:
        """The picture of at most 48 pixels on its longer side, infinite where any sample is clipped."""
        height, width, channels = self.reduced.shape
        step = max(1, -(-max(height, width) // _SMALL_PX))
        rows, columns = height // step, width // step
        cut = self.reduced[: rows * step, : columns * step]
        mean = np.asarray(cut.reshape(rows, step, columns, step, channels).mean(axis=(1, 3)), np.float32)
        lost = self.reduced_clipped[: rows * step, : columns * step]
        mean[lost.reshape(rows, step, columns, step).any(axis=(1, 3))] = np.inf
        return mean

    def thinned(self, *, parts: bool = True) -> Look:
        """Return what later photographs are compared with: a small picture, and if wanted the parts."""
        small = self.small
        thin = replace(self, reduced=small, reduced_clipped=~np.isfinite(small[..., 0]))
        return thin if parts else replace(thin, parts=(), parts_clipped=())


def look_at(path: Path, transfer: str | None = None, clip_level: float | None = None) -> Look:
    """Decode a photograph.

    Parameters
    ----------
    path : Path
    transfer : str, optional
        Transfer function, if the file does not say the right one.
    clip_level : float, optional
        Value as stored from which on a sample is clipped.

    Raises
    ------
    CaptureError
        If it is damaged, cut off, or no photograph.
    """
    photograph, _ = read_photograph(path, transfer)
    height, width, channels = photograph.height, photograph.width, photograph.channels
    step = max(1, -(-max(height, width) // _REDUCED_PX))
    rows, columns = -(-height // step), -(-width // step)
    reduced = np.empty((rows, columns, channels), np.float32)
    lost = np.empty((rows, columns), bool)
    slices = part_slices(height, width)
    parts = [np.empty(_size(part), np.float32) for part in slices]
    parts_clipped = [np.empty(_size(part), bool) for part in slices]
    level = CLIP_LEVEL[photograph.dtype.name] if clip_level is None else clip_level
    linear = _linear(photograph)
    digest = hashlib.sha256()
    clipped = 0
    lowest, highest = np.inf, -np.inf
    histogram = np.zeros((channels, _BINS), np.int64)
    band_rows = max(1, _BAND_ROWS // step) * step
    for row, band in photograph.bands(band_rows):
        digest.update(np.ascontiguousarray(band).tobytes())
        lowest, highest = min(lowest, float(band.min())), max(highest, float(band.max()))
        over = np.asarray(band >= level)
        values: NDArray[Any] = linear(band)
        clipped += int(np.count_nonzero(over))
        histogram += _histogram(values[::step, ::step])
        lost_here = over[..., 0].copy()
        for channel in range(1, channels):  # ten times as fast as any() over the short axis
            lost_here |= over[..., channel]
        target = slice(row // step, row // step + -(-len(band) // step))
        reduced[target] = _blocks(values, step)
        lost[target] = _blocks(lost_here[..., None].astype(np.float32), step)[..., 0] > 0
        for number, (down, across) in enumerate(slices):
            top, bottom = max(down.start, row), min(down.stop, row + len(band))
            if top < bottom:
                into, of = slice(top - down.start, bottom - down.start), slice(top - row, bottom - row)
                parts[number][into] = values[of, across].mean(axis=2)
                parts_clipped[number][into] = lost_here[of, across]
    return Look(
        photograph=photograph,
        pixels_sha256=digest.hexdigest() if highest > lowest else "",
        clipped=clipped / (height * width * channels),
        histogram=histogram / histogram[0].sum(),
        reduced=reduced,
        reduced_clipped=lost,
        parts=tuple(log_level(part).astype(np.float16) for part in parts),
        parts_clipped=tuple(parts_clipped),
    )


def _size(part: tuple[slice, slice]) -> tuple[int, int]:
    down, across = part
    return down.stop - down.start, across.stop - across.start


def _histogram(values: NDArray[Any]) -> NDArray[np.int64]:
    """Return how many values of each channel fall into each bin, shape (C, bins)."""
    bins = np.clip(np.sqrt(np.maximum(values, 0)) * _BINS, 0, _BINS - 1).astype(np.uint8)
    counts = [np.bincount(bins[..., channel].ravel(), minlength=_BINS) for channel in range(bins.shape[2])]
    return np.array(counts, np.int64)


def _linear(photograph: Photograph) -> Callable[[NDArray[Any]], NDArray[np.float32]]:
    """Return the function that makes relative radiance of values as stored."""
    if photograph.dtype.kind == "f":
        return lambda band: np.asarray(band, np.float32)
    table = linearisation_table(photograph.transfer, photograph.dtype, photograph.icc_profile)
    table = table.astype(np.float32)
    if table.ndim == 1:
        return lambda band: np.asarray(table[band], np.float32)
    return lambda band: np.stack([table[:, c][band[..., c]] for c in range(band.shape[2])], axis=-1)


def _blocks(values: NDArray[Any], step: int) -> NDArray[np.float32]:
    """Return the means of blocks; those at the right and lower edge may be smaller."""
    if step == 1:
        return values
    rows = np.arange(0, values.shape[0], step)
    columns = np.arange(0, values.shape[1], step)
    total = np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff([*rows, values.shape[0]]), np.diff([*columns, values.shape[1]])).astype(
        np.float32
    )
    return np.asarray(total / counts[..., None])
