"""Shards: chunks that lie in one file with an index, by Zarr's codec ``sharding_indexed``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from impasto.store.files import whole_file

# What the index says, as offset and as size, about a chunk that is not there.
_NONE = 2**64 - 1

Place = tuple[int, ...]


class Shard:
    """A shard that is being written.

    Parameters
    ----------
    file : binary file
        Where it begins.
    grid : sequence of int
        How many chunks it has along each axis.
    """

    def __init__(self, file: BinaryIO, grid: Sequence[int]) -> None:
        self._file = file
        self._index = np.full((*grid, 2), _NONE, "<u8")
        self._end = 0

    def put(self, place: Place, chunk: bytes | memoryview) -> None:
        """Append a chunk, by its place in the grid."""
        self._index[place] = self._end, len(chunk)
        self._end += self._file.write(chunk)

    def finish(self) -> None:
        """Append the index."""
        index = self._index.tobytes()
        self._file.write(index)
        self._file.write(_checksum(index))


@contextmanager
def new_shard(path: Path, grid: Sequence[int]) -> Iterator[Shard]:
    """Yield a shard to put chunks in, which takes the place of what is at `path` if the block ends well.

    Raises
    ------
    OSError
        If the disk is full or refuses.
    """
    with whole_file(path) as file:
        shard = Shard(file, grid)
        yield shard
        shard.finish()


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


def chunk_in(file: int, index: NDArray[np.uint64], place: Place) -> bytes:
    """Return the bytes of a chunk of an open shard that lies inside of the array: impasto writes every one.

    Raises
    ------
    ValueError
        If the shard lacks the chunk, or the index says that it lies beyond the end of the file.
    """
    offset, size = index[place].tolist()
    if offset == _NONE:
        raise ValueError(f"a shard lacks its chunk {', '.join(map(str, place))}")
    if offset + size > (end := os.fstat(file).st_size):
        raise ValueError(f"a chunk of {size} bytes at byte {offset}, and the file has {end}")
    return os.pread(file, size, offset)


def _checksum(data: bytes) -> bytes:
    import google_crc32c

    return int(google_crc32c.value(data)).to_bytes(4, "little")
