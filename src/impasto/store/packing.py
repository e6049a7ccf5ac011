"""How the parameters of a pixel become codes of 16 bits, and values again.

docs/store.md, section "Published stores", specifies both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from impasto.store.fits import Fit, Maps

_LARGEST = 65535
_LOG_FLOOR = -20.0  # 1e-6 to 1e6: wider than any parameter's bounds
_LOG_SPAN = 40.0
_LOG_STEP = _LOG_SPAN / (_LARGEST - 2)
# Residuals and standard deviations, of which nobody reads more than two digits, take a quarter of the room.
_COARSE_STEP = 64 * _LOG_STEP

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


_COLOURS = ("diffuse", "ambient", "specular_rgb", "diffuse_sd", "ambient_sd")


def column_attributes(columns: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Return columns as attributes of a store."""
    return [asdict(column) for column in columns]
