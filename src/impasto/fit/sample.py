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


@dataclass(frozen=True)
class Sample:
    """Pixels on a regular grid.

    Parameters
    ----------
    values : ndarray of shape (L, N, C), uint16 or float32
        As stored.
    row, column : ndarray of shape (N,), int
        Where they lie.
    """

    values: NDArray[Any]
    row: NDArray[np.intp]
    column: NDArray[np.intp]

    def thinned(self, count: int) -> Sample:
        """Return about `count` of the pixels, or all of fewer."""
        every = np.linspace(0, len(self.row) - 1, min(count, len(self.row))).astype(np.intp)
        return Sample(np.ascontiguousarray(self.values[:, every]), self.row[every], self.column[every])


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
    parts = list(grid_pixels(stack, lights, step, "Looking at a sample", show_progress))
    return Sample(
        np.concatenate([part.values for part in parts], axis=1),
        np.concatenate([part.row for part in parts]),
        np.concatenate([part.column for part in parts]),
    )


def grid_pixels(
    stack: stores.Stack, lights: Sequence[int], step: int, title: str, show_progress: bool | None
) -> Iterator[Sample]:
    """Yield every `step`-th pixel of every `step`-th row, tile by tile.

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
    _, height, width, _ = stack.shape
    with (
        progress(title, height * width, show=show_progress) as advance,
        closing(read_tiles(stack, lights, stores.units(height, width))) as tiles,
    ):
        for _, tile, radiance in tiles:
            rows, columns = tile.rows, tile.columns
            # The grid is the whole picture's, so that it does not depend on how tiles are cut.
            first = [-(place.start + step // 2) % step for place in (rows, columns)]
            part = radiance[:, first[0] :: step, first[1] :: step]
            row, column = np.mgrid[
                rows.start + first[0] : rows.stop : step, columns.start + first[1] : columns.stop : step
            ].reshape(2, -1)
            if len(row):
                yield Sample(part.reshape(len(part), -1, part.shape[-1]).copy(), row, column)
            advance(tile.pixels)
