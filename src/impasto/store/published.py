"""Published stores: packed parameters for the web, and how they are read again.

docs/store.md, section "Published stores", specifies the layout.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem, StoreError
from impasto.geometry import Camera
from impasto.store.files import reading
from impasto.store.fits import Fit, Maps
from impasto.store.hierarchy import Attributes, lost_pieces, open_array, read_group

if TYPE_CHECKING:
    import zarr

PUBLISHED_SCHEMA = 1
PUBLISHED_CHUNK = 512
PHOTOGRAPH_CHUNK = 256
SHARD = 4096

_LARGEST = 65535
_NONE = 2**64 - 1  # what the index of a shard says of a chunk that is not there
_LOG_FLOOR = -20.0  # 1e-6 to 1e6: wider than any parameter's bounds
_LOG_SPAN = 40.0
_LOG_STEP = _LOG_SPAN / (_LARGEST - 2)
# Residuals and standard deviations, of which nobody reads more than two digits, take a quarter of the room.
_COARSE_STEP = 64 * _LOG_STEP
_AGAIN = "Publish the painting again"

QUANTISATION = {
    "log": 2 ** (_LOG_STEP / 2) - 1,
    "log_coarse": 2 ** (_COARSE_STEP / 2) - 1,
    "normal": 1 / (_LARGEST - 1),
}
"""Largest errors of what is published: relative, of parameters and of residuals and standard deviations;
absolute, of a normal's components x and y."""

Transfer = Literal["linear", "log"]


@dataclass(frozen=True)
class Parameter:
    """One column of a packed array.

    Code 0 says that there is no value. By the transfer ``linear``, a value is offset + scale · code; by
    ``log`` it is 2^(offset + scale · code), and code 1 is 0.

    Parameters
    ----------
    name : str
        The map it comes from, as the fit names it.
    component : int
        Which component of that map.
    transfer : {'linear', 'log'}
    scale, offset : float
    units, long_name : str
    """

    name: str
    component: int
    transfer: Transfer
    scale: float
    offset: float
    units: str
    long_name: str

    def encode(self, values: NDArray[np.floating]) -> NDArray[np.uint16]:
        """Return the codes of values; what lies outside of the range becomes its end, a NaN 0."""
        wide = np.asarray(values, np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.transfer == "log":
                codes = np.rint((np.log2(wide) - self.offset) / self.scale)
                codes = np.where(codes >= 2, codes, 1)  # a negative value's logarithm is NaN
            else:
                codes = np.maximum(np.rint((wide - self.offset) / self.scale), 1)
            codes = np.where(np.isnan(wide), 0, np.minimum(codes, _LARGEST))
        return codes.astype(np.uint16)

    def decode(self, codes: NDArray[np.uint16]) -> NDArray[np.float32]:
        """Return the values of codes, float32, NaN where there is none."""
        values = self.offset + self.scale * codes.astype(np.float64)
        if self.transfer == "log":
            values = np.where(codes == 1, 0.0, np.exp2(values))
        return np.where(codes == 0, np.nan, values).astype(np.float32)


def linear(name: str, component: int, low: float, high: float, units: str, long_name: str) -> Parameter:
    """Return a column that spans `low` to `high` evenly."""
    scale = (high - low) / (_LARGEST - 1)
    return Parameter(name, component, "linear", scale, low - scale, units, long_name)


def logarithmic(name: str, component: int, units: str, long_name: str, *, coarse: bool = False) -> Parameter:
    """Return a column for what is never negative, from 1e-6 to 1e6 with the same relative error."""
    step = _COARSE_STEP if coarse else _LOG_STEP
    return Parameter(name, component, "log", step, _LOG_FLOOR - 2 * step, units, long_name)


def parameter_columns(fit: Fit, maps: Sequence[str]) -> list[Parameter]:
    """Return the columns for maps of a fit, in their order.

    A unit normal is published by its x and y: a surface element that the camera sees has z > 0.
    """
    columns = []
    for name in maps:
        attributes, size = fit.map_attributes(name)
        units, long_name = attributes.get("units", "1"), attributes.get("long_name", name)
        if name == "normal":
            columns += [
                linear(name, i, -1.0, 1.0, units, f"{long_name}, {axis}") for i, axis in enumerate("xy")
            ]
        elif name == "view_tilt":
            columns.append(linear(name, 0, -math.pi, math.pi, units, long_name))
        elif name == "correlation":  # the only shape parameter that may be negative
            columns.append(linear(name, 0, -1.0, 1.0, units, long_name))
        elif name == "status":
            columns.append(Parameter(name, 0, "linear", 1.0, -1.0, units, long_name))
        else:
            coarse = name.endswith("_sd") or name in ("residual_rms", "chi2_reduced")
            columns += [logarithmic(name, i, units, long_name, coarse=coarse) for i in range(size)]
    return columns


def pack(maps: Maps, columns: Sequence[Parameter]) -> NDArray[np.uint16]:
    """Return the packed array (rows, columns, parameter) of maps of a tile."""
    height, width = next(iter(maps.values())).shape[:2]
    packed = np.empty((height, width, len(columns)), np.uint16)
    for index, column in enumerate(columns):
        values = maps[column.name]
        values = values if values.ndim == 2 else values[..., column.component]
        if column.name == "normal":
            behind = maps["normal"][..., 2] <= 0
            values = np.where(behind, np.nan, values)
        packed[..., index] = column.encode(values)
    return packed


def unpack(packed: NDArray[np.uint16], columns: Sequence[Parameter]) -> Maps:
    """Return the maps (rows, columns[, k]) of a packed tile."""
    parts: dict[str, list[NDArray[np.float32]]] = {}
    for index, column in enumerate(columns):
        parts.setdefault(column.name, []).append(column.decode(packed[..., index]))
    maps: Maps = {}
    for name, values in parts.items():
        if name == "normal":
            x, y = (value.astype(np.float64) for value in values)
            # Rounding may leave the unit circle.
            z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
            maps[name] = np.stack([x, y, z], axis=-1).astype(np.float32)
        else:
            maps[name] = values[0] if len(values) == 1 and name not in _COLOURS else np.stack(values, axis=-1)
    return maps


_COLOURS = ("diffuse", "ambient", "diffuse_sd", "ambient_sd")


def array_document(
    shape: Sequence[int], chunk: Sequence[int], dims: Sequence[str], shard: Sequence[int] | None
) -> dict[str, Any]:
    """Return the Zarr metadata of a packed array, uint16 with the fill value 0 for "no value"."""
    little_endian = {"name": "bytes", "configuration": {"endian": "little"}}
    # Browsers decode gzip themselves, and check its CRC.
    codecs: list[dict[str, Any]] = [little_endian, {"name": "gzip", "configuration": {"level": 6}}]
    if shard:
        sharding = {
            "chunk_shape": list(chunk),
            "codecs": codecs,
            "index_codecs": [little_endian, {"name": "crc32c"}],
            "index_location": "end",
        }
        codecs = [{"name": "sharding_indexed", "configuration": sharding}]
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(shape),
        "data_type": "uint16",
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(shard or chunk)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0,
        "codecs": codecs,
        "attributes": {},
        "dimension_names": list(dims),
        "storage_transformers": [],
    }


