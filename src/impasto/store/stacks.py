"""Read the stack of a store: linearised photographs under known lights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.errors import Problem, StoreError, raise_problems
from impasto.geometry import Camera, Lights
from impasto.store.array_reader import ArrayReader
from impasto.store.attributes import attribute_problems, stack_kind
from impasto.store.files import DAMAGE, digest, reading
from impasto.store.hierarchy import (
    Attributes,
    array_problems,
    has_array,
    open_array,
    read_group,
    source_problems,
)
from impasto.store.layout import ASSUMED_WHITE, STACK
from impasto.store.stack_writer import noted_digest, unfinished_stack

_AGAIN = "Run impasto stack with the same photographs and --overwrite to write it anew"


@dataclass(frozen=True)
class Stack:
    """A complete stack, open for reading; pixels are read when asked for.

    Parameters
    ----------
    store : Path
    attributes : dict
        The attributes of the group, as docs/store.md lists them.
    """

    store: Path
    attributes: Attributes = field(repr=False)

    @cached_property
    def _radiance(self) -> ArrayReader:
        return open_array(self.store, f"{STACK}/radiance")

    def _table(self, name: str, *axes: int, known: bool = True) -> NDArray[Any]:
        # What is not known is NaN for every light, and Zarr need not write that.
        path = f"{STACK}/{name}"
        array = open_array(self.store, path)
        shape, dtype = (self.shape[0], *axes), object if name == "light_name" else np.float64
        raise_problems(StoreError, array_problems(self.store, path, array, shape, dtype, _AGAIN))
        if known and array.lost():
            raise StoreError(Problem(f"{self.store}: {path}", "has lost its values", _AGAIN))
        with reading(self.store, path, _AGAIN):
            return array.read()

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Lengths of (light, y, x, channel)."""
        lights, height, width, channels = self._radiance.shape
        return lights, height, width, channels

    @property
    def dtype(self) -> np.dtype:
        """Type of the stored values: uint16 or float32."""
        return self._radiance.dtype

    @cached_property
    def lights(self) -> Lights:
        """The lights, one per photograph."""
        return Lights(
            names=tuple(str(name) for name in self._table("light_name")),
            direction=self._table("light_direction", 3),
            position_mm=self._table("light_position_mm", 3, known=False),
            intensity=self._table("light_intensity", self.shape[3]),
            angular_size_deg=self._table("light_angular_size_deg", known=False),
        )

    @property
    def camera(self) -> Camera:
        """Where the camera stands."""
        camera = self.attributes["camera"]
        return Camera(
            view_direction=np.array(camera["view_direction"], np.float64),
            distance_mm=camera["distance_mm"],
            mm_per_px=camera["mm_per_px"],
        )

    @property
    def scale(self) -> float:
        """Relative radiance of one step of the stored values."""
        return float(self.attributes["scale"])

    @property
    def offset(self) -> float:
        """Relative radiance of the stored value 0."""
        return float(self.attributes["offset"])

    @property
    def clip_level(self) -> NDArray[np.float64]:
        """Relative radiance from which on a sample is clipped, shape (C,); infinite where none is."""
        levels = self.attributes["clip_level"]
        return np.array([math.inf if level is None else level for level in levels], np.float64)

    @property
    def noise(self) -> tuple[float, float, float]:
        """The noise model (read, photon, relative): variance = read² + photon · Y + (relative · Y)²."""
        noise = self.attributes["noise"]
        return float(noise["read"]), float(noise["photon"]), float(noise["relative"])

    @property
    def light_rgb(self) -> NDArray[np.float64]:
        """Colour of the light in the stack's own space, shape (C,); ones where it is not known."""
        return np.array(self.attributes.get("light_rgb", [1.0] * self.shape[3]), np.float64)

    @property
    def light_rgb_source(self) -> str:
        """Where that colour comes from."""
        return str(self.attributes.get("light_rgb_source", ASSUMED_WHITE))

    @property
    def absolute(self) -> bool:
        """Whether relative radiance 1 is a perfect white diffuser lit along its normal."""
        return bool(self.attributes.get("white_reference"))

    @property
    def sha256(self) -> str:
        """A digest of the stack's settings and of the contents of every photograph."""
        photographs = [noted_digest(entry) for entry in self.attributes["inputs"]]
        return digest([self.attributes["settings_sha256"], photographs])

    @property
    def clipped_samples(self) -> int:
        """Number of clipped samples over all photographs and channels."""
        return sum(int(entry["clipped_samples"]) for entry in self.attributes["inputs"])

    def read(
        self,
        rows: slice,
        columns: slice,
        lights: ArrayLike | None = None,
        buffer: NDArray[Any] | None = None,
    ) -> NDArray[Any]:
        """Return stored values of a tile.

        Parameters
        ----------
        rows, columns : slice
            The tile, with start and stop.
        lights : array_like of int, optional
            Which lights, all by default.
        buffer : ndarray of shape (n,), optional
            Memory for the result, of the stack's type and at least as many elements; a stream of tiles that
            uses the same memory again spares the system half of the work.

        Returns
        -------
        ndarray of shape (L, rows, columns, C), uint16 or float32, C-contiguous
            Relative radiance is `scale` * value + `offset`; NaN where a float sample is missing.

        Raises
        ------
        StoreError
            Listing every photograph whose stored pixels are damaged or lost.
        """
        count, _, _, channels = self.shape
        index = np.arange(count) if lights is None else np.asarray(lights, dtype=np.intp)
        shape = (len(index), rows.stop - rows.start, columns.stop - columns.start, channels)
        raise_problems(StoreError, self._lost(rows, columns, index))
        tile = np.empty(shape, self.dtype) if buffer is None else buffer[: math.prod(shape)].reshape(shape)
        try:
            for values, light in zip(tile, index, strict=True):
                self._radiance.read(slice(light, light + 1), rows, columns, out=values[np.newaxis])
        except DAMAGE as error:
            raise StoreError(self._damage(rows, columns, error)) from error
        return tile

    def _lost(self, rows: slice, columns: slice, index: NDArray[np.intp]) -> list[Problem]:
        lost = {number[0] for number in self._radiance.lost(slice(None), rows, columns)} & set(index.tolist())
        names = [self.attributes["inputs"][light]["name"] for light in sorted(lost)]
        return [
            Problem(f"{self.store}: {STACK}/radiance", f"{name} has lost pixels", _AGAIN) for name in names
        ]

    def _damage(self, rows: slice, columns: slice, error: Exception) -> list[Problem]:
        problems = []
        place = f"{self.store}: {STACK}/radiance"
        where = f"rows {rows.start} to {rows.stop - 1}, columns {columns.start} to {columns.stop - 1}"
        for light, entry in enumerate(self.attributes["inputs"]):
            try:
                self._radiance.read(slice(light, light + 1), rows, columns)
            except DAMAGE as cause:
                problems.append(Problem(place, f"{entry['name']} is damaged at {where}: {cause}", _AGAIN))
        return problems or [Problem(place, f"cannot be read at {where}: {error}", _AGAIN)]

    def radiance(
        self, rows: slice, columns: slice, lights: ArrayLike | None = None, *, step: int = 1
    ) -> NDArray[np.float32]:
        """Return relative radiance of every `step`-th pixel of a tile; else as for `read`.

        Returns
        -------
        ndarray of shape (L, rows, columns, C), float32
        """
        values = self.read(rows, columns, lights)[:, ::step, ::step].astype(np.float32)
        if (self.scale, self.offset) != (1.0, 0.0):
            values *= np.float32(self.scale)
            values += np.float32(self.offset)
        return values


