"""Stream a stack through a procedure: read ahead, compute, and write behind, all at the same time."""

from __future__ import annotations

import mmap
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem, StoreError, raise_problems
from impasto.fit.procedure import Procedure
from impasto.store import STACK_CHUNK, Maps, Stack, Tile, Unit

# A tile of the stack, all lights. With one tile read ahead, a fitted one waiting, and a block of maps per
# level, the whole process stays under 1 GB, whatever the size and number of the photographs. Not an
# option, because the result must not depend on it.
_TILE_BYTES = 64 << 20

# Threads that share the reading of a tile, because nothing can be computed before the first.
_READERS = 2


def fit_units(
    stack: Stack,
    procedure: Procedure,
    units: Sequence[Unit],
    write: Callable[[Tile, Maps], None],
    advance: Callable[[int], None],
) -> None:
    """Fit units and hand on their blocks, one after the other, to be written.

    The calling thread computes (the core has its own threads), one thread reads the next tile, one puts the
    last tiles together and writes their blocks. Ctrl-C ends after the tile and the block under way.

    Parameters
    ----------
    stack : Stack
    procedure : Procedure
    units : sequence of Unit
        Those that have to be fitted.
    write : callable
        Called with each block and its maps, ndarrays of shape (rows, columns[, k]), in another thread.
    advance : callable
        Called with the number of pixels just fitted.

    Raises
    ------
    StoreError
        If the stack is damaged or the disk is full.
    """
    maps: Maps = {}

    def put(block: Tile, tile: Tile, fitted: Maps) -> None:
        size = block.height, block.width
        if tile == block:
            write(block, {map.name: fitted[map.name].reshape(map.shape(*size)) for map in procedure.maps})
            return
        if not maps:
            maps.update({map.name: np.empty(map.shape(*size), map.dtype) for map in procedure.maps})
        inside = tile.within(block)
        for name, values in maps.items():
            target = values[inside]
            target[...] = fitted[name].reshape(target.shape)
        if tile.rows.stop == block.rows.stop:
            write(block, maps)
            maps.clear()

    blocks = [block for unit in units for block in unit.blocks()]
    with (
        closing(read_tiles(stack, procedure.lights, blocks)) as tiles,
        ThreadPoolExecutor(1, thread_name_prefix="write") as writer,
    ):
        last: Future[None] | None = None
        for block, tile, radiance in tiles:
            fitted = procedure.fit(radiance, tile.rows, tile.columns)
            if last is not None:
                last.result()  # nothing is written after something that could not be
            last = writer.submit(put, block, tile, fitted)
            advance(tile.pixels)
        if last is not None:
            last.result()


def read_tiles(
    stack: Stack, lights: Sequence[int] | None, pieces: Sequence[Tile]
) -> Generator[tuple[Tile, Tile, NDArray[Any]]]:
    """Yield the tiles of pieces of a stack, one piece after the other, while the next is being read.

    Parameters
    ----------
    stack : Stack
    lights : sequence of int or None
        Which photographs; None for all.
    pieces : sequence of Tile
        Such as units, or their blocks.

    Yields
    ------
    piece, tile : Tile
    radiance : ndarray of shape (L, rows, columns, C), uint16 or float32
        Values as stored; valid until the next tile.

    Raises
    ------
    StoreError
        If the stack is damaged.
    """
    all_lights, _, _, channels = stack.shape
    numbers = np.arange(all_lights) if lights is None else np.asarray(lights)
    samples = len(numbers) * channels
    height = _tile_rows(samples * stack.dtype.itemsize)
    tiles = [(piece, tile) for piece in pieces for tile in piece.tiles(height, STACK_CHUNK)]
    buffers = [_buffer(samples * height * STACK_CHUNK, stack.dtype) for _ in range(2)]

    def read(number: int, pool: ThreadPoolExecutor) -> tuple[NDArray[Any], list[Future[Any]]]:
        _, tile = tiles[number]
        shape = (len(numbers), tile.height, tile.width, channels)
        values = buffers[number % 2][: samples * tile.pixels].reshape(shape)
        shares = zip(np.array_split(numbers, _READERS), np.array_split(values, _READERS), strict=True)
        return values, [
            pool.submit(stack.read, tile.rows, tile.columns, some, part.reshape(-1)) for some, part in shares
        ]

    with ThreadPoolExecutor(_READERS, thread_name_prefix="read") as pool:
        coming = read(0, pool) if tiles else None
        for number, (piece, tile) in enumerate(tiles):
            assert coming is not None
            values, parts = coming
            _wait(parts)
            coming = read(number + 1, pool) if number + 1 < len(tiles) else None
            yield piece, tile, values


def _wait(parts: Sequence[Future[Any]]) -> None:
    """Wait for the parts of a tile; raise what is wrong with all of them together."""
    problems: list[Problem] = []
    for part in parts:
        try:
            part.result()
        except StoreError as error:
            problems += error.problems
    raise_problems(StoreError, dict.fromkeys(problems))


def _tile_rows(pixel_bytes: int) -> int:
    """Return how many rows of a chunk's width make a tile: the whole chunk, or less where lights are many."""
    rows = STACK_CHUNK
    while rows > 32 and pixel_bytes * rows * STACK_CHUNK > _TILE_BYTES:
        rows //= 2
    return rows


def _buffer(size: int, dtype: np.dtype) -> NDArray[Any]:
    """Return an array of `size` values, on pages of 2 MB where there are any: all of it is filled at once."""
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        return np.empty(size, dtype)
    memory = mmap.mmap(-1, size * dtype.itemsize, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with suppress(OSError):  # a kernel without
        memory.madvise(mmap.MADV_HUGEPAGE)
    return np.frombuffer(memory, dtype)
