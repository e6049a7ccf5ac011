"""Some pixels of a stack, spread evenly, for what has to be known before the whole is fitted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.fit.streaming import read_tiles
from impasto.geometry import Lights, zenith_azimuth
from impasto.progress import progress

# Enough for the second moments of some hundred samples per pixel, few enough to be fitted several times over.
_PIXELS = 12288

# About so many crosses of pixels, each in the middle of a square of 4 by 4: tiles are cut between squares.
_CROSSES = 2400
_SQUARE = 4


@dataclass(frozen=True)
class Sample:
    """Pixels on a regular grid.

    Parameters
    ----------
    values : ndarray of shape (L, N, C), uint16 or float32
        As stored.
    row, column : ndarray of shape (N,), int
        Where they lie.
    crosses : ndarray of shape (L, M, 4, C), uint16 or float32
        The neighbours above, right of, below and left of M pixels on a wider grid.
    """

    values: NDArray[Any]
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    crosses: NDArray[Any]

    def thinned(self, count: int) -> Sample:
        """Return about `count` of the pixels, or all of fewer, and all crosses."""
        every = np.linspace(0, len(self.row) - 1, min(count, len(self.row))).astype(np.intp)
        values = np.ascontiguousarray(self.values[:, every])
        return Sample(values, self.row[every], self.column[every], self.crosses)


def deal_lights(lights: Lights, folds: int) -> list[list[int]]:
    """Divide lights into folds, each spread in elevation and azimuth.

    The lights are ordered by their zenith angle, within 5° by azimuth, and dealt out in turn.

    Parameters
    ----------
    lights : Lights
    folds : int
        From 1 to as many as there are lights.

    Returns
    -------
    list of list of int
        Indices into `lights`, in rising order.
    """
    zenith, azimuth = zenith_azimuth(lights.direction)
    order = np.lexsort((azimuth, np.floor(np.degrees(zenith) / 5.0)))
    return [sorted(int(index) for index in order[first::folds]) for first in range(folds)]


def sample_pixels(stack: stores.Stack, lights: Sequence[int], show_progress: bool | None) -> Sample:
    """Read pixels on a regular grid, in one pass over the stack.

    Parameters
    ----------
    stack : Stack
    lights : sequence of int
        Which photographs.
    show_progress : bool or None
        Whether to show a progress bar; by default, if standard error is a terminal.

    Raises
    ------
    StoreError
        If the stack is damaged.
    """
    _, height, width, _ = stack.shape
    step = max(1, math.isqrt(height * width // _PIXELS))
    wide = max(1, math.isqrt(height * width // _CROSSES) // _SQUARE) * _SQUARE
    parts, crosses = [], []
    for tile, radiance in _tiles(stack, lights, "Looking at a sample", show_progress):
        parts.append(_grid(tile, radiance, step))
        crosses.append(_crosses(tile, radiance, wide))
    values, rows, columns = zip(*parts, strict=True)
    return Sample(
        np.concatenate(values, axis=1),
        np.concatenate(rows),
        np.concatenate(columns),
        np.concatenate(crosses, axis=1),
    )


def grid_pixels(
    stack: stores.Stack, lights: Sequence[int], step: int, title: str, show_progress: bool | None
) -> Iterator[tuple[NDArray[Any], NDArray[np.intp], NDArray[np.intp]]]:
    """Yield values, row and column of every `step`-th pixel of every `step`-th row, tile by tile.

    Parameters
    ----------
    stack : Stack
    lights : sequence of int
        Which photographs.
    step : int
    title : str
        What the progress bar says.
    show_progress : bool or None
        Whether to show it; by default, if standard error is a terminal.

    Raises
    ------
    StoreError
        If the stack is damaged.
    """
    for tile, radiance in _tiles(stack, lights, title, show_progress):
        part = _grid(tile, radiance, step)
        if len(part[1]):
            yield part


def _tiles(
    stack: stores.Stack, lights: Sequence[int], title: str, show_progress: bool | None
) -> Iterator[tuple[stores.Tile, NDArray[Any]]]:
    """Yield the tiles of a stack and their values (L, rows, columns, C), valid until the next."""
    _, height, width, _ = stack.shape
    with (
        progress(title, height * width, show=show_progress) as advance,
        closing(read_tiles(stack, lights, stores.units(height, width))) as tiles,
    ):
        for _, tile, radiance in tiles:
            yield tile, radiance
            advance(tile.pixels)


def _grid(
    tile: stores.Tile, radiance: NDArray[Any], step: int
) -> tuple[NDArray[Any], NDArray[np.intp], NDArray[np.intp]]:
    """Return values (L, N, C), rows and columns of the pixels of a tile that lie on a grid."""
    # The grid is the whole picture's, so that it does not depend on how tiles are cut.
    first = [-(place.start + step // 2) % step for place in (tile.rows, tile.columns)]
    part = radiance[:, first[0] :: step, first[1] :: step]
    row, column = np.mgrid[
        tile.rows.start + first[0] : tile.rows.stop : step,
        tile.columns.start + first[1] : tile.columns.stop : step,
    ].reshape(2, -1)
    return part.reshape(len(part), -1, part.shape[-1]).copy(), row, column


def _crosses(tile: stores.Tile, radiance: NDArray[Any], step: int) -> NDArray[Any]:
    """Return the neighbours (L, M, 4, C) of pixels of a tile that lie on a grid of whole squares."""
    row, column = (
        np.arange((_SQUARE // 2 - place.start) % step, place.stop - place.start - 1, step)
        for place in (tile.rows, tile.columns)
    )
    around = radiance[:, row[:, None, None] + [-1, 0, 1, 0], column[:, None] + [0, 1, 0, -1]]
    return around.reshape(len(around), -1, 4, around.shape[-1])
