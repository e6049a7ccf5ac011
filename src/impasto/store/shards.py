"""Shards: chunks that lie in one file with an index, by Zarr's codec ``sharding_indexed``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from impasto.store.files import whole_file

# What the index says, as offset and as size, about a chunk that is not there.
_NONE = 2**64 - 1

Chunks = Iterable[tuple[tuple[int, ...], bytes]]


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
    import google_crc32c

    index = np.full((*grid, 2), _NONE, "<u8")
    end = 0
    for place, chunk in chunks:
        index[place] = end, len(chunk)
        end += file.write(chunk)
    file.write(index.tobytes())
    checksum: int = google_crc32c.value(index.tobytes())
    file.write(checksum.to_bytes(4, "little"))
