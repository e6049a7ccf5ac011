"""Lights in one plane, as on the paper's arm: which plane, and the frame in which it is the XZ plane."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.geometry import Array, Camera, Lights, turn_about_z

PLANE_TOLERANCE_DEG = 2.0
"""How far a light may stand from the arm's plane, which contains the painting's normal, to count as in it."""


@dataclass(frozen=True)
class Arm:
    """The plane through the painting's normal that lights are nearest to.

    Parameters
    ----------
    azimuth : float
        Of the plane, from +X towards +Y, radians in (−π/2, π/2].
    off_plane : float
        Largest angle of a light from it, radians.
    off_own_plane : float
        Largest angle of a light from the plane that suits them best, whether or not it contains the normal.
    """

    azimuth: float
    off_plane: float
    off_own_plane: float

    @property
    def planar(self) -> bool:
        """Whether the lights lie in the plane."""
        return bool(np.degrees(self.off_plane) <= PLANE_TOLERANCE_DEG)

    def into(self, direction: ArrayLike) -> Array:
        """Turn directions (..., 3) about Z so that the plane becomes XZ."""
        return turn_about_z(np.asarray(direction, np.float64), -self.azimuth)

    def back(self, direction: NDArray[np.float32]) -> NDArray[np.float32]:
        """Turn directions (..., 3) back from the arm's frame to the painting's."""
        return turn_about_z(direction, self.azimuth).astype(np.float32)

    def lights(self, lights: Lights) -> Lights:
        """Return lights in the arm's frame, moved into its plane."""
        in_plane = self.into(lights.direction) * [1.0, 0.0, 1.0]
        return replace(lights, direction=in_plane / np.linalg.norm(in_plane, axis=-1, keepdims=True))

    def camera(self, camera: Camera) -> Camera:
        """Return a camera in the arm's frame."""
        return replace(camera, view_direction=self.into(camera.view_direction))


def find_arm(light_direction: ArrayLike) -> Arm:
    """Find the plane through the painting's normal that lights are nearest to.

    Parameters
    ----------
    light_direction : array_like of shape (L, 3)
        Unit vectors.

    Returns
    -------
    Arm
    """
    light_direction = np.asarray(light_direction, np.float64)
    across, along = np.linalg.eigh(light_direction[:, :2].T @ light_direction[:, :2])[1].T
    # The eigenvectors' signs are arbitrary; the arm's X is the one that does not point to the left.
    along = -along if (along[0], along[1]) < (0, 0) else along
    own_normal = np.linalg.svd(light_direction)[2][2]
    return Arm(
        azimuth=float(np.arctan2(along[1], along[0])),
        off_plane=_largest_angle(light_direction, np.append(across, 0.0)),
        off_own_plane=_largest_angle(light_direction, own_normal),
    )


def _largest_angle(direction: Array, plane_normal: Array) -> float:
    return float(np.arcsin(np.clip(np.abs(direction @ plane_normal).max(), 0.0, 1.0)))
