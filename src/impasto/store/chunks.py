"""Chunks of arrays as they lie on disk.

They are encoded here and not by zarr-python, which needs several times the time for the same bytes, nor by
zarrs, which puts the chunks of a shard in another order each time and leaves out those that hold the fill
value only. Zarr's version 3 and its codec ``zstd`` say what a chunk is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.store.codecs import zstd_encode
from impasto.store.layout import ZSTD


def encode_chunks(
    values: NDArray[Any], size: int, fill_value: float, zstd: Mapping[str, Any] = ZSTD
) -> Iterator[tuple[tuple[int, int], memoryview]]:
    """Cut pixels into chunks of `size` x `size` and yield each, by its row and column, as it lies on disk.

    Parameters
    ----------
    values : ndarray of shape (rows, columns[, k])
        Where it ends inside of a chunk, the chunk is filled up with `fill_value`.
    size : int
    fill_value : float
    zstd : mapping, optional
        Options of the compressor.
    """
    dtype = values.dtype.newbyteorder("<")
    for row, column in product(*(range(-(-length // size)) for length in values.shape[:2])):
        part = values[row * size : (row + 1) * size, column * size : (column + 1) * size]
        if part.shape[:2] == (size, size):
            chunk = np.ascontiguousarray(part, dtype)
        else:
            chunk = np.full((size, size, *values.shape[2:]), fill_value, dtype)
            chunk[: part.shape[0], : part.shape[1]] = part
        yield (row, column), zstd_encode(chunk, zstd["level"])
