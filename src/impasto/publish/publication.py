"""What a published store holds, made from a painting's store chunk by chunk.

`publish` writes all of it to files; `view` serves each piece when a browser asks for it.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from io import BytesIO
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
from impasto.geometry import Lights
from impasto.light_distance import only_told
from impasto.light_strength import scale_photographed
from impasto.maps.integration import integrate_normals
from impasto.models import MODELS, parse_model, parse_models
from impasto.publish.arrays import Codes, PackedArray, pixels_of
from impasto.publish.photographs import photograph_arrays, spread
from impasto.publish.residual import PackedResidual
from impasto.store import (
    RESIDUAL,
    Fit,
    Stack,
    fit_attributes,
    fitted_models,
    level_sizes,
    open_fit,
    open_stack,
    provenance,
)
from impasto.store.packing import (
    QUANTISATION,
    Parameter,
    column_attributes,
    linear,
    pack,
    parameter_columns,
)
from impasto.store.published import PUBLISHED_CHUNK, PUBLISHED_SCHEMA, encode_chunk
from impasto.store.shards import Shard

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

_GLOSS_METER, _GLOSS_AXES = 1, 2
"""The usual geometry, 60°, and how many shape parameters a table of it may have."""

FAST, SMALL = 1, 6
"""How hard gzip tries: for somebody who waits for the chunk, and for a chunk that is kept."""


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
        names = [spec.name for spec in parse_models(models)] or _by_usefulness(fitted_models(store))
        if not names:
            raise OptionError(
                Problem(str(store), "has no complete fit to show", f"Fit one: impasto fit {store}")
            )
        self.store = store
        self.size = (stack.shape[1], stack.shape[2])
        self.levels = 1 + len(level_sizes(*self.size))
        self.arrays: dict[str, PackedArray] = {}
        entries = [self._add_model(name) for name in names]
        kept = spread(stack.lights.direction, photographs)
        pictures, described = photograph_arrays(stack, _strong(stack, names), kept)
        self.arrays.update(pictures)
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
            "photographs": described,
            "height": self._add_height(names[0]),
        }

    def documents(self, *, shards: bool = False) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the metadata of each group and array by its path, the root's ("") last.

        The root's holds a copy of all others, so that a browser asks once.
        """
        documents = {path: array.document(shards=shards) for path, array in self.arrays.items()}
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
        return encode_chunk(array.read(number), array.chunk, array.dtype, level)

    def shards(self, path: str) -> Iterator[tuple[tuple[int, ...], Callable[[], bytes]]]:
        """Yield the number of each shard of an array, and what makes its bytes."""
        array = self.arrays[path]
        per_shard = [a // b for a, b in zip(array.shard, array.chunk, strict=True)]

        def make(shard: tuple[int, ...]) -> bytes:
            first = [number * count for number, count in zip(shard, per_shard, strict=True)]
            places = product(
                *(
                    range(min(count, total - start))
                    for start, count, total in zip(first, per_shard, array.grid, strict=True)
                )
            )
            data = BytesIO()
            shard_file = Shard(data, per_shard)
            for place in places:
                shard_file.put(place, self.chunk(path, tuple(np.add(first, place).tolist()), SMALL))
            shard_file.finish()
            return data.getvalue()

        counts = (-(-total // count) for total, count in zip(array.grid, per_shard, strict=True))
        for number in product(*(range(count) for count in counts)):
            yield number, partial(make, number)

    def _add_model(self, name: str) -> dict[str, Any]:
        spec = parse_model(name)
        fits = [open_fit(self.store, name, level) for level in range(self.levels)]
        there = fits[0].names
        wanted = ["normal", "diffuse", *(["specular"] if spec.lobes else []), *spec.shape_names]
        wanted += [extra for extra in ("ambient", "specular_rgb", "view_tilt") if extra in there]
        parameters = parameter_columns(fits[0], wanted)
        kept = ("residual_rms", "chi2_reduced", "status")
        quality = parameter_columns(
            fits[0],
            [each for each in there if each.endswith("_sd")] + [each for each in kept if each in there],
        )
        residual = PackedResidual(fits[0].attributes) if RESIDUAL in fits[0].attributes else None
        for level, fit in enumerate(fits):
            self._add(f"models/{name}/{level}/parameters", fit, parameters)
            self._add(f"models/{name}/{level}/quality", fit, quality)
            if residual is not None:
                self._add_residual(f"models/{name}/{level}/residual", fit, residual)
        attributes = {key: fits[0].attributes[key] for key in _FIT_ATTRIBUTES if key in fits[0].attributes}
        attributes |= only_told(fits[0].attributes)
        base = name.removesuffix("-no-ambient").removesuffix("-ambient")
        base = base if base in MODELS else name
        return {
            **attributes,
            "name": name,
            "base": base,
            "title": spec.title,
            "lobes": spec.lobes,
            "shape": [
                {"name": each.name, "meaning": each.meaning, "lower": each.lower, "upper": each.upper}
                for each in spec.shape
            ],
            "parameters": column_attributes(parameters),
            "quality": column_attributes(quality),
            "gloss": _gloss_tables(fits[0], base),
            "residual": None if residual is None else residual.attributes,
        }

    def _add(self, path: str, fit: Fit, columns: Sequence[Parameter]) -> None:
        names = list(dict.fromkeys(column.name for column in columns))
        chunk = (PUBLISHED_CHUNK, PUBLISHED_CHUNK, len(columns))

        def read(number: tuple[int, ...]) -> Codes:
            return pack(fit.read(*_tile(number, fit.shape), names), columns)

        self.arrays[path] = PackedArray((*fit.shape, len(columns)), chunk, ("y", "x", "parameter"), 0, read)

    def _add_residual(self, path: str, fit: Fit, residual: PackedResidual) -> None:
        chunk = (PUBLISHED_CHUNK, PUBLISHED_CHUNK, residual.components)

        def read(number: tuple[int, ...]) -> Codes:
            return residual.pack(fit.read(*_tile(number, fit.shape), [RESIDUAL])[RESIDUAL])

        shape = (*fit.shape, residual.components)
        self.arrays[path] = PackedArray(shape, chunk, ("y", "x", "component"), 0, read, "uint8")

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
                part = relief[_tile(number, relief.shape)]
                return column.encode(part)[..., np.newaxis]

            self.arrays[f"height/{level}"] = PackedArray(
                (height, width, 1), (PUBLISHED_CHUNK, PUBLISHED_CHUNK, 1), ("y", "x", "parameter"), 0, read
            )
            reliefs.append(np.asarray(halve(reliefs[-1])))
        return {"level": finest, "column": column_attributes([column])[0]}


def _tile(number: tuple[int, ...], size: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns of a chunk of maps."""
    rows, columns = (pixels_of(*each, PUBLISHED_CHUNK) for each in zip(number[:2], size[:2], strict=True))
    return rows, columns


def _strong(stack: Stack, models: Sequence[str]) -> Lights:
    """Return the lights of a stack as strong as the first of its fits that looked for that found them."""
    for model in models:
        attributes = fit_attributes(stack.store, model) or {}
        if "self_calibration" in attributes:
            return scale_photographed(attributes, stack.lights)
    return stack.lights


def _by_usefulness(names: list[str]) -> list[str]:
    """Return models in the order of their list, those with highlights first."""
    order = list(MODELS)
    return sorted(
        names, key=lambda name: (name != "torrance-sparrow", MODELS[name].lobes == 0, order.index(name))
    )


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


def _gloss_tables(fit: Fit, base: str) -> list[dict[str, Any]]:
    """Return the table of gloss units that the page draws from; none for a model with too many parameters."""
    if len(parse_model(base).shape) > _GLOSS_AXES:
        return []
    return [_gloss_table(base, fit.attributes["index_of_refraction"], fit.attributes["fresnel"])]


@cache
def _gloss_table(base: str, index: float, fresnel: str) -> dict[str, Any]:
    """Return gloss units per unit of albedo and of each lobe, over the shape parameters of a model."""
    table = PixelGloss(
        parse_model(base), {"index_of_refraction": index, "fresnel": fresnel}, GLOSSMETERS[_GLOSS_METER]
    )
    axes = [{"low": float(axis[0]), "high": float(axis[-1]), "count": len(axis)} for axis in table.axes]
    return {
        "angle_deg": GLOSSMETERS[_GLOSS_METER].angle_deg,
        "axes": axes,
        "values": [float(f"{value:.6g}") for value in table.grid.ravel().tolist()],
    }
