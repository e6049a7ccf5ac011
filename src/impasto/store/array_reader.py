"""Read the arrays of a store: chunks by zstd or gzip, each in a file of its own or several in a shard.

They are read here and not by zarr-python, which takes a fifteenth of a second to import and, with the fastest
codecs there are for it, twice the time for a tile of a stack. Of Zarr this knows what `arrays` describes.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.store.codecs import decompress, strings_decode, zstd_decode
from impasto.store.shards import Place, chunk_in, read_index

Region = tuple[slice, ...]

# How a chunk is made of values, and how it is compressed.
_ENCODINGS = {("bytes", "zstd"), ("bytes", "gzip"), ("vlen-utf8", "zstd"), ("vlen-utf8", "gzip")}

# Strings are names of files; more bytes for each, on average, are damage.
_STRING_BYTES = 1 << 16

# A hundred photographs of 10 Gpx, a file per chunk, take four million; to look for more would never end.
_MOST_FILES = 1 << 24


@dataclass(frozen=True)
class ArrayReader:
    """An array of a store, open for reading.

    Parameters
    ----------
    folder : Path
        Where its metadata and chunks lie.
    document : dict
        Its metadata, as `arrays.array_document` makes them.

    Raises
    ------
    ValueError, LookupError, TypeError
        If the metadata are of another kind, or damaged.
    """

    folder: Path
    document: Mapping[str, Any] = field(repr=False)

    def __post_init__(self) -> None:
        if self._encoding not in _ENCODINGS:
            names = ", ".join(self._encoding)
            raise ValueError(f"its chunks are encoded by {names}, expected bytes and zstd or gzip")
        if self.dtype.kind not in "Ofui":
            raise ValueError(f"its values are of type {self.dtype}, expected numbers or strings")
        cut = zip(self.shape, self._piece, self._chunk, strict=True)
        if any(length < 1 or chunk < 1 or piece % chunk for length, piece, chunk in cut):
            raise ValueError(
                f"its shape {self.shape}, files {self._piece} and chunks {self._chunk} do not match"
            )
        files = math.prod(-(-length // piece) for length, piece in zip(self.shape, self._piece, strict=True))
        if files > _MOST_FILES:
            raise ValueError(
                f"its shape {self.shape} takes {files:,} files, expected {_MOST_FILES:,} at most"
            )
        if missing := {"attributes", "fill_value"} - self.document.keys():
            raise ValueError(f"it has no {' and no '.join(sorted(missing))}")

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return _lengths(self.document["shape"])

    @cached_property
    def dtype(self) -> np.dtype:
        """Type of the values; object for strings."""
        name = self.document["data_type"]
        return np.dtype(object if name == "string" else name)

    @property
    def attributes(self) -> dict[str, Any]:
        """The array's own attributes."""
        return dict(self.document["attributes"])

    @cached_property
    def _piece(self) -> tuple[int, ...]:
        """Shape of what lies in one file."""
        return _lengths(self.document["chunk_grid"]["configuration"]["chunk_shape"])

    @cached_property
    def _sharding(self) -> Mapping[str, Any] | None:
        first = self.document["codecs"][0]
        return first["configuration"] if first["name"] == "sharding_indexed" else None

    @cached_property
    def _encoding(self) -> tuple[str, ...]:
        return tuple(codec["name"] for codec in (self._sharding or self.document)["codecs"])

    @cached_property
    def _zstd(self) -> bool:
        return self._encoding == ("bytes", "zstd")

    @cached_property
    def _chunk(self) -> tuple[int, ...]:
        """Shape of what is compressed together."""
        return _lengths(self._sharding["chunk_shape"]) if self._sharding else self._piece

    @cached_property
    def _grid(self) -> tuple[int, ...]:
        """Chunks in a file along each axis."""
        return tuple(piece // chunk for piece, chunk in zip(self._piece, self._chunk, strict=True))

    def lost(self, *slices: slice) -> list[Place]:
        """Return the files, by their number, that a selection needs and lacks: impasto writes every one.

        Parameters
        ----------
        *slices : slice
            The selection along the first axes; the others are taken whole.
        """
        numbers = (number for number, _ in _cells(self._region(slices), self._piece))
        return [number for number in numbers if not os.path.exists(self._file(number))]

    def read(self, *slices: slice, out: NDArray[Any] | None = None) -> NDArray[Any]:
        """Return the values of a selection, the fill value where there is no file (see `lost`).

        Parameters
        ----------
        *slices : slice
            The selection along the first axes; the others are taken whole.
        out : ndarray, optional
            Where to put them.

        Raises
        ------
        OSError, RuntimeError, ValueError
            If a chunk is damaged, which its checksum tells, or a file lacks one.
        """
        region = self._region(slices)
        values = np.empty([part.stop - part.start for part in region], self.dtype) if out is None else out
        for number, piece in _cells(region, self._piece):
            with self._opened(number) as load:
                for place, chunk in _cells(_common(region, piece), self._chunk):
                    common = _common(region, chunk)
                    data = load(tuple(at % count for at, count in zip(place, self._grid, strict=True)))
                    self._put(values[_within(common, region)], data, _within(common, chunk))
        return values

    def _region(self, slices: Sequence[slice]) -> Region:
        taken = [*slices, *(slice(None) for _ in self.shape[len(slices) :])]
        bounds = [part.indices(length)[:2] for part, length in zip(taken, self.shape, strict=True)]
        return tuple(slice(start, stop) for start, stop in bounds)

    def _file(self, number: Place) -> str:
        return f"{self.folder}/c/{'/'.join(map(str, number))}"

    @contextmanager
    def _opened(self, number: Place) -> Iterator[Callable[[Place], bytes | None]]:
        """Yield what returns the bytes of a chunk of a file, or None where there is none."""
        try:
            file = os.open(self._file(number), os.O_RDONLY)
        except FileNotFoundError:
            yield lambda _: None
            return
        try:
            if self._sharding is None:
                yield lambda _: os.pread(file, os.fstat(file).st_size, 0)
            else:
                index = read_index(file, self._grid)
                yield lambda place: chunk_in(file, index, place)
        finally:
            os.close(file)

    def _put(self, target: NDArray[Any], data: bytes | None, wanted: Region) -> None:
        """Put the wanted part of a chunk into `target`."""
        if data is None:
            fill_value = self.document["fill_value"]
            target[...] = np.nan if fill_value == "NaN" else fill_value
        elif self._zstd and target.shape == self._chunk and target.flags.c_contiguous:
            zstd_decode(data, target)
        else:
            target[...] = self._values(data)[wanted]

    def _values(self, data: bytes) -> NDArray[Any]:
        values, compressor = self._encoding
        count = math.prod(self._chunk)
        if values == "vlen-utf8":
            decoded = decompress(data, compressor, count * _STRING_BYTES)
            return np.array(strings_decode(bytes(decoded)), object).reshape(self._chunk)
        decoded = decompress(data, compressor, count * self.dtype.itemsize)
        return np.frombuffer(decoded, self.dtype.newbyteorder("<")).reshape(self._chunk)


def _lengths(numbers: Sequence[int]) -> tuple[int, ...]:
    return tuple(map(operator.index, numbers))


def _cells(region: Region, size: Sequence[int]) -> Iterator[tuple[Place, Region]]:
    """Yield number and extent of each cell of a grid that a region overlaps."""
    numbers = (
        range(part.start // step, -(-part.stop // step)) for part, step in zip(region, size, strict=True)
    )
    for number in product(*numbers):
        yield number, tuple(slice(at * step, (at + 1) * step) for at, step in zip(number, size, strict=True))


def _common(first: Region, second: Region) -> Region:
    return tuple(
        slice(max(a.start, b.start), min(a.stop, b.stop)) for a, b in zip(first, second, strict=True)
    )


def _within(part: Region, whole: Region) -> Region:
    return tuple(slice(a.start - b.start, a.stop - b.start) for a, b in zip(part, whole, strict=True))
