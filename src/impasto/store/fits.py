"""The fits of a store and their coarser levels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem, StoreError, raise_problems
from impasto.store.array_reader import ArrayReader
from impasto.store.arrays import array_document
from impasto.store.attributes import attribute_problems, fit_kind
from impasto.store.chunks import encode_chunks
from impasto.store.files import DAMAGE, reading, writing
from impasto.store.hierarchy import (
    Attributes,
    array_problems,
    coarser_group,
    fit_group,
    has_array,
    open_array,
    read_group,
    remove,
    source_problems,
    thinned_shape,
    write_array_metadata,
    write_group,
)
from impasto.store.layout import (
    BLOCK,
    FITS,
    INNER_CHUNK,
    PYRAMIDS,
    RESIDUAL,
    UNIT,
    ZSTD,
    Map,
    Tile,
    Unit,
    status_counts,
    unit_at,
    units,
)
from impasto.store.shards import Shard, new_shard

Maps = dict[str, NDArray[Any]]

_AGAIN = "Run impasto fit with --overwrite to compute it anew"

# Maps that are encoded and written at a time.
_WRITERS = 2

# Chunks in a shard, down and across.
_GRID = (UNIT // INNER_CHUNK, UNIT // INNER_CHUNK)


class MapsWriter:
    """Writes the maps of a fit, or of one of its coarser levels, unit by unit.

    Every map of a unit is one shard, which appears whole when the unit is complete; ``status`` is the last,
    so a unit counts as whole if and only if its status can be read.

    Parameters
    ----------
    store : Path
    group : str
        Path of the group.
    maps : tuple of Map
    height, width : int
    attributes : mapping
        Attributes of the group, without ``complete``.
    """

    def __init__(
        self,
        store: Path,
        group: str,
        maps: tuple[Map, ...],
        height: int,
        width: int,
        attributes: Mapping[str, Any],
    ) -> None:
        self.store = store
        self.group = group
        self.maps = maps
        self.height = height
        self.width = width
        self._attributes = dict(attributes)
        self._open: _OpenUnit | None = None
        parent = group.rpartition("/")[0]
        while parent and read_group(store / parent) is None:
            write_group(store, parent, {})
            parent = parent.rpartition("/")[0]
        if read_group(store / group) is None:
            write_group(store, group, {**self._attributes, "complete": False})
        for map in maps:
            if not has_array(store, f"{group}/{map.name}"):
                write_array_metadata(store, f"{group}/{map.name}", _document(map, height, width))

    @cached_property
    def _status(self) -> ArrayReader:
        return open_array(self.store, f"{self.group}/status")

    def shard(self, map: Map, unit: Unit) -> Path:
        """Return the file of one map of a unit."""
        last = () if map.axis is None else ("0",)
        return self.store.joinpath(self.group, map.name, "c", str(unit.row), str(unit.column), *last)

    def is_whole(self, unit: Unit) -> bool:
        """Return whether a unit was written to its end."""
        status = next(map for map in self.maps if map.name == "status")
        if not self.shard(status, unit).is_file():
            return False
        try:
            self._status.read(unit.rows, unit.columns)
        except DAMAGE:  # as good as not there
            return False
        return True

    def unfinished(self) -> list[Unit]:
        """Return the units that still have to be written."""
        return [unit for unit in units(self.height, self.width) if not self.is_whole(unit)]

    def write(self, tile: Tile, values: Mapping[str, NDArray[Any]]) -> None:
        """Write a block of a unit, or a whole unit; a unit counts once all of its blocks are written.

        The blocks of a unit come one after the other.

        Parameters
        ----------
        tile : Tile
        values : mapping of str to ndarray of shape (rows, columns[, k])
            One entry per map.

        Raises
        ------
        StoreError
            If the disk is full or refuses.
        """
        unit = unit_at(tile.rows.start // UNIT, tile.columns.start // UNIT, self.height, self.width)
        for block in tile.tiles(BLOCK, BLOCK):
            inside = block.within(tile)
            self._write_block(unit, block, {map.name: values[map.name][inside] for map in self.maps})

    def _write_block(self, unit: Unit, block: Tile, values: Mapping[str, NDArray[Any]]) -> None:
        if self._open is None or self._open.unit != unit:
            self.close()
            self._open = _OpenUnit(self, unit)
        try:
            self._open.write(block, values)
        except BaseException:
            self.close()
            raise
        if self._open.pixels_missing == 0:
            self._open = None

    def close(self) -> None:
        """Drop the blocks of a unit that was not written to its end."""
        if self._open is not None:
            self._open.discard()
            self._open = None

    def status_counts(self) -> NDArray[np.int64]:
        """Return how many pixels have each status, as an ndarray of shape (256,), int64."""
        counts = np.zeros(256, np.int64)
        for unit in units(self.height, self.width):
            counts += status_counts(self._status.read(unit.rows, unit.columns))
        return counts

    def finish(self, more: Mapping[str, Any]) -> None:
        """Declare the group complete, and add attributes that were not known before."""
        self._attributes.update(more)
        write_group(self.store, self.group, {**self._attributes, "complete": True})


class _OpenUnit:
    """A unit that is being written: its shards, under names that do not count."""

    def __init__(self, writer: MapsWriter, unit: Unit) -> None:
        self.unit = unit
        self.pixels_missing = unit.pixels
        self._writer = writer
        self._files = ExitStack()
        self._shards: dict[str, Shard] = {}

    def write(self, block: Tile, values: Mapping[str, NDArray[Any]]) -> None:
        """Write the maps of a block; the last block completes the unit."""
        if not self._shards:
            self._begin()
        top, left = (part.start // INNER_CHUNK for part in block.within(self.unit))

        def put(map: Map) -> None:
            chunks = encode_chunks(np.asarray(values[map.name], map.dtype), INNER_CHUNK, map.fill_value)
            with self._writing(map):
                for (row, column), chunk in chunks:
                    self._shards[map.name].put((top + row, left + column), chunk)

        with ThreadPoolExecutor(_WRITERS, thread_name_prefix="map") as pool:
            list(pool.map(put, self._writer.maps))
        self.pixels_missing -= block.pixels
        if self.pixels_missing == 0:
            with self._writing():
                self._files.close()

    def _begin(self) -> None:
        # What is opened first is closed last, and forgotten first: status, by which a unit counts.
        for map in reversed(self._writer.maps):
            path = self._writer.shard(map, self.unit)
            with self._writing(map):
                path.unlink(missing_ok=True)
                self._shards[map.name] = self._files.enter_context(new_shard(path, _GRID))

    def _writing(self, map: Map | None = None) -> AbstractContextManager[None]:
        what = self._writer.group if map is None else f"{self._writer.group}/{map.name}"
        return writing(self._writer.store, what)

    def discard(self) -> None:
        """Remove what was written; that a full disk does not take the rest of it is no error any more."""
        with suppress(_Discarded, OSError), self._files:
            raise _Discarded


class _Discarded(Exception):
    """Makes shards go that were not written to their end."""


def _document(map: Map, height: int, width: int) -> dict[str, Any]:
    """Return the metadata of the array of a map, for an image of `height` x `width` pixels."""
    last = () if map.axis is None else (map.size,)
    return array_document(
        map.shape(height, width),
        (INNER_CHUNK, INNER_CHUNK, *last),
        map.dims,
        map.dtype,
        fill_value=map.fill_value,
        compressor=("zstd", ZSTD),
        shard=(UNIT, UNIT, *last),
        attributes={"long_name": map.long_name, "units": map.units},
    )


def fit_attributes(store: str | Path, model: str) -> Attributes | None:
    """Return the attributes of a fit, complete or not, or None if there is none.

    Raises
    ------
    StoreError
        If they are damaged.
    """
    attributes = read_group(Path(store) / fit_group(model))
    if attributes is not None:
        raise_problems(StoreError, fit_problems(Path(store), model, attributes))
    return attributes


def fit_problems(store: Path, model: str, attributes: Attributes) -> list[Problem]:
    """Return everything that is wrong with the attributes of a fit."""
    group = fit_group(model)
    path = f"{group}/diffuse"
    shape = open_array(store, path).shape if has_array(store, path) else ()
    channels = shape[2] if len(shape) == 3 else None
    return attribute_problems(store, group, attributes, fit_kind(model, attributes, channels), _AGAIN)


def remove_fit(store: Path, model: str) -> None:
    """Remove a fit and its coarser levels."""
    remove(store, fit_group(model), f"{PYRAMIDS}/{model}")


@dataclass(frozen=True)
class Fit:
    """A complete fit or one of its coarser levels, open for reading; pixels are read when asked for.

    Parameters
    ----------
    store : Path
    group : str
        Path of the group.
    attributes : dict
        The attributes of the group, as docs/store.md lists them.
    """

    store: Path
    group: str
    attributes: Attributes = field(repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the maps."""
        return tuple(sorted(path.name for path in (self.store / self.group).iterdir() if path.is_dir()))

    @cached_property
    def _arrays(self) -> dict[str, ArrayReader]:
        return {name: open_array(self.store, f"{self.group}/{name}") for name in self.names}

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.array("status").shape
        return height, width

    def array(self, name: str) -> ArrayReader:
        """Return the array of a map.

        Raises
        ------
        StoreError
            If it is not there.
        """
        if name not in self._arrays:
            raise StoreError(Problem(f"{self.store}: {self.group}", f"lacks the map {name}", _AGAIN))
        return self._arrays[name]

    def map_attributes(self, name: str) -> tuple[Attributes, int]:
        """Return the attributes of a map, and how many values it has per pixel."""
        array = self.array(name)
        return array.attributes, array.shape[2] if len(array.shape) > 2 else 1

    def read(self, rows: slice, columns: slice, names: Iterable[str] | None = None) -> Maps:
        """Return maps of a tile.

        Parameters
        ----------
        rows, columns : slice
            The tile.
        names : iterable of str, optional
            Which maps, all by default.

        Returns
        -------
        dict of str to ndarray of shape (rows, columns[, k])
            float32, NaN where a pixel has no value; ``status`` uint8.

        Raises
        ------
        StoreError
            If a map is damaged or lost.
        """
        tile = {}
        for name in self.names if names is None else names:
            path = f"{self.group}/{name}"
            array = self.array(name)
            if array.lost(rows, columns):
                raise StoreError(Problem(f"{self.store}: {path}", "has lost a part of its pixels", _AGAIN))
            with reading(self.store, path, _AGAIN):
                tile[name] = array.read(rows, columns)
        return tile


