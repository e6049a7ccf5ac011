"""Directions, lights and cameras in the painting's frame.

The frame is right-handed and fixed to the painting: origin at the centre of the image, X to the right (along
the arm's sweep), Y up the painting, Z along its normal towards the viewer. Directions are unit vectors that
point away from the surface. See docs/notation.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def arm_direction(angle: ArrayLike) -> Array:
    """Return the light direction for an angle of the arm, which sweeps the XZ plane.

    Parameters
    ----------
    angle : float or ndarray of shape (...)
        Signed arm angle θa in radians, 0 along the painting's normal, positive towards +X.

    Returns
    -------
    ndarray of shape (..., 3)
        Unit vectors l = (sin θa, 0, cos θa) [Chen2007]_, Fig. 2.
    """
    angle = np.asarray(angle, dtype=np.float64)
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=-1)


def dome_direction(zenith: ArrayLike, azimuth: ArrayLike) -> Array:
    """Return unit vectors for zenith and azimuth angles.

    Parameters
    ----------
    zenith, azimuth : float or ndarray, broadcastable
        Radians; zenith from +Z, azimuth from +X towards +Y.

    Returns
    -------
    ndarray of shape (..., 3)
    """
    zenith, azimuth = np.broadcast_arrays(
        np.asarray(zenith, dtype=np.float64), np.asarray(azimuth, dtype=np.float64)
    )
    return np.stack(
        [np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], axis=-1
    )


def zenith_azimuth(direction: ArrayLike) -> tuple[Array, Array]:
    """Return zenith and azimuth in radians of directions (..., 3), the inverse of `dome_direction`."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def degrees_between(first: ArrayLike, second: ArrayLike) -> Array:
    """Return the angles in degrees between unit vectors (..., 3) and (..., 3), shape (...)."""
    cosine = np.sum(np.asarray(first, np.float64) * np.asarray(second, np.float64), axis=-1)
    result: Array = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return result


def tilt_direction(theta: ArrayLike, phi: ArrayLike) -> Array:
    """Return unit vectors for the paper's signed tilts θ (in the arm's plane) and φ (out of it).

    Parameters
    ----------
    theta, phi : float or ndarray, broadcastable
        Radians.

    Returns
    -------
    ndarray of shape (..., 3)
        (cos φ sin θ, sin φ, cos φ cos θ), the form of n and v in [Chen2007]_, Fig. 2.
    """
    theta, phi = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(phi, np.float64))
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi), np.cos(phi) * np.cos(theta)], axis=-1)


def direction_tilts(direction: ArrayLike) -> tuple[Array, Array]:
    """Return the tilts (θ, φ) in radians of unit vectors (..., 3), the inverse of `tilt_direction`."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    return np.arctan2(x, z), np.arcsin(np.clip(y, -1.0, 1.0))


def turn_about_z(direction: ArrayLike, angle: float) -> Array:
    """Return vectors (..., 3) turned about the painting's normal by an angle in radians, from +X to +Y."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1)


