"""What lies where in a store, and in which pieces: docs/store.md in code, without a word of Zarr.

A stack is cut into chunks of one light and 512 x 512 pixels, because photographs arrive one by one and fits
read all lights of a tile; those of a photograph lie in one file. A fit is cut into units of 1024 x 1024
pixels, which count as a whole, so that an interrupted fit knows what it has; blocks of 512 x 512 pixels are
written one after the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

SCHEMA = 1

STACK = "stack"
FITS = "fits"
PYRAMIDS = "pyramids"
EVALUATIONS = "evaluations"

STACK_CHUNK = 512
UNIT = 1024
BLOCK = 512
INNER_CHUNK = 256

# How chunks are compressed. Level -1 writes maps, whose last bits are noise, faster than lz4 does, and
# shrinks decoded 8-bit photographs to half. The checksum is zstd's own, because a crc32c after the compressor
# is not looked at when a part of a chunk is read.
ZSTD: dict[str, Any] = {"level": -1, "checksum": True}
# Photographs of 16 bits or floats shrink by a few per cent at any level; this one is five times as fast.
ZSTD_NOISE: dict[str, Any] = {"level": -200, "checksum": True}

# Levels stop where a picture fits on a screen at once.
SMALLEST_LEVEL = 512

# What the attribute `light_rgb_source` says where the light's colour is not known.
ASSUMED_WHITE = "assumed white"

STATUS_MEANING = {
    0: "converged",
    1: "step limit",
    2: "at a bound",
    3: "too few lights",
    4: "all clipped",
    5: "not identified",
    255: "not fitted",
}

# From harmless to worst, for the status of a coarser pixel: "too few lights" and "all clipped" leave a pixel
# without any value, "not identified" without some.
STATUS_SEVERITY = (0, 2, 1, 5, 4, 3, 255)


def stack_fill_value(dtype: np.dtype) -> float | int:
    """Return what a sample of the stack reads as if its chunk is lost: overexposed or missing, never dark."""
    return float("nan") if dtype.kind == "f" else int(np.iinfo(dtype).max)


RESIDUAL = "residual"
SHADOWED = "shadowed"


@dataclass(frozen=True)
class Map:
    """One array of a fit.

    Parameters
    ----------
    name : str
    axis : str or None
        Name of the axis after (y, x): ``xyz``, ``channel`` or ``lobe``; None where a pixel has one value.
    size : int
        Length of that axis, 1 without one.
    units : str
        Unit as `pint` and CF write it; ``1`` for a ratio.
    long_name : str
        What a person reads beside a colour bar.
    dtype : str
    """

    name: str
    axis: str | None
    size: int
    units: str
    long_name: str
    dtype: str = "float32"

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the axes."""
        return ("y", "x") if self.axis is None else ("y", "x", self.axis)

    def shape(self, height: int, width: int) -> tuple[int, ...]:
        """Return the shape of the array for an image of `height` x `width` pixels."""
        return (height, width) if self.axis is None else (height, width, self.size)

    @property
    def fill_value(self) -> float | int:
        """What a pixel holds before it is fitted: NaN, the status "not fitted", or the code of 0."""
        return {"status": 255, RESIDUAL: 2**15}.get(self.name, float("nan"))