def open_fit(store: str | Path, model: str, level: int = 0) -> Fit:
    """Open a fit of a store.

    Parameters
    ----------
    store : path
    model : str
        Name of the model as `impasto.models` has it.
    level : int, optional
        0 for full size, 1 for half size, and so on.

    Raises
    ------
    StoreError
        If there is no store, it is from a newer version, or the fit or the level is missing, not finished or
        damaged.
    """
    store = Path(store)
    problems = source_problems(store)
    if problems:
        raise StoreError(problems)
    group = fit_group(model) if level == 0 else coarser_group(model, level)
    attributes = read_group(store / group)
    if attributes is None:
        there = ", ".join(fitted_models(store)) or "none"
        raise StoreError(
            Problem(
                where=f"{store}: {group}",
                what=f"there is no such fit; fits in this store: {there}",
                do=f"Make it with: impasto fit STORE --model {model}",
            )
        )
    if not attributes.get("complete"):
        raise StoreError(
            Problem(
                where=f"{store}: {group}",
                what="is not finished",
                do="Run the same impasto fit command again: it goes on from there",
            )
        )
    finest = attributes if level == 0 else read_group(store / fit_group(model)) or {}
    raise_problems(StoreError, fit_problems(store, model, finest))
    fit = Fit(store, group, attributes)
    raise_problems(StoreError, _map_problems(fit, finest, level))
    return fit


