"""One array of a published store, made chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.store.published import SHARD, packed_document

Codes = NDArray[np.unsignedinteger]


@dataclass(frozen=True)
class PackedArray:
    """An array of a published store.

    Parameters
    ----------
    shape, chunk : tuple of int
    dims : tuple of str
    spatial : int
        The first of the two axes y and x.
    read : callable
        Takes the number of a chunk along each axis and returns its codes, fewer where the array ends.
    dtype : str
        Of the codes: ``uint16`` or ``uint8``.
    """

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    dims: tuple[str, ...]
    spatial: int
    read: Callable[[tuple[int, ...]], Codes]
    dtype: str = "uint16"

    @property
    def grid(self) -> tuple[int, ...]:
        """How many chunks there are along each axis."""
        return tuple(-(-length // size) for length, size in zip(self.shape, self.chunk, strict=True))

    @property
    def shard(self) -> tuple[int, ...]:
        """The shape of its shards: larger along y and x."""
        sizes = list(self.chunk)
        for axis in (self.spatial, self.spatial + 1):
            # No larger than the picture needs: the index lists every chunk of a shard.
            sizes[axis] = min(SHARD, self.grid[axis] * self.chunk[axis])
        return tuple(sizes)

    def numbers(self) -> Iterator[tuple[int, ...]]:
        """Yield the number of each chunk."""
        yield from product(*(range(count) for count in self.grid))

    def document(self, *, shards: bool) -> dict[str, Any]:
        """Return the Zarr metadata of the array."""
        return packed_document(self.shape, self.chunk, self.dims, self.dtype, self.shard if shards else None)


def pixels_of(number: int, length: int, size: int) -> slice:
    """Return the pixels of a chunk of `size` along an axis of `length`."""
    return slice(number * size, min((number + 1) * size, length))
