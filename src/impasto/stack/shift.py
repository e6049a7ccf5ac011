"""Shift photographs back to where the others lie, as they are stacked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.store.layout import stack_fill_value

# Lanczos' kernel of three lobes: on simulated paintings its error is that of a cubic spline, which reaches
# over the whole picture (3.2 % of the mean radiance at half a pixel; Catmull-Rom 4.6 %, linear 7.5 %).
_LOBES = 3
_SLAB_ROWS = 64
_NEGLIGIBLE = 1e-9
# What stands for a clipped sample of a float stack, relative to the level from which on they are clipped.
_BEYOND = 1.01


class Shift:
    """Shifts a photograph's stored values back, in bands of rows.

    Parameters
    ----------
    shift_px : (float, float)
        Columns and rows by which its content lies to the right of and below its place.
    height : int
        Of the photograph.
    clip_level : ndarray of shape (C,)
        Stored value from which on a sample is clipped; infinite where none is.

    Notes
    -----
    A sample that a clipped one has a part in is clipped, and one beyond the photograph's border is missing:
    NaN in floats, and the largest value, which is clipped, in integers.

    References
    ----------
    [Duchon1979]_, for the kernel.
    """

    def __init__(self, shift_px: Sequence[float], height: int, clip_level: NDArray[np.float64]) -> None:
        columns, rows = shift_px
        self._columns, self._rows = _taps(columns), _taps(rows)
        self._height = height
        self._clip_level = clip_level.astype(np.float32)

    def bands(self, bands: Iterable[tuple[int, NDArray[Any]]]) -> Iterator[tuple[int, NDArray[Any], int]]:
        """Shift bands back.

        Parameters
        ----------
        bands : iterable of (int, ndarray of shape (rows, W, C))
            First row and stored values, from top to bottom without gaps.

        Yields
        ------
        row0 : int
            The same rows as were given.
        band : ndarray of shape (rows, W, C)
        clipped : int
            Samples that are clipped.
        """
        held: list[tuple[int, NDArray[Any]]] = []
        wanted: list[tuple[int, int]] = []
        first, last = self._rows[0][0], self._rows[-1][0]
        for row0, band in bands:
            held.append((row0, np.array(band)))
            arrived = row0 + len(band)
            wanted.append((row0, arrived))
            while wanted and (wanted[0][1] + last <= arrived or arrived == self._height):
                top, bottom = wanted.pop(0)
                yield (top, *self._band(held, top, bottom))
                while len(held) > 1 and held[0][0] + len(held[0][1]) <= bottom + first:
                    held.pop(0)

    def _band(self, held: list[tuple[int, NDArray[Any]]], top: int, bottom: int) -> tuple[NDArray[Any], int]:
        """Return the rows from `top` to `bottom`, and how many of their samples are clipped."""
        _, width, channels = held[-1][1].shape
        dtype = held[-1][1].dtype
        out = np.full((bottom - top, width, channels), stack_fill_value(dtype), dtype)
        clipped = 0
        start = max(top, -self._rows[0][0])
        stop = min(bottom, self._height - self._rows[-1][0])
        left = max(0, -self._columns[0][0])
        right = min(width, width - self._columns[-1][0])
        for row in range(start, stop if left < right else start, _SLAB_ROWS):
            end = min(row + _SLAB_ROWS, stop)
            rows = _rows(held, row + self._rows[0][0], end + self._rows[-1][0])
            lost = rows >= self._clip_level
            values = np.where(lost, 0, rows).astype(np.float32)
            values, lost = _sum(values, lost, self._columns, left, right, axis=1)
            offset = -self._rows[0][0]
            values, lost = _sum(values, lost, self._rows, offset, offset + end - row, axis=0)
            lost |= values >= self._clip_level
            clipped += int(np.count_nonzero(lost))
            out[row - top : end - top, left:right] = self._stored(values, lost, dtype)
        return out, clipped

    def _stored(self, values: NDArray[np.float32], lost: NDArray[np.bool_], dtype: np.dtype) -> NDArray[Any]:
        if dtype.kind == "f":
            return np.where(lost, self._clip_level * np.float32(_BEYOND), values)
        largest = np.iinfo(dtype).max
        values = np.clip(np.rint(values), 0, largest - 1)
        return np.where(lost, largest, values).astype(dtype)


def _taps(shift_px: float) -> list[tuple[int, float]]:
    """Return which samples make up one of a row or column, by their distance, and their weights."""
    whole = math.floor(shift_px)
    distance = np.arange(-_LOBES + 1, _LOBES + 1)
    from_here = distance - (shift_px - whole)
    weight = np.sinc(from_here) * np.sinc(from_here / _LOBES)
    weight /= weight.sum()
    return [
        (whole + int(at), float(one))
        for at, one in zip(distance, weight, strict=True)
        if abs(one) > _NEGLIGIBLE
    ]


def _rows(held: list[tuple[int, NDArray[Any]]], top: int, bottom: int) -> NDArray[Any]:
    return np.concatenate([
        band[max(top - row0, 0) : bottom - row0]
        for row0, band in held
        if row0 < bottom and top < row0 + len(band)
    ])  # fmt: skip


def _sum(
    values: NDArray[np.float32],
    lost: NDArray[np.bool_],
    taps: list[tuple[int, float]],
    start: int,
    stop: int,
    *,
    axis: int,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the weighted sums from `start` to `stop` along an axis, and where a lost sample is in them."""
    shape = list(values.shape)
    shape[axis] = stop - start
    total, any_lost = np.zeros(shape, np.float32), np.zeros(shape, bool)
    for distance, weight in taps:
        part = [slice(None)] * values.ndim
        part[axis] = slice(start + distance, stop + distance)
        total += np.float32(weight) * values[tuple(part)]
        any_lost |= lost[tuple(part)]
    return total, any_lost