@dataclass(frozen=True)
class Lights:
    """The lights of a capture, one per photograph.

    Parameters
    ----------
    names : tuple of str
        One name per light: the photograph's file name without its ending, or the light's number.
    direction : ndarray of shape (L, 3), float64
        Unit vectors from the centre of the painting towards each light.
    position_mm : ndarray of shape (L, 3), float64
        Positions in the painting's frame; NaN where the light is treated as infinitely far away.
    intensity : ndarray of shape (L, C), float64
        Relative irradiance at the centre of the painting on a surface that faces the light, per channel;
        C is 1 where the channels share it.
    angular_size_deg : ndarray of shape (L,), float64
        Angular diameter of the source seen from the painting; NaN where unknown.
    """

    names: tuple[str, ...]
    direction: Array
    position_mm: Array = field(default=None)  # type: ignore[arg-type]
    intensity: Array = field(default=None)  # type: ignore[arg-type]
    angular_size_deg: Array = field(default=None)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        count = len(self.names)
        defaults = {
            "direction": self.direction,
            "position_mm": np.full((count, 3), np.nan) if self.position_mm is None else self.position_mm,
            "intensity": np.ones((count, 1)) if self.intensity is None else self.intensity,
            "angular_size_deg": np.full(count, np.nan)
            if self.angular_size_deg is None
            else self.angular_size_deg,
        }
        for name, value in defaults.items():
            object.__setattr__(self, name, np.ascontiguousarray(value, dtype=np.float64))
        object.__setattr__(self, "names", tuple(self.names))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def near(self) -> bool:
        """Whether any light stands at a finite distance."""
        return bool(np.isfinite(self.position_mm).any())

    def irradiance(self, position_mm: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Return the irradiance of surfaces that face the lights.

        Parameters
        ----------
        position_mm : ndarray of shape (P, 2), optional
            Where they lie on the painting, X and Y; by default, at its centre.

        Returns
        -------
        ndarray of shape (L, P or 1, C), float32
            Intensity, and for lights at a finite distance their fall-off |p|² / |p − x|².
        """
        intensity = self.intensity[:, None, :].astype(np.float32)
        if position_mm is None or not self.near:
            return intensity
        place = np.pad(np.asarray(position_mm, np.float64), ((0, 0), (0, 1)))
        squares = np.square(self.position_mm[:, None, :] - place).sum(axis=-1)
        falloff = np.square(self.position_mm).sum(axis=-1)[:, None] / squares
        falloff[~np.isfinite(self.position_mm).all(axis=1)] = 1.0
        result: NDArray[np.float32] = intensity * falloff[:, :, None].astype(np.float32)
        return result

    def select(self, index: ArrayLike | slice) -> Lights:
        """Return the lights at `index` (integers, a slice or a boolean mask), in that order."""
        rows = np.arange(len(self))[index if isinstance(index, slice) else np.asarray(index)]
        return Lights(
            names=tuple(self.names[row] for row in rows),
            direction=self.direction[rows],
            position_mm=self.position_mm[rows],
            intensity=self.intensity[rows],
            angular_size_deg=self.angular_size_deg[rows],
        )


def join_lights(parts: Sequence[Lights]) -> Lights:
    """Return lights, at least one part, as a whole."""
    channels = max(part.intensity.shape[1] for part in parts)
    return Lights(
        names=tuple(name for part in parts for name in part.names),
        direction=np.concatenate([part.direction for part in parts]),
        position_mm=np.concatenate([part.position_mm for part in parts]),
        intensity=np.concatenate([np.broadcast_to(part.intensity, (len(part), channels)) for part in parts]),
        angular_size_deg=np.concatenate([part.angular_size_deg for part in parts]),
    )


@dataclass(frozen=True)
class Camera:
    """Where the camera stands.

    Parameters
    ----------
    view_direction : ndarray of shape (3,), float64
        Unit vector from the centre of the painting towards the camera.
    distance_mm : float or None
        Distance of the camera from the centre; None for an orthographic camera.
    mm_per_px : float or None
        Size of a pixel on the painting; needed where a light or the camera is at a finite distance.
    """

    view_direction: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    distance_mm: float | None = None
    mm_per_px: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "view_direction", np.ascontiguousarray(self.view_direction, dtype=np.float64)
        )


def rows_and_columns(rows: slice, columns: slice) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the row and the column of each pixel of a tile, rows first, as two arrays of shape (N,)."""
    row, column = np.arange(rows.start, rows.stop), np.arange(columns.start, columns.stop)
    return np.repeat(row, len(column)), np.tile(column, len(row))


def pixel_position_mm(
    rows: slice, columns: slice, height: int, width: int, mm_per_px: float
) -> NDArray[np.float32]:
    """Return where the pixels of a tile lie on the painting.

    Parameters
    ----------
    rows, columns : slice
        The tile, with start and stop.
    height, width : int
        Size of the whole image in pixels.
    mm_per_px : float
        Size of a pixel on the painting.

    Returns
    -------
    ndarray of shape (rows * columns, 2), float32
        X and Y in mm of each pixel's centre, rows first; row 0 is the top of the painting.
    """
    row, column = rows_and_columns(rows, columns)
    return position_mm(row, column, height, width, mm_per_px)


def position_mm(
    row: ArrayLike, column: ArrayLike, height: int, width: int, mm_per_px: float
) -> NDArray[np.float32]:
    """Return where pixels (...) lie on the painting, as (..., 2); see `pixel_position_mm`."""
    x = (np.asarray(column) - (width - 1) / 2) * mm_per_px
    y = -(np.asarray(row) - (height - 1) / 2) * mm_per_px
    return np.stack([x, y], axis=-1).astype(np.float32)
