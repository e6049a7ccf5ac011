"""Published stores: their metadata and chunks, and how they are read again.

docs/store.md, section "Published stores", specifies the layout.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem, StoreError, raise_problems
from impasto.geometry import Camera
from impasto.store.array_reader import ArrayReader
from impasto.store.arrays import array_document
from impasto.store.attributes import attribute_problems, published_kind
from impasto.store.files import reading
from impasto.store.fits import Fit, Maps
from impasto.store.hierarchy import Attributes, array_problems, open_array, read_group
from impasto.store.layout import RESIDUAL
from impasto.store.packing import Parameter, unpack

PUBLISHED_SCHEMA = 1
PUBLISHED_CHUNK = 512
PHOTOGRAPH_CHUNK = 256
SHARD = 4096

_AGAIN = "Publish the painting again"


def packed_document(
    shape: Sequence[int],
    chunk: Sequence[int],
    dims: Sequence[str],
    dtype: str,
    shard: Sequence[int] | None,
) -> dict[str, Any]:
    """Return the Zarr metadata of a packed array, ``uint16`` or ``uint8``; 0 says that there is no value."""
    # Browsers decode gzip themselves, and check its CRC.
    gzip = ("gzip", {"level": 6})
    return array_document(shape, chunk, dims, dtype, fill_value=0, compressor=gzip, shard=shard)


def encode_chunk(values: NDArray[np.unsignedinteger], shape: Sequence[int], dtype: str, level: int) -> bytes:
    """Return a chunk of `shape` as it lies on disk, filled up with 0 where `values` end earlier.

    `level` is how hard gzip tries; readers do not need to know it.
    """
    chunk = np.zeros(shape, np.dtype(dtype).newbyteorder("<"))
    chunk[tuple(slice(length) for length in values.shape)] = values
    return gzip.compress(chunk.tobytes(), compresslevel=level, mtime=0)


@dataclass(frozen=True)
class PublishedFit(Fit):
    """The parameters of a model in a published store, decoded when they are read."""

    @cached_property
    def _columns(self) -> list[Parameter]:
        names = [entry.name for entry in fields(Parameter)]
        return [Parameter(*(column[name] for name in names)) for column in self.attributes["parameters"]]

    @cached_property
    def _packed(self) -> ArrayReader:
        return open_array(self.store, self.group)

    @cached_property
    def _residual(self) -> ArrayReader:
        return open_array(self.store, self._residual_path)

    @property
    def _residual_path(self) -> str:
        return f"{self.group.rpartition('/')[0]}/{RESIDUAL}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the maps."""
        residual = (RESIDUAL,) if self.attributes.get(RESIDUAL) else ()
        return (*dict.fromkeys(column.name for column in self._columns), *residual)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width, _ = self._packed.shape
        return height, width

    def problems(self, size: Sequence[int]) -> list[Problem]:
        """Return what is wrong with the arrays of a painting of that height and width."""
        packed = self._packed
        problems = array_problems(self.store, self.group, packed, (*size, packed.shape[-1]), "uint16", _AGAIN)
        if term := self.attributes.get(RESIDUAL):
            shape = (*size, term["components"])
            problems += array_problems(
                self.store, self._residual_path, self._residual, shape, "uint8", _AGAIN
            )
        return problems

    def read(self, rows: slice, columns: slice, names: Iterable[str] | None = None) -> Maps:
        """Return maps of a tile; see `Fit.read`. The codes of a residual term are uint8."""
        wanted = self.names if names is None else tuple(names)
        stored, missing = self._packed.shape[2], sorted({*wanted} - {*self.names})
        if len(self._columns) != stored or missing:
            there = f"{len(self._columns)} parameters ({', '.join(column.name for column in self._columns)})"
            expected = f"the {stored} that are stored" + f", with {', '.join(missing)}" * bool(missing)
            what = f"the attribute models has {there}, expected {expected}"
            raise StoreError(Problem(f"{self.store}: zarr.json", what, _AGAIN))
        maps = unpack(self._codes(self.group, self._packed, rows, columns), self._columns)
        if RESIDUAL in wanted:
            maps[RESIDUAL] = self._codes(self._residual_path, self._residual, rows, columns)
        return {name: maps[name] for name in wanted}

    def _codes(self, path: str, array: ArrayReader, rows: slice, columns: slice) -> NDArray[Any]:
        if array.lost(rows, columns):
            raise StoreError(Problem(f"{self.store}: {path}", "has lost a part of its pixels", _AGAIN))
        with reading(self.store, path, _AGAIN):
            return array.read(rows, columns)


@dataclass(frozen=True)
class PublishedStack:
    """What a published store says about the photographs it was made from, as `Stack` does."""

    attributes: Attributes
    size: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Lengths of (light, y, x, channel), no lights."""
        return 0, *self.size, len(self.attributes["light_rgb"])

    @property
    def camera(self) -> Camera:
        """Where the camera stands."""
        camera = self.attributes["camera"]
        return Camera(camera["view_direction"], camera["distance_mm"], camera["mm_per_px"])

    @property
    def light_rgb(self) -> NDArray[np.float64]:
        """Colour of the light in the camera's own space, shape (C,)."""
        return np.array(self.attributes["light_rgb"], np.float64)


def is_published(store: str | Path) -> bool:
    """Return whether there is a published store at `store`."""
    attributes = read_group(Path(store))
    return attributes is not None and "impasto_published" in attributes


def open_published(store: str | Path, model: str) -> tuple[PublishedFit, PublishedStack]:
    """Open one model of a published store.

    Raises
    ------
    StoreError
        If it is from a newer version, is damaged, or does not hold the model.
    """
    store = Path(store)
    attributes: Attributes = read_group(store) or {}
    schema = attributes.get("impasto_published")
    if not isinstance(schema, int) or schema > PUBLISHED_SCHEMA:
        what = f"is published with schema {schema}, and this version knows schemas up to {PUBLISHED_SCHEMA}"
        raise StoreError(Problem(str(store), what, "Use a newer version of impasto"))
    raise_problems(StoreError, attribute_problems(store, "", attributes, published_kind(attributes), _AGAIN))
    models = {entry["name"]: entry for entry in attributes["models"]}
    if model not in models:
        what = f"has no model {model}; it has {', '.join(models) or 'none'}"
        raise StoreError(Problem(str(store), what, "Choose one of these, or publish the painting again"))
    fit = PublishedFit(store, f"models/{model}/0/parameters", dict(models[model]))
    raise_problems(StoreError, fit.problems(attributes["size"]))
    return fit, PublishedStack(dict(attributes), fit.shape)