def encode_chunk(values: NDArray[np.uint16], shape: Sequence[int], level: int) -> bytes:
    """Return a chunk of `shape` as it lies on disk, filled up with 0 where `values` end earlier.

    `level` is how hard gzip tries; readers do not need to know it.
    """
    if values.shape != tuple(shape):
        chunk = np.zeros(shape, "<u2")
        chunk[tuple(slice(length) for length in values.shape)] = values
    else:
        chunk = np.ascontiguousarray(values, "<u2")
    return gzip.compress(chunk.tobytes(), compresslevel=level, mtime=0)


def encode_shard(grid: Sequence[int], chunks: Iterable[tuple[tuple[int, ...], bytes]]) -> bytes:
    """Return a shard of `grid` chunks, of which some may be absent, by their place in it."""
    import google_crc32c

    index = np.full((*grid, 2), _NONE, "<u8")
    data = bytearray()
    for place, chunk in chunks:
        index[place] = len(data), len(chunk)
        data += chunk
    data += index.tobytes()
    checksum: int = google_crc32c.value(index.tobytes())
    return bytes(data) + checksum.to_bytes(4, "little")


@dataclass(frozen=True)
class PublishedFit(Fit):
    """The parameters of a model in a published store, decoded when they are read."""

    @cached_property
    def _columns(self) -> list[Parameter]:
        return [Parameter(**column) for column in self.attributes["parameters"]]

    @cached_property
    def _packed(self) -> zarr.Array[Any]:
        return open_array(self.store, self.group)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the maps."""
        return tuple(dict.fromkeys(column.name for column in self._columns))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width, _ = self._packed.shape
        return height, width

    def read(self, rows: slice, columns: slice, names: Iterable[str] | None = None) -> Maps:
        """Return maps of a tile; see `Fit.read`."""
        if lost_pieces(self.store, self.group, self._packed, rows, columns):
            raise StoreError(Problem(f"{self.store}: {self.group}", "has lost a part of its pixels", _AGAIN))
        with reading(self.store, self.group, _AGAIN):
            maps = unpack(np.asarray(self._packed[rows, columns]), self._columns)
        return maps if names is None else {name: maps[name] for name in names}


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
        return Camera(**self.attributes["camera"])

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
        If it is from a newer version, or does not hold the model.
    """
    store = Path(store)
    attributes: Mapping[str, Any] = read_group(store) or {}
    schema = attributes.get("impasto_published")
    if not isinstance(schema, int) or schema > PUBLISHED_SCHEMA:
        what = f"is published with schema {schema}, and this version knows schemas up to {PUBLISHED_SCHEMA}"
        raise StoreError(Problem(str(store), what, "Use a newer version of impasto"))
    models = {entry["name"]: entry for entry in attributes["models"]}
    if model not in models:
        what = f"has no model {model}; it has {', '.join(models) or 'none'}"
        raise StoreError(Problem(str(store), what, "Choose one of these, or publish the painting again"))
    fit = PublishedFit(store, f"models/{model}/0/parameters", dict(models[model]))
    return fit, PublishedStack(dict(attributes), fit.shape)


def column_attributes(columns: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Return columns as attributes of a store."""
    return [asdict(column) for column in columns]