def fit_maps(
    shape_names: tuple[str, ...], *, lobes: int, ambient: bool, channels: int, coloured: bool = False
) -> tuple[Map, ...]:
    """Return the maps that a fit of a model has, in the order in which they are written.

    Parameters
    ----------
    shape_names : tuple of str
        The model's shape parameters, such as ``c`` or ``shininess``.
    lobes : int
        Specular lobes, 0 for a matte model.
    ambient : bool
        Whether the model has an ambient term.
    channels : int
        Channels of the stack.
    coloured : bool, optional
        Whether highlights have a colour of their own, where there are lobes and several channels.

    Returns
    -------
    tuple of Map
        ``status`` is the last: its presence says that a unit is whole.
    """
    lobe_axis = "lobe" if lobes > 1 else None
    parameters = [Map("diffuse", "channel", channels, "1", "diffuse magnitude")]
    if lobes:
        parameters.append(Map("specular", lobe_axis, lobes, "1", "specular magnitude"))
    parameters += [Map(name, None, 1, "1", f"shape of the lobe ({name})") for name in shape_names]
    if ambient:
        parameters.append(Map("ambient", "channel", channels, "1", "ambient term"))
    deviations = [
        Map(f"{map.name}_sd", map.axis, map.size, map.units, f"standard deviation of {map.long_name}")
        for map in parameters
    ]
    colour = Map("specular_rgb", "channel", channels, "1", "colour of the highlight over that of the light")
    return (
        Map("normal", "xyz", 3, "1", "unit normal"),
        *parameters,
        *([colour] if coloured and lobes and channels > 1 else []),
        Map("normal_sd", None, 1, "rad", "standard deviation of the normal's direction"),
        *deviations,
        Map("chi2_reduced", None, 1, "1", "reduced chi-square"),
        Map("residual_rms", None, 1, "1", "root mean square residual in relative radiance"),
        Map("status", None, 1, "1", "how the fit of the pixel ended", dtype="uint8"),
    )


def shadowed_map() -> Map:
    """Return the map of how often a pixel lies in a cast shadow."""
    return Map(SHADOWED, None, 1, "1", "share of the lights in whose cast shadow the pixel lies")


def residual_map(components: int) -> Map:
    """Return the map of what a model leaves over, with so many coefficients per pixel."""
    long_name = "codes of what the model leaves over, over the light's direction"
    return Map(RESIDUAL, "component", components, "1", long_name, dtype="uint16")


@dataclass(frozen=True)
class Tile:
    """A rectangle of pixels.

    Parameters
    ----------
    rows, columns : slice
        The pixels it holds.
    """

    rows: slice
    columns: slice

    @property
    def height(self) -> int:
        """Rows of pixels."""
        return int(self.rows.stop - self.rows.start)

    @property
    def width(self) -> int:
        """Columns of pixels."""
        return int(self.columns.stop - self.columns.start)

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.height * self.width

    def tiles(self, height: int, width: int) -> Iterator[Tile]:
        """Yield tiles of at most `height` x `width` pixels, row by row."""
        for row in range(self.rows.start, self.rows.stop, height):
            for column in range(self.columns.start, self.columns.stop, width):
                yield Tile(
                    slice(row, min(row + height, self.rows.stop)),
                    slice(column, min(column + width, self.columns.stop)),
                )

    def within(self, other: Tile) -> tuple[slice, slice]:
        """Return the rows and columns that it takes in the pixels of another."""
        return (
            slice(self.rows.start - other.rows.start, self.rows.stop - other.rows.start),
            slice(self.columns.start - other.columns.start, self.columns.stop - other.columns.start),
        )


@dataclass(frozen=True, kw_only=True)
class Unit(Tile):
    """A piece of a fit that counts as a whole.

    Parameters
    ----------
    row, column : int
        Number of the unit from the top and from the left.
    """

    row: int
    column: int

    def blocks(self) -> Iterator[Tile]:
        """Yield the pieces in which it is written, in this order."""
        return self.tiles(BLOCK, BLOCK)


def unit_at(row: int, column: int, height: int, width: int) -> Unit:
    """Return one unit of an image of `height` x `width` pixels, by its number from the top and the left."""
    return Unit(
        row=row,
        column=column,
        rows=slice(row * UNIT, min((row + 1) * UNIT, height)),
        columns=slice(column * UNIT, min((column + 1) * UNIT, width)),
    )


def units(height: int, width: int) -> list[Unit]:
    """Return the units of an image of `height` x `width` pixels, row by row."""
    return [
        unit_at(row, column, height, width)
        for row in range(-(-height // UNIT))
        for column in range(-(-width // UNIT))
    ]


def level_sizes(height: int, width: int) -> list[tuple[int, int]]:
    """Return height and width of each coarser level, the first at half size."""
    sizes = []
    while max(height, width) >= SMALLEST_LEVEL:
        height, width = -(-height // 2), -(-width // 2)
        sizes.append((height, width))
    return sizes


def status_counts(status: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return how many pixels have each status code, as an ndarray of shape (256,), int64."""
    return np.bincount(status.ravel(), minlength=256).astype(np.int64)
