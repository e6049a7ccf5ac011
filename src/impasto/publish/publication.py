"""What a published store holds, made from a painting's store chunk by chunk.

`publish` writes all of it to files; `view` serves each piece when a browser asks for it.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.colour.camera import camera_colour
from impasto.colour.profiles import profile
from impasto.colour.rendition import Rendition
from impasto.errors import OptionError, Problem
from impasto.evaluate.gloss import PixelGloss
from impasto.evaluate.glossmeter import GLOSSMETERS
from impasto.fit.pyramid import halve
from impasto.models import MODELS, parse_model
from impasto.publish.height import integrate_normals
from impasto.store import (
    Fit,
    Stack,
    fitted_models,
    level_sizes,
    open_fit,
    open_stack,
    provenance,
)
from impasto.store.published import (
    PHOTOGRAPH_CHUNK,
    PUBLISHED_CHUNK,
    PUBLISHED_SCHEMA,
    QUANTISATION,
    SHARD,
    Parameter,
    array_document,
    column_attributes,
    encode_chunk,
    encode_shard,
    linear,
    logarithmic,
    pack,
    parameter_columns,
)

Codes = NDArray[np.uint16]

_FIT_ATTRIBUTES = (
    "model",
    "procedure",
    "index_of_refraction",
    "fresnel",
    "light_rgb",
    "light_rgb_source",
    "notes",
    "sample",
    "photographs",
    "pixels",
    "status_meaning",
)

_HEIGHT_PX = 2048
"""Longest side of a relief: its integral takes all of it at once."""

FAST, SMALL = 1, 6
"""How hard gzip tries: for somebody who waits for the chunk, and for a chunk that is kept."""


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
    """

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    dims: tuple[str, ...]
    spatial: int
    read: Callable[[tuple[int, ...]], Codes]

    @property
    def grid(self) -> tuple[int, ...]:
        """How many chunks there are along each axis."""
        return tuple(-(-length // size) for length, size in zip(self.shape, self.chunk, strict=True))

    def numbers(self) -> Iterator[tuple[int, ...]]:
        """Yield the number of each chunk."""
        yield from product(*(range(count) for count in self.grid))


class Publication:
    """The pieces of a published store.

    Parameters
    ----------
    store : Path
        A painting's store with at least one complete fit.
    models : sequence of str, optional
        Which fits, in the order in which they are offered; all by default.
    photographs : int, optional
        How many photographs to keep for comparison; all by default.
    title : str, optional
        Of the painting; by default, the store's name.

    Raises
    ------
    OptionError
        If there is no such model, or no fit to publish.
    StoreError
        If the store, its stack or a fit cannot be used.
    """

    def __init__(
        self,
        store: Path,
        *,
        models: Sequence[str] = (),
        photographs: int | None = None,
        title: str | None = None,
    ) -> None:
        stack = open_stack(store)
        names = [parse_model(name).name for name in models] or _by_usefulness(fitted_models(store))
        if not names:
            raise OptionError(
                Problem(str(store), "has no complete fit to show", f"Fit one: impasto fit {store}")
            )
        self.store = store
        self.size = (stack.shape[1], stack.shape[2])
        self.levels = 1 + len(level_sizes(*self.size))
        self.arrays: dict[str, PackedArray] = {}
        self.without_residual: list[str] = []
        entries = [self._add_model(name) for name in names]
        kept = _spread(stack.lights.direction, photographs)
        self.attributes: dict[str, Any] = {
            **provenance(),
            "impasto_published": PUBLISHED_SCHEMA,
            "title": title or store.name.removesuffix(".zarr"),
            "size": list(self.size),
            "levels": self.levels,
            "camera": stack.attributes["camera"],
            "camera_colour": stack.attributes.get("camera_colour"),
            "light_rgb": stack.light_rgb.tolist(),
            "white_reference": stack.absolute,
            "display": _display(stack),
            "quantisation": QUANTISATION,
            "models": entries,
            "photographs": self._add_photographs(stack, kept),
            "height": self._add_height(names[0]),
        }

    def documents(self, *, shards: bool = False) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the metadata of each group and array by its path, the root's ("") last.

        The root's holds a copy of all others, so that a browser asks once.
        """
        documents = {
            path: array_document(array.shape, array.chunk, array.dims, _shard(array) if shards else None)
            for path, array in self.arrays.items()
        }
        parents = {
            path.rsplit("/", depth)[0] for path in documents for depth in range(1, path.count("/") + 1)
        }
        groups = {
            path: {"zarr_format": 3, "node_type": "group", "attributes": {}} for path in sorted(parents)
        }
        everything = {**groups, **documents}
        yield from everything.items()
        yield (
            "",
            {
                "zarr_format": 3,
                "node_type": "group",
                "attributes": self.attributes,
                "consolidated_metadata": {"kind": "inline", "must_understand": False, "metadata": everything},
            },
        )

    def chunk(self, path: str, number: tuple[int, ...], level: int = FAST) -> bytes:
        """Return a chunk of an array as it lies on disk; `level` is how hard gzip tries."""
        array = self.arrays[path]
        return encode_chunk(array.read(number), array.chunk, level)

    def shards(self, path: str) -> Iterator[tuple[tuple[int, ...], Callable[[], bytes]]]:
        """Yield the number of each shard of an array, and what makes its bytes."""
        array = self.arrays[path]
        per_shard = [a // b for a, b in zip(_shard(array), array.chunk, strict=True)]

        def make(shard: tuple[int, ...]) -> bytes:
            first = [number * count for number, count in zip(shard, per_shard, strict=True)]
            places = product(
                *(
                    range(min(count, total - start))
                    for start, count, total in zip(first, per_shard, array.grid, strict=True)
                )
            )
            return encode_shard(
                per_shard,
                ((place, self.chunk(path, tuple(np.add(first, place).tolist()), SMALL)) for place in places),
            )

        counts = (-(-total // count) for total, count in zip(array.grid, per_shard, strict=True))
        for number in product(*(range(count) for count in counts)):
            yield number, partial(make, number)

    def _add_model(self, name: str) -> dict[str, Any]:
        spec = parse_model(name)
        fits = [open_fit(self.store, name, level) for level in range(self.levels)]
        there = fits[0].names
        if "residual" in fits[0].attributes:
            self.without_residual.append(name)
        wanted = ["normal", "diffuse", *(["specular"] if spec.lobes else []), *spec.shape_names]
        wanted += [extra for extra in ("ambient", "view_tilt") if extra in there]
        parameters = parameter_columns(fits[0], wanted)
        kept = ("residual_rms", "chi2_reduced", "status")
        quality = parameter_columns(
            fits[0],
            [each for each in there if each.endswith("_sd")] + [each for each in kept if each in there],
        )
        for level, fit in enumerate(fits):
            self._add(f"models/{name}/{level}/parameters", fit, parameters)
            self._add(f"models/{name}/{level}/quality", fit, quality)
        attributes = {key: fits[0].attributes[key] for key in _FIT_ATTRIBUTES if key in fits[0].attributes}
        base = name.removesuffix("-no-ambient").removesuffix("-ambient")
        return {
            **attributes,
            "name": name,
            "base": base if base in MODELS else name,
            "title": spec.title,
            "lobes": spec.lobes,
            "shape": [
                {"name": each.name, "meaning": each.meaning, "lower": each.lower, "upper": each.upper}
                for each in spec.shape
            ],
            "parameters": column_attributes(parameters),
            "quality": column_attributes(quality),
            "gloss": _gloss_tables(fits[0]),
        }

    def _add(self, path: str, fit: Fit, columns: Sequence[Parameter]) -> None:
        height, width = fit.shape
        names = list(dict.fromkeys(column.name for column in columns))

        def read(number: tuple[int, ...]) -> Codes:
            rows, across = _pixels(number[0], height), _pixels(number[1], width)
            return pack(fit.read(rows, across, names), columns)

        chunk = (PUBLISHED_CHUNK, PUBLISHED_CHUNK, len(columns))
        self.arrays[path] = PackedArray(
            (height, width, len(columns)), chunk, ("y", "x", "parameter"), 0, read
        )

    def _add_height(self, model: str) -> dict[str, Any]:
        """Add the relief that a model's normals make, from the finest level that is integrated at once."""
        sizes = [self.size, *level_sizes(*self.size)]
        finest = next(level for level, size in enumerate(sizes) if max(size) <= _HEIGHT_PX)
        fit = open_fit(self.store, model, finest)
        rows, columns = (slice(0, length) for length in fit.shape)
        mm_per_px = open_stack(self.store).camera.mm_per_px
        relief = integrate_normals(fit.read(rows, columns, ["normal"])["normal"])
        reliefs = [relief * np.float32(2**finest * (mm_per_px or 1))]
        low, high = float(reliefs[0].min()), float(reliefs[0].max())
        units = "mm" if mm_per_px else "px"
        column = linear("height", 0, low, max(high, low + 1e-6), units, "height of the relief")
        for level in range(finest, self.levels):
            height, width = sizes[level]

            def read(number: tuple[int, ...], relief: NDArray[Any] = reliefs[-1]) -> Codes:
                part = relief[_pixels(number[0], len(relief)), _pixels(number[1], relief.shape[1])]
                return column.encode(part)[..., np.newaxis]

            self.arrays[f"height/{level}"] = PackedArray(
                (height, width, 1), (PUBLISHED_CHUNK, PUBLISHED_CHUNK, 1), ("y", "x", "parameter"), 0, read
            )
            reliefs.append(np.asarray(halve(reliefs[-1])))
        return {"level": finest, "column": column_attributes([column])[0]}

    def _add_photographs(self, stack: Stack, kept: list[int]) -> dict[str, Any] | None:
        if not kept:
            return None
        channels = stack.shape[3]
        column = logarithmic("radiance", 0, "1", "relative radiance")
        tiles = _PhotographTiles(stack, self.size)
        sizes = [self.size, *level_sizes(*self.size)]
        for level, (height, width) in enumerate(sizes):

            def read(number: tuple[int, ...], level: int = level) -> Codes:
                light, row, across, _ = number
                return column.encode(tiles(kept[light], level, row, across))[np.newaxis]

            self.arrays[f"photographs/{level}"] = PackedArray(
                (len(kept), height, width, channels),
                (1, PHOTOGRAPH_CHUNK, PHOTOGRAPH_CHUNK, channels),
                ("light", "y", "x", "channel"),
                1,
                read,
            )
        lights = stack.lights
        intensity = np.broadcast_to(lights.intensity, (len(lights), channels))
        near = [bool(np.isfinite(place).all()) for place in lights.position_mm]
        clip = [None if not np.isfinite(level) else level for level in stack.clip_level.tolist()]
        return {
            "transfer": column.transfer,
            "scale": column.scale,
            "offset": column.offset,
            "clip_level": clip,
            "lights": [
                {
                    "name": lights.names[index],
                    "direction": lights.direction[index].tolist(),
                    "position_mm": lights.position_mm[index].tolist() if near[index] else None,
                    "intensity": intensity[index].tolist(),
                }
                for index in kept
            ],
        }


class _PhotographTiles:
    """Tiles of photographs at every level, each made of the four below it."""

    def __init__(self, stack: Stack, size: tuple[int, int]) -> None:
        self._stack = stack
        self._sizes = [size, *level_sizes(*size)]
        # A tile of one level and its neighbours are asked for one after the other.
        self._cached: Callable[..., NDArray[np.float32]] = lru_cache(maxsize=64)(self._make)

    def __call__(self, light: int, level: int, row: int, column: int) -> NDArray[np.float32]:
        return self._cached(light, level, row, column)

    def _make(self, light: int, level: int, row: int, column: int) -> NDArray[np.float32]:
        height, width = self._sizes[level]
        rows, columns = _pixels(row, height, PHOTOGRAPH_CHUNK), _pixels(column, width, PHOTOGRAPH_CHUNK)
        if level == 0:
            radiance: NDArray[np.float32] = self._stack.radiance(rows, columns, [light])[0]
            return radiance
        tile = np.empty(
            (rows.stop - rows.start, columns.stop - columns.start, self._stack.shape[3]), np.float32
        )
        half = PHOTOGRAPH_CHUNK // 2
        for down, right in product((0, 1), repeat=2):
            part = tile[down * half : (down + 1) * half, right * half : (right + 1) * half]
            if part.size:
                part[...] = halve(self(light, level - 1, 2 * row + down, 2 * column + right))
        return tile


def _pixels(number: int, length: int, size: int = PUBLISHED_CHUNK) -> slice:
    return slice(number * size, min((number + 1) * size, length))


def _shard(array: PackedArray) -> tuple[int, ...]:
    """Return the shape of an array's shards: larger along y and x."""
    sizes = list(array.chunk)
    for axis in (array.spatial, array.spatial + 1):
        # No larger than the picture needs: the index lists every chunk of a shard.
        sizes[axis] = min(SHARD, array.grid[axis] * array.chunk[axis])
    return tuple(sizes)


def _by_usefulness(names: list[str]) -> list[str]:
    """Return models in the order of their list, those with highlights first."""
    order = list(MODELS)
    return sorted(
        names, key=lambda name: (name != "torrance-sparrow", MODELS[name].lobes == 0, order.index(name))
    )


def _spread(direction: NDArray[np.float64], count: int | None) -> list[int]:
    """Return which `count` directions lie furthest apart, each the furthest from those before, in order."""
    total = len(direction)
    if count is None or count >= total:
        return list(range(total))
    if count <= 0:
        return []
    chosen = [int(np.argmax(direction[:, 2]))]
    nearest = direction @ direction[chosen[0]]
    while len(chosen) < count:
        chosen.append(int(np.argmin(nearest)))
        nearest = np.maximum(nearest, direction @ direction[chosen[-1]])
    return sorted(chosen)


def _display(stack: Stack) -> dict[str, Any]:
    """Return the matrix from radiance to linear sRGB, as `render` shows it by default."""
    camera = camera_colour(stack.attributes.get("camera_colour"))
    channels = stack.shape[3]
    rendition = Rendition(camera=camera, channels=channels)
    matrix = rendition.matrix
    return {
        "matrix": (np.eye(3) if matrix is None else matrix).tolist(),
        "source": camera.source,
        # What `render` embeds in its pictures, and the page in the ones it saves.
        "profile": base64.b64encode(profile("srgb")).decode(),
    }


def _gloss_tables(fit: Fit) -> list[dict[str, Any]]:
    """Return, per angle, gloss units per unit of albedo and of each lobe over the shape parameters."""
    spec = parse_model(fit.attributes["model"])
    tables = []
    for meter in GLOSSMETERS:
        table = PixelGloss(spec, fit.attributes, meter)
        axes = [{"low": float(axis[0]), "high": float(axis[-1]), "count": len(axis)} for axis in table.axes]
        tables.append({"angle_deg": meter.angle_deg, "axes": axes, "values": table.grid.ravel().tolist()})
    return tables
