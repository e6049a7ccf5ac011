"""The photographs of a published store, kept to be compared with."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.fit.pyramid import halve
from impasto.geometry import Lights
from impasto.publish.arrays import Codes, PackedArray, pixels_of
from impasto.store import Stack, level_sizes
from impasto.store.packing import logarithmic
from impasto.store.published import PHOTOGRAPH_CHUNK


def spread(direction: NDArray[np.float64], count: int | None) -> list[int]:
    """Return which `count` directions lie furthest apart, each the furthest from those before, in order."""
    total = len(direction)
    if count is None or count >= total:
        return list(range(total))
    if count <= 0:
        return []
    chosen = [int(np.argmax(direction[:, 2]))]
    nearest = direction @ direction[chosen[0]]
    while len(chosen) < count:
        chosen.append(int(np.argmin(nearest)))
        nearest = np.maximum(nearest, direction @ direction[chosen[-1]])
    return sorted(chosen)


def photograph_arrays(
    stack: Stack, lights: Lights, kept: list[int]
) -> tuple[dict[str, PackedArray], dict[str, Any] | None]:
    """Return the arrays of some photographs, by their path, and the attribute that describes them.

    Parameters
    ----------
    stack : Stack
    lights : Lights
        Of the stack, as strong as they were.
    kept : list of int
        Which photographs.
    """
    if not kept:
        return {}, None
    channels = stack.shape[3]
    column = logarithmic("radiance", 0, "1", "relative radiance")
    sizes = [stack.shape[1:3], *level_sizes(*stack.shape[1:3])]
    tiles = _Tiles(stack, sizes)
    arrays = {}
    for level, (height, width) in enumerate(sizes):

        def read(number: tuple[int, ...], level: int = level) -> Codes:
            light, row, across, _ = number
            return column.encode(tiles(kept[light], level, row, across))[np.newaxis]

        arrays[f"photographs/{level}"] = PackedArray(
            (len(kept), height, width, channels),
            (1, PHOTOGRAPH_CHUNK, PHOTOGRAPH_CHUNK, channels),
            ("light", "y", "x", "channel"),
            1,
            read,
        )
    intensity = np.broadcast_to(lights.intensity, (len(lights), channels))
    near = [bool(np.isfinite(place).all()) for place in lights.position_mm]
    clip = [None if not np.isfinite(level) else level for level in stack.clip_level.tolist()]
    return arrays, {
        "transfer": column.transfer,
        "scale": column.scale,
        "offset": column.offset,
        "clip_level": clip,
        "lights": [
            {
                "name": lights.names[index],
                "direction": lights.direction[index].tolist(),
                "position_mm": lights.position_mm[index].tolist() if near[index] else None,
                "intensity": intensity[index].tolist(),
            }
            for index in kept
        ],
    }


class _Tiles:
    """Tiles of photographs at every level, each made of the four below it."""

    def __init__(self, stack: Stack, sizes: list[tuple[int, int]]) -> None:
        self._stack = stack
        self._sizes = sizes
        # A tile of one level and its neighbours are asked for one after the other.
        self._cached: Callable[..., NDArray[np.float32]] = lru_cache(maxsize=64)(self._make)

    def __call__(self, light: int, level: int, row: int, column: int) -> NDArray[np.float32]:
        return self._cached(light, level, row, column)

    def _make(self, light: int, level: int, row: int, column: int) -> NDArray[np.float32]:
        height, width = self._sizes[level]
        rows, columns = pixels_of(row, height, PHOTOGRAPH_CHUNK), pixels_of(column, width, PHOTOGRAPH_CHUNK)
        if level == 0:
            radiance: NDArray[np.float32] = self._stack.radiance(rows, columns, [light])[0]
            return radiance
        tile = np.empty(
            (rows.stop - rows.start, columns.stop - columns.start, self._stack.shape[3]), np.float32
        )
        half = PHOTOGRAPH_CHUNK // 2
        for down, right in product((0, 1), repeat=2):
            part = tile[down * half : (down + 1) * half, right * half : (right + 1) * half]
            if part.size:
                part[...] = halve(self(light, level - 1, 2 * row + down, 2 * column + right))
        return tile