def stack_problems(store: Path, attributes: Attributes) -> list[Problem]:
    """Return everything that is wrong with the attributes of a store's stack.

    Raises
    ------
    StoreError
        If the metadata of its photographs are damaged.
    """
    path = f"{STACK}/radiance"
    lights, channels = None, None
    if has_array(store, path):
        array = open_array(store, path)
        if len(array.shape) != 4 or array.dtype not in (np.uint16, np.float32):
            what = f"is {array.dtype} of shape {array.shape}, expected uint16 or float32 along 4 axes"
            return [Problem(f"{store}: {path}", what, _AGAIN)]
        lights, _, _, channels = array.shape
    kind = stack_kind(lights, channels, complete=bool(attributes.get("complete")))
    return attribute_problems(store, STACK, attributes, kind, _AGAIN)


def open_stack(store: str | Path) -> Stack:
    """Open the stack of a store.

    Raises
    ------
    StoreError
        If there is no store, it is from a newer version, or its stack is missing, not finished or damaged.
    """
    store = Path(store)
    problems = source_problems(store)
    if problems:
        raise StoreError(problems)
    attributes = read_group(store / STACK)
    if attributes is None:
        raise StoreError(
            Problem(str(store), "has no stack of photographs", "Make it with: impasto stack PHOTOS STORE")
        )
    raise_problems(StoreError, stack_problems(store, attributes))
    if not attributes.get("complete"):
        raise StoreError(unfinished_stack(store, attributes))
    if not has_array(store, f"{STACK}/radiance"):
        raise StoreError(Problem(f"{store}: {STACK}/radiance", "has lost its metadata", _AGAIN))
    return Stack(store, attributes)
