"""Stream a stack through a procedure: read ahead, compute, and write behind, all at the same time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.fit.procedure import Procedure
from impasto.store import STACK_CHUNK, Maps, Stack, Unit

# A tile of the stack, all lights. With one tile read ahead, a few fitted ones waiting, and a unit of maps per
# level, the whole process stays under 1 GB, whatever the size and number of the photographs. Not an option,
# because the result must not depend on it.
_TILE_BYTES = 64 << 20

# Fitted tiles that may wait while a unit is written.
_TILES_WAITING = 3


def fit_units(
    stack: Stack,
    procedure: Procedure,
    units: Sequence[Unit],
    write: Callable[[Unit, Maps], None],
    advance: Callable[[int], None],
) -> None:
    """Fit units and hand them on to be written.

    The calling thread computes (the core has its own threads), one thread reads the next tile, one puts the
    last tiles together and writes their units. Ctrl-C ends after the tile and the unit under way.

    Parameters
    ----------
    stack : Stack
    procedure : Procedure
    units : sequence of Unit
        Those that have to be fitted.
    write : callable
        Called with each unit and its maps, ndarrays of shape (rows, columns[, k]), in another thread.
    advance : callable
        Called with the number of pixels just fitted.

    Raises
    ------
    StoreError
        If the stack is damaged or the disk is full.
    """
    maps: Maps = {}

    def put(before: Future[None] | None, unit: Unit, rows: slice, columns: slice, fitted: Maps) -> None:
        if before is not None:
            before.result()  # nothing is written after something that could not be
        if not maps:
            maps.update(
                {map.name: np.empty(map.shape(unit.height, unit.width), map.dtype) for map in procedure.maps}
            )
        inside = (_shifted(rows, unit.rows), _shifted(columns, unit.columns))
        for name, values in maps.items():
            target = values[inside]
            target[...] = fitted[name].reshape(target.shape)
        if (rows.stop, columns.stop) == (unit.rows.stop, unit.columns.stop):
            write(unit, maps)
            maps.clear()

    with (
        closing(read_tiles(stack, procedure.lights, units)) as tiles,
        ThreadPoolExecutor(1, thread_name_prefix="write") as writer,
    ):
        waiting: deque[Future[None]] = deque()
        last: Future[None] | None = None
        for unit, rows, columns, radiance in tiles:
            fitted = procedure.fit(radiance, rows, columns)
            if len(waiting) == _TILES_WAITING:
                waiting.popleft().result()
            last = writer.submit(put, last, unit, rows, columns, fitted)
            waiting.append(last)
            advance(radiance.shape[1] * radiance.shape[2])
        if last is not None:
            last.result()


def read_tiles(
    stack: Stack, lights: Sequence[int] | None, units: Sequence[Unit]
) -> Generator[tuple[Unit, slice, slice, NDArray[Any]]]:
    """Yield the tiles of units while the next is being read.

    Parameters
    ----------
    stack : Stack
    lights : sequence of int or None
        Which photographs; None for all.
    units : sequence of Unit

    Yields
    ------
    unit : Unit
    rows, columns : slice
        Where the tile lies.
    radiance : ndarray of shape (L, rows, columns, C), uint16 or float32
        Values as stored; valid until the next tile.

    Raises
    ------
    StoreError
        If the stack is damaged.
    """
    all_lights, _, _, channels = stack.shape
    samples = (all_lights if lights is None else len(lights)) * channels
    height = _tile_rows(samples * stack.dtype.itemsize)
    tiles = [(unit, *place) for unit in units for place in unit.tiles(height, STACK_CHUNK)]
    buffers = [np.empty(samples * height * STACK_CHUNK, stack.dtype) for _ in range(2)]

    def read(number: int) -> NDArray[Any]:
        _, rows, columns = tiles[number]
        return stack.read(rows, columns, lights, buffers[number % 2])

    with ThreadPoolExecutor(1, thread_name_prefix="read") as reader:
        coming = reader.submit(read, 0) if tiles else None
        for number, tile in enumerate(tiles):
            assert coming is not None
            values = coming.result()
            coming = reader.submit(read, number + 1) if number + 1 < len(tiles) else None
            yield (*tile, values)


def _tile_rows(pixel_bytes: int) -> int:
    """Return how many rows of a chunk's width make a tile: the whole chunk, or less where lights are many."""
    rows = STACK_CHUNK
    while rows > 32 and pixel_bytes * rows * STACK_CHUNK > _TILE_BYTES:
        rows //= 2
    return rows


def _shifted(pixels: slice, origin: slice) -> slice:
    return slice(pixels.start - origin.start, pixels.stop - origin.start)
