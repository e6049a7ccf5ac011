"""Shards: chunks that lie in one file with an index, by Zarr's codec ``sharding_indexed``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from impasto.store.files import whole_file

# What the index says, as offset and as size, about a chunk that is not there.
_NONE = 2**64 - 1

Place = tuple[int, ...]
Chunks = Iterable[tuple[Place, bytes]]


def write_shard(path: Path, grid: Sequence[int], chunks: Chunks) -> None:
    """Write a shard, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    grid : sequence of int
        How many chunks a shard has along each axis.
    chunks : iterable
        Place in the grid and bytes of each chunk that is there; they lie in the file in this order.

    Raises
    ------
    OSError
        If the disk is full or refuses.
    """
    with whole_file(path) as file:
        put_shard(file, grid, chunks)


def put_shard(file: BinaryIO, grid: Sequence[int], chunks: Chunks) -> None:
    """Put a shard into an open file; see `write_shard`."""
    index = np.full((*grid, 2), _NONE, "<u8")
    end = 0
    for place, chunk in chunks:
        index[place] = end, len(chunk)
        end += file.write(chunk)
    file.write(index.tobytes())
    file.write(_checksum(index.tobytes()))


def read_index(file: int, grid: Sequence[int]) -> NDArray[np.uint64]:
    """Return the index of a shard, open by its descriptor, as offset and size of each chunk, (*grid, 2).

    Raises
    ------
    ValueError
        If it is damaged or cut off.
    """
    size = 16 * math.prod(grid)
    data = os.pread(file, size + 4, max(0, os.fstat(file).st_size - size - 4))
    if len(data) < size + 4 or _checksum(data[:size]) != data[size:]:
        raise ValueError("the index of its chunks does not match its checksum")
    return np.frombuffer(data, "<u8", 2 * math.prod(grid)).reshape(*grid, 2)


def chunk_in(file: int, index: NDArray[np.uint64], place: Place) -> bytes | None:
    """Return the bytes of a chunk of an open shard, None where it has none."""
    offset, size = index[place].tolist()
    return None if offset == _NONE else os.pread(file, size, offset)


def _checksum(data: bytes) -> bytes:
    import google_crc32c

    return int(google_crc32c.value(data)).to_bytes(4, "little")
