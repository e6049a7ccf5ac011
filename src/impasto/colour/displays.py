"""Displays that add up three primaries: sRGB, Display P3, and measured ones.

XYZ is relative to the display's white, which has Y = 1. `linear` is the light of each primary as a share of
its light at full drive; `drive` is what the display is sent, 0 to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.colour.primaries import DISPLAY_P3, SRGB, rgb_to_xyz_matrix
from impasto.colour.profiles import display_profile, drive_samples, profile, sampled_curve
from impasto.colour.transfer import decode_srgb, encode_srgb

Array = NDArray[np.float64]

_OUTSIDE = -1e-4
"""Light of a primary below which a colour counts as outside the gamut: a third of a code in 8-bit sRGB."""


class ToneCurves(Protocol):
    """How the light of each primary depends on its drive."""

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive, 0 to 1, for light of shape (..., 3); light beyond 0 and 1 is cut."""
        ...

    def decode(self, drive: ArrayLike) -> Array:
        """Return the light, 0 to 1, for drives of shape (..., 3)."""
        ...


class Display(Protocol):
    """A display, or another device that shows colours."""

    @property
    def name(self) -> str:
        """What summaries call it."""
        ...

    @property
    def matrix(self) -> Array:
        """XYZ of each primary at full drive, one column each, without `black`."""
        ...

    @property
    def black(self) -> Array:
        """XYZ that it shows when it is sent black."""
        ...

    @property
    def profile(self) -> bytes:
        """The ICC profile that its pictures carry."""
        ...

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light of shape (..., 3); what it cannot show is moved to what it can."""
        ...

    def decode(self, drive: ArrayLike) -> Array:
        """Return the XYZ that drives of shape (..., 3) show."""
        ...

    def outside(
        self, linear: NDArray[Any], drive: NDArray[Any], asked: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Tell which of the colours asked for it cannot show; light and drive (..., 3), the others (...)."""
        ...


@dataclass(frozen=True)
class SrgbCurves:
    """The tone curve of sRGB and Display P3 for each primary."""

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light; see `ToneCurves`."""
        return encode_srgb(linear)

    def decode(self, drive: ArrayLike) -> Array:
        """Return the light for drives; see `ToneCurves`."""
        return decode_srgb(drive)


@dataclass(frozen=True)
class GainOffsetGamma:
    """A gain, an offset and a gamma for each primary.

    Parameters
    ----------
    gain, offset, gamma : ndarray of shape (3,), float64
        Light = (gain · drive + offset) ^ gamma, and 0 where the base is negative.

    References
    ----------
    [Berns1996]_
    """

    gain: Array
    offset: Array
    gamma: Array

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light; see `ToneCurves`."""
        kind = np.result_type(linear, np.float32)
        gain, offset, inverse = (part.astype(kind) for part in (self.gain, self.offset, 1 / self.gamma))
        base = np.clip(np.asarray(linear, kind), 0, 1) ** inverse
        return np.asarray(np.clip((base - offset) / gain, 0, 1))

    def decode(self, drive: ArrayLike) -> Array:
        """Return the light for drives; see `ToneCurves`."""
        base = np.maximum(self.gain * np.asarray(drive, np.float64) + self.offset, 0)
        return np.asarray(base**self.gamma)


@dataclass(frozen=True)
class LookUpTables:
    """A table of light for each primary, linear between its entries.

    Parameters
    ----------
    drive : ndarray of shape (N,), float64
        From 0 to 1, ascending.
    linear : ndarray of shape (3, N), float64
        Light of each primary at these drives, ascending from 0 to 1.
    """

    drive: Array
    linear: Array

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light; see `ToneCurves`."""
        drive = np.empty(linear.shape, np.result_type(linear, np.float32))
        for primary, table in enumerate(self.linear):
            drive[..., primary] = np.interp(linear[..., primary], table, self.drive)
        return drive

    def decode(self, drive: ArrayLike) -> Array:
        """Return the light for drives; see `ToneCurves`."""
        drive = np.asarray(drive, np.float64)
        columns = [
            np.interp(drive[..., primary], self.drive, table) for primary, table in enumerate(self.linear)
        ]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class AdditiveDisplay:
    """A display whose primaries keep their chromaticity at every drive, and add up.

    Parameters
    ----------
    name : str
    matrix : ndarray of shape (3, 3), float64
        See `Display`.
    black : ndarray of shape (3,), float64
        See `Display`; the light that a liquid crystal lets through, or that the room reflects.
    curves : ToneCurves

    References
    ----------
    [Day2004]_: XYZ by a matrix of 3 x 4, the fourth column of which is `black`.
    """

    name: str
    matrix: Array
    black: Array
    curves: ToneCurves

    @cached_property
    def profile(self) -> bytes:
        """The ICC profile that its pictures carry; such profiles have no word for the light at black."""
        columns = np.column_stack([self.matrix, self.matrix.sum(axis=1)]).T
        xy = columns[:, :2] / columns.sum(axis=1, keepdims=True)
        samples = np.repeat(drive_samples()[:, np.newaxis], 3, axis=1)
        curves = sampled_curve(self.curves.decode(samples)).T
        return display_profile(xy[:3], (float(xy[3, 0]), float(xy[3, 1])), np.ascontiguousarray(curves))

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light; see `Display`."""
        return self.curves.encode(linear)

    def decode(self, drive: ArrayLike) -> Array:
        """Return the XYZ for drives; see `Display`."""
        return self.curves.decode(drive) @ self.matrix.T + self.black

    def outside(
        self, linear: NDArray[Any], drive: NDArray[Any], asked: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Tell which colours it cannot show; see `Display`."""
        below = np.zeros(asked.shape, bool)
        for primary in range(linear.shape[-1]):
            below |= linear[..., primary] < _OUTSIDE
        return below & asked


class _SrgbDisplay(AdditiveDisplay):
    """sRGB, whose own profile states the formula of its curve."""

    @cached_property
    def profile(self) -> bytes:
        return profile("srgb")


def srgb_display() -> AdditiveDisplay:
    """Return the display that sRGB describes, without light at black [IEC61966-2-1]_."""
    return _SrgbDisplay("sRGB", rgb_to_xyz_matrix(SRGB), np.zeros(3), SrgbCurves())


def display_p3() -> AdditiveDisplay:
    """Return a display of Display P3's primaries with sRGB's curve and white [DisplayP3]_."""
    return AdditiveDisplay("Display P3", rgb_to_xyz_matrix(DISPLAY_P3), np.zeros(3), SrgbCurves())
