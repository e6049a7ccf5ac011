"""Pixels spread over a painting: enough for statistics, at a cost that does not grow with the painting."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.pixels import Pixels, join_pixels, read_pixels
from impasto.store import STACK_CHUNK, Fit, Stack

_MOST_TILES = 16
_PIXELS = 16_000


@dataclass(frozen=True)
class PaintingSample:
    """Every `step`-th pixel of every `step`-th row of some tiles; what is asked for is read once.

    Parameters
    ----------
    stack : Stack
    fits : mapping of str to Fit

    Notes
    -----
    The tiles are chunks of the stack, all of them or, of larger paintings, 16 that are spread evenly.
    """

    stack: Stack
    fits: Mapping[str, Fit]
    _pixels: dict[str, Pixels] = field(default_factory=dict, repr=False)

    @cached_property
    def tiles(self) -> list[tuple[slice, slice]]:
        """Rows and columns of the tiles."""
        _, height, width, _ = self.stack.shape
        tiles = [
            (slice(top, min(top + STACK_CHUNK, height)), slice(left, min(left + STACK_CHUNK, width)))
            for top in range(0, height, STACK_CHUNK)
            for left in range(0, width, STACK_CHUNK)
        ]
        count = min(len(tiles), _MOST_TILES)
        return [tiles[index] for index in np.linspace(0, len(tiles) - 1, count).round().astype(int)]

    @cached_property
    def step(self) -> int:
        """Distance of the pixels along a side."""
        area = sum((rows.stop - rows.start) * (columns.stop - columns.start) for rows, columns in self.tiles)
        return max(1, round(math.sqrt(area / _PIXELS)))

    @cached_property
    def radiance(self) -> NDArray[np.float32]:
        """Relative radiance as photographed, shape (L, P, C)."""
        count, channels = self.stack.shape[0], self.stack.shape[3]
        parts = [
            self.stack.radiance(rows, columns, step=self.step).reshape(count, -1, channels)
            for rows, columns in self.tiles
        ]
        return np.concatenate(parts, axis=1)

    def pixels(self, model: str) -> Pixels:
        """Return the parameters of the pixels by a model, those without a fit among them."""
        if model not in self._pixels:
            parts = [
                read_pixels(self.fits[model], rows, columns).select(index)
                for rows, columns, index in self._places()
            ]
            self._pixels[model] = join_pixels(parts)
        return self._pixels[model]

    def values(self, model: str, name: str) -> NDArray[Any]:
        """Return the pixels' values of a map of a model, shape (P[, k])."""
        fit = self.fits[model]
        parts = []
        for rows, columns, index in self._places():
            values = fit.read(rows, columns, [name])[name]
            parts.append(values.reshape(-1, *values.shape[2:])[index])
        return np.concatenate(parts)

    def __len__(self) -> int:
        return sum(len(index) for _, _, index in self._places())

    def _places(self) -> Iterator[tuple[slice, slice, NDArray[np.intp]]]:
        """Yield each tile with the numbers of its pixels, counted row by row."""
        for rows, columns in self.tiles:
            height, width = rows.stop - rows.start, columns.stop - columns.start
            yield (
                rows,
                columns,
                np.arange(height * width).reshape(height, width)[:: self.step, :: self.step].ravel(),
            )
