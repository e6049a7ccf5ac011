"""A few pixels of every photograph, taken on the way into the store."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.geometry import pixel_position_mm

# Pixels taken, in a lattice on chunks spread over the painting; fewer where lights are many.
_PIXELS = 8192
_SAMPLES = 1 << 20
_CHUNKS_ACROSS = 3


class Samples:
    """Values on a lattice in up to nine chunks spread over the painting, under every light.

    Parameters
    ----------
    shape : tuple of int
        Of the stack: (light, y, x, channel).
    dtype : dtype
        Of the stack.
    """

    def __init__(self, shape: tuple[int, int, int, int], dtype: np.dtype) -> None:
        lights, self._height, self._width, channels = shape
        self._chunks = [(rows, columns) for rows in _spread(self._height) for columns in _spread(self._width)]
        pixels = sum(
            (rows.stop - rows.start) * (columns.stop - columns.start) for rows, columns in self._chunks
        )
        wanted = min(_PIXELS, max(_PIXELS // 8, _SAMPLES // lights))
        step = math.ceil(math.sqrt(pixels / wanted))
        self._lattice = slice(step // 2, None, step)
        parts = [self._part(rows).size * self._part(columns).size for rows, columns in self._chunks]
        self._parts = [slice(stop - size, stop) for size, stop in zip(parts, np.cumsum(parts), strict=True)]
        self._values = np.empty((lights, sum(parts), channels), dtype)
        self._taken = np.zeros((lights, len(self._chunks)), bool)

    def _part(self, pixels: slice) -> NDArray[np.intp]:
        return np.arange(pixels.start, pixels.stop)[self._lattice]

    def take(self, light: int, row: int, band: NDArray[np.generic]) -> None:
        """Take what a band of chunks holds of the lattice.

        Parameters
        ----------
        light : int
        row : int
            The band's first row.
        band : ndarray of shape (rows, W, C)
            Values as stored.
        """
        for number, (rows, columns) in enumerate(self._chunks):
            if rows.start == row:
                taken = band[self._lattice, columns][:, self._lattice]
                self._values[light, self._parts[number]] = taken.reshape(-1, band.shape[-1])
                self._taken[light, number] = True

    @property
    def whole(self) -> bool:
        """Whether all photographs were taken."""
        return bool(self._taken.all())

    def complete(self, stack: stores.Stack) -> None:
        """Read from a stack what was not taken on the way into it.

        Raises
        ------
        StoreError
            If the stack is damaged.
        """
        for number, (rows, columns) in enumerate(self._chunks):
            for light in np.flatnonzero(~self._taken[:, number]):
                (values,) = stack.read(rows, columns, [light])
                taken = values[self._lattice, self._lattice]
                self._values[light, self._parts[number]] = taken.reshape(-1, values.shape[-1])
        self._taken[:] = True

    @property
    def values(self) -> NDArray[np.float64]:
        """Values as stored, shape (N, L, C)."""
        return self._values.swapaxes(0, 1).astype(np.float64, order="C")

    def position_mm(self, mm_per_px: float) -> NDArray[np.float32]:
        """Return where the pixels lie on the painting, shape (N, 2)."""
        parts = []
        for rows, columns in self._chunks:
            position = pixel_position_mm(rows, columns, self._height, self._width, mm_per_px)
            grid = position.reshape(rows.stop - rows.start, columns.stop - columns.start, 2)
            parts.append(grid[self._lattice, self._lattice].reshape(-1, 2))
        return np.concatenate(parts)


def _spread(length: int) -> list[slice]:
    """Return rows, or columns, of up to three chunks, spread evenly over the painting."""
    size = stores.STACK_CHUNK
    count = -(-length // size)
    chosen = sorted({round(chunk) for chunk in np.linspace(0, count - 1, min(count, _CHUNKS_ACROSS))})
    return [slice(chunk * size, min((chunk + 1) * size, length)) for chunk in chosen]
