"""One pass over a stack for what the paper's procedure needs of the sample: its peak, and some pixels."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.errors import OptionError, Problem
from impasto.fit.streaming import read_tiles
from impasto.progress import progress

# Enough for a 99th percentile, few enough to cost nothing.
_GRID_PIXELS = 4096


@dataclass(frozen=True)
class Survey:
    """What one pass over a stack found.

    Parameters
    ----------
    row, column : int
        The pixel with the largest radiance, mean of the channels relative to the light's colour, of those
        without a clipped sample.
    light : int
        The light of that radiance, counted among those surveyed.
    peak : ndarray of shape (L, 1, C)
        The pixel's values, as stored.
    grid : ndarray of shape (L, N, C)
        Values of pixels on a regular grid, as stored.
    clipped_pixels : int
        Pixels with a clipped sample.
    """

    row: int
    column: int
    light: int
    peak: NDArray[Any]
    grid: NDArray[Any]
    clipped_pixels: int


def survey(stack: stores.Stack, lights: Sequence[int], show_progress: bool | None) -> Survey:
    """Look for the highlight's peak; a second call for the same stack and lights remembers the answer.

    Parameters
    ----------
    stack : Stack
    lights : sequence of int
        Which photographs.
    show_progress : bool or None
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    Survey

    Raises
    ------
    OptionError
        If every pixel has a clipped sample.
    StoreError
        If the stack is damaged.
    """
    return _survey(stack.store, stack.sha256, tuple(lights), show_progress)


# The models of one run ask the same, one after the other.
@lru_cache(maxsize=1)
def _survey(store: Path, sha256: str, lights: tuple[int, ...], show_progress: bool | None) -> Survey:
    stack = stores.open_stack(store)
    _, height, width, _ = stack.shape
    step = max(1, int(np.sqrt(height * width / _GRID_PIXELS)))
    peak = _Peak(stack, lights)
    grid = []
    with (
        progress("Looking for the highlight", height * width, show=show_progress) as advance,
        closing(read_tiles(stack, lights, stores.units(height, width))) as tiles,
    ):
        for _, tile, values in tiles:
            peak.look(tile.rows, tile.columns, values)
            below, right = (-tile.rows.start) % step, (-tile.columns.start) % step
            grid.append(values[:, below::step, right::step].reshape(len(lights), -1, values.shape[-1]).copy())
            advance(tile.pixels)
    if peak.values is None:
        raise OptionError(
            Problem(
                where=f"{store}: stack",
                what=f"every one of the {height * width} pixels has a clipped sample, so the highlight's "
                "peak is not known",
                do="Take shorter exposures too and merge them, or use --procedure joint",
            )
        )
    return Survey(*peak.place, peak.values, np.concatenate(grid, axis=1), peak.clipped_pixels)


class _Peak:
    """The brightest pixel of the tiles seen so far, and how many were clipped."""

    def __init__(self, stack: stores.Stack, lights: Sequence[int]) -> None:
        # In the core's own precision, so that both agree on which samples are clipped.
        self._scale, self._offset = np.float32(stack.scale), np.float32(stack.offset)
        self._clip_level = stack.clip_level.astype(np.float32)
        channels = stack.shape[3]
        intensity = stack.lights.intensity[np.asarray(lights)]
        self._per_radiance = 1.0 / (intensity * stack.light_rgb * channels)
        self._brightest = -np.inf
        self.place = (-1, -1, -1)
        self.values: NDArray[Any] | None = None
        self.clipped_pixels = 0

    def look(self, rows: slice, columns: slice, values: NDArray[Any]) -> None:
        # The largest value of each channel over the lights is cheap; it tells which pixels are clipped and
        # bounds the rest, so that few pixels are looked at light by light.
        largest = self._radiance(np.fmax.reduce(values, axis=0))
        clipped = np.zeros(largest.shape[:2], bool)
        for channel, level in enumerate(self._clip_level):  # `any` along them takes 15 times as long
            clipped |= largest[..., channel] >= level
        self.clipped_pixels += int(np.count_nonzero(clipped))
        bound = np.fmax(-np.inf, largest @ self._per_radiance.max(axis=0))
        bound[clipped] = -np.inf
        likeliest = np.unravel_index(bound.argmax(), bound.shape)
        if bound[likeliest] <= self._brightest:
            return
        # Once it is known, few others can be brighter.
        self._compare(rows, columns, values, *likeliest)
        candidates = np.argwhere(bound > self._brightest)
        for row, column in candidates[np.argsort(-bound[tuple(candidates.T)], kind="stable")]:
            if bound[row, column] <= self._brightest:
                break
            self._compare(rows, columns, values, row, column)

    def _compare(
        self, rows: slice, columns: slice, values: NDArray[Any], row: np.intp, column: np.intp
    ) -> None:
        """Take a pixel of a tile for the peak if it is brighter than what was, light by light."""
        brightness = np.nan_to_num(
            (self._radiance(values[:, row, column]) * self._per_radiance).sum(axis=-1), nan=-np.inf
        )
        light = int(brightness.argmax())
        if brightness[light] > self._brightest:
            self._brightest = float(brightness[light])
            self.place = (rows.start + int(row), columns.start + int(column), light)
            self.values = values[:, row : row + 1, column].copy()

    def _radiance(self, values: NDArray[Any]) -> NDArray[np.float32]:
        radiance: NDArray[np.float32] = values.astype(np.float32) * self._scale + self._offset
        return radiance