def _map_problems(fit: Fit, attributes: Attributes, level: int) -> Iterator[Problem]:
    """Yield which maps are missing, of another type, or of another size than the photographs."""
    channels, term = len(attributes["light_rgb"]), attributes.get(RESIDUAL)
    coloured = ("diffuse", "diffuse_sd", "ambient", "ambient_sd", "specular_rgb")
    lengths = {"normal": 3, **dict.fromkeys(coloured, channels)}
    needed = {"normal", "diffuse", "status"}
    if term is not None:
        lengths[RESIDUAL] = term["components"]
        needed.add(RESIDUAL)
    chosen = attributes.get("highlight_colour", {"used": attributes["options"].get("highlight_colour")})
    if chosen["used"] == "own" and channels > 1 and "specular" in fit.names:
        needed.add("specular_rgb")
    size = (thinned_shape(fit.store, 2**level) or fit.shape)[:2]
    for name in sorted(needed.union(fit.names)):
        array = fit.array(name)
        shape = (*size, *([lengths[name]] if name in lengths else array.shape[2:]))
        dtype = {"status": "uint8", RESIDUAL: "uint16"}.get(name, "float32")
        yield from array_problems(fit.store, f"{fit.group}/{name}", array, shape, dtype, _AGAIN)


def fitted_models(store: str | Path) -> list[str]:
    """Return the names of the models of which the store has a complete fit."""
    found = ((path.name, read_group(path)) for path in (Path(store) / FITS).glob("*"))
    return sorted(name for name, attributes in found if attributes and attributes.get("complete"))
