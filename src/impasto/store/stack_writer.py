"""Write the stack of a store, photograph by photograph."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import Problem, StoreError
from impasto.geometry import Camera, Lights
from impasto.store.arrays import array_document
from impasto.store.attributes import stack_kind
from impasto.store.chunks import encode_chunks
from impasto.store.files import digest, writing
from impasto.store.hierarchy import (
    Attributes,
    provenance,
    read_array_metadata,
    read_group,
    remove,
    write_array_metadata,
    write_group,
    write_table,
)
from impasto.store.layout import (
    EVALUATIONS,
    FITS,
    PYRAMIDS,
    SCHEMA,
    STACK,
    STACK_CHUNK,
    ZSTD,
    ZSTD_NOISE,
    stack_fill_value,
)
from impasto.store.shards import new_shard

_RADIANCE = f"{STACK}/radiance"

_TABLES: dict[str, tuple[tuple[str, ...], Attributes]] = {
    "light_name": (("light",), {"long_name": "name of the photograph"}),
    "light_direction": (("light", "xyz"), {"long_name": "unit vector towards the light", "units": "1"}),
    "light_position_mm": (
        ("light", "xyz"),
        {"long_name": "position of the light; NaN if far away", "units": "mm"},
    ),
    "light_intensity": (
        ("light", "channel"),
        {"long_name": "relative irradiance at the centre", "units": "1"},
    ),
    "light_angular_size_deg": (
        ("light",),
        {"long_name": "angular diameter of the source", "units": "degree"},
    ),
}


@dataclass(frozen=True, kw_only=True)
class StackHeader:
    """Everything about a stack that is known before a photograph is decoded.

    Parameters
    ----------
    shape : tuple of int
        (light, y, x, channel).
    dtype : dtype
        uint16 or float32.
    lights : Lights
    camera : Camera
    scale, offset : float
        Relative radiance = scale * stored value + offset.
    clip_level : tuple of float or None
        Relative radiance per channel from which on a sample is clipped; None where none is.
    noise : mapping
        ``read``, ``photon``, ``relative``: variance = read² + photon · Y + (relative · Y)² at radiance Y.
    inputs : sequence of mapping
        One per light: ``name``, ``file`` and how it was taken and decoded.
    more : mapping
        Further attributes, as JSON.
    """

    shape: tuple[int, int, int, int]
    dtype: np.dtype
    lights: Lights
    camera: Camera
    scale: float
    offset: float
    clip_level: tuple[float | None, ...]
    noise: Mapping[str, float]
    inputs: Sequence[Mapping[str, Any]]
    more: Mapping[str, Any] = field(default_factory=dict)

    def attributes(self) -> Attributes:
        """Return the attributes that follow from the settings alone."""
        camera = self.camera
        settings = {
            "scale": self.scale,
            "offset": self.offset,
            "clip_level": list(self.clip_level),
            "noise": dict(self.noise),
            **self.more,
            "camera": {
                "view_direction": camera.view_direction.tolist(),
                "distance_mm": camera.distance_mm,
                "mm_per_px": camera.mm_per_px,
            },
        }
        identity = {
            **settings,
            "shape": list(self.shape),
            "dtype": self.dtype.name,
            "inputs": [dict(entry) for entry in self.inputs],
            "lights": {name: _as_json(values) for name, values in self.tables().items()},
        }
        return {**settings, "settings_sha256": digest(identity)}

    def tables(self) -> dict[str, NDArray[np.float64] | tuple[str, ...]]:
        """Return the arrays that describe the lights."""
        lights, channels = self.lights, self.shape[3]
        return {
            "light_name": lights.names,
            "light_direction": lights.direction,
            "light_position_mm": lights.position_mm,
            "light_intensity": np.broadcast_to(lights.intensity, (len(lights), channels)),
            "light_angular_size_deg": lights.angular_size_deg,
        }


def _as_json(values: NDArray[np.float64] | tuple[str, ...]) -> Any:
    """Return nested lists in which None stands for NaN."""
    if isinstance(values, tuple):
        return list(values)
    nested = values.astype(object)
    nested[np.isnan(values)] = None
    return nested.tolist()


class StackWriter:
    """Writes a stack photograph by photograph, and remembers which are whole.

    A photograph is one shard, there as a whole or not at all; it counts when its digest stands in the
    metadata. Methods may be called from several threads, each with its own photograph.

    Parameters
    ----------
    store : Path
    header : StackHeader
    fresh : bool
        Whether to begin anew even if the store holds the same stack.
    """

    def __init__(self, store: Path, header: StackHeader, *, fresh: bool) -> None:
        self.store = store
        self._header = header
        self._zstd = ZSTD if header.inputs[0].get("dtype") == "uint8" else ZSTD_NOISE
        _, height, width, channels = header.shape
        self._grid = (1, -(-height // STACK_CHUNK), -(-width // STACK_CHUNK), 1)
        self._document = array_document(
            header.shape,
            (1, STACK_CHUNK, STACK_CHUNK, channels),
            ("light", "y", "x", "channel"),
            header.dtype,
            fill_value=stack_fill_value(header.dtype),
            compressor=("zstd", self._zstd),
            shard=(1, self._grid[1] * STACK_CHUNK, self._grid[2] * STACK_CHUNK, channels),
            attributes={"long_name": "relative radiance, as scale * value + offset", "units": "1"},
        )
        self._writing = threading.Lock()
        self._attributes = self._begin({**provenance(), **header.attributes()}, fresh)

    def _begin(self, settings: Attributes, fresh: bool) -> Attributes:
        """Continue what the store holds of the same stack, or start anew; return the group's attributes."""
        store = self.store
        if read_group(store) is None:
            write_group(store, "", {"impasto_schema": SCHEMA, **provenance()})
        found = read_group(store / STACK)
        kind = stack_kind(self._header.shape[0], self._header.shape[3], complete=False)
        if (
            found is not None
            and not fresh
            and all(found.get(key) == settings[key] for key in settings)
            and read_array_metadata(store, _RADIANCE) == self._document
            and not any(kind(found, ""))
        ):
            return found
        remove(store, EVALUATIONS, FITS, PYRAMIDS, STACK)
        write_array_metadata(store, _RADIANCE, self._document)
        for name, values in self._header.tables().items():
            dims, attributes = _TABLES[name]
            write_table(store, f"{STACK}/{name}", values, dims, attributes)
        # Without the group's own metadata the arrays above do not count, so it comes last.
        begun = {
            "coordinates": " ".join(_TABLES),
            **settings,
            "inputs": [{**entry, "blake3": None, "clipped_samples": None} for entry in self._header.inputs],
            "complete": False,
        }
        write_group(store, STACK, begun)
        return begun

    @property
    def attributes(self) -> Attributes:
        """The attributes of the group as they stand in the store."""
        return self._attributes

    @property
    def digests(self) -> list[str | None]:
        """Digest per photograph, None for those that are not written whole."""
        return [entry["blake3"] for entry in self._attributes["inputs"]]

    def write_light(self, light: int, bands: Iterable[tuple[int, NDArray[Any]]]) -> None:
        """Write a photograph, in place of what there is of it.

        Parameters
        ----------
        light : int
        bands : iterable
            First row and values of each band, shape (rows, W, C), as stored, from top to bottom; a band is
            one row of chunks, or several.

        Raises
        ------
        StoreError
            If the disk is full or refuses.
        """
        self._record(light, None, None)

        path = self.store / _RADIANCE / f"c/{light}/0/0/0"
        with writing(self.store, _RADIANCE), new_shard(path, self._grid) as shard:
            for first, band in bands:
                chunks = encode_chunks(band, STACK_CHUNK, stack_fill_value(band.dtype), self._zstd)
                for (row, column), chunk in chunks:
                    shard.put((0, first // STACK_CHUNK + row, column, 0), chunk)

    def finish_light(self, light: int, blake3: str, clipped_samples: int) -> None:
        """Record that a photograph is written whole."""
        self._record(light, blake3, clipped_samples)

    def _record(self, light: int, blake3: str | None, clipped_samples: int | None) -> None:
        with self._writing:
            entry = self._attributes["inputs"][light]
            if (entry["blake3"], entry["clipped_samples"]) != (blake3, clipped_samples):
                entry.update(blake3=blake3, clipped_samples=clipped_samples)
                write_group(self.store, STACK, self._attributes)

    def finish(self, more: Mapping[str, Any]) -> None:
        """Declare the stack complete, and add attributes that were not known before.

        Raises
        ------
        StoreError
            If a photograph is missing.
        """
        missing = [entry["name"] for entry in self._attributes["inputs"] if entry["blake3"] is None]
        if missing:
            raise StoreError(unfinished_stack(self.store, self._attributes))
        self._attributes.update(more)
        self._attributes["complete"] = True
        write_group(self.store, STACK, self._attributes)


def noted_digest(entry: Mapping[str, Any]) -> str | None:
    """Return the digest of a photograph by its entry in a stack, None where it is not written whole."""
    digest: str | None = entry.get("blake3", entry.get("sha256"))
    return digest


def unfinished_stack(store: Path, attributes: Attributes) -> Problem:
    """Return the problem that a stack is not finished, with how far it is."""
    inputs = attributes.get("inputs", [])
    done = sum(noted_digest(entry) is not None for entry in inputs)
    return Problem(
        where=f"{store}: {STACK}",
        what=f"is not finished: {done} of {len(inputs)} photographs are in it",
        do="Run the same impasto stack command again: it goes on from there",
    )
