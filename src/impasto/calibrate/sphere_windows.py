"""What photographs show of mirror spheres, cut out of them, so that one at a time need be in memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.mirror import Rays, Sphere, sphere_window
from impasto.calibrate.shots import Shot


@dataclass(frozen=True)
class SphereWindow:
    """What all photographs show of one sphere.

    Parameters
    ----------
    rows, columns : slice
        Where it lies in them.
    level : ndarray of shape (L, rows, columns), float32
        Relative radiance, mean over the channels.
    clipped : ndarray of shape (L, rows, columns), bool
        Whether any channel is clipped.
    """

    rows: slice
    columns: slice
    level: NDArray[np.float32]
    clipped: NDArray[np.bool_]

    def background(self) -> NDArray[np.float32]:
        """Return what is seen whatever lamp is lit, shape (rows, columns)."""
        if len(self.level) < 2:
            return np.zeros_like(self.level[0])
        if len(self.level) == 2:
            return np.asarray(self.level.min(axis=0))
        # Row by row, because a median copies what it is of.
        return np.stack([np.median(self.level[:, row], axis=0) for row in range(self.level.shape[1])])


def cut_out(shots: Iterable[Shot], count: int, spheres: Sequence[Sphere], rays: Rays) -> list[SphereWindow]:
    """Return what photographs, so many of them, show of each sphere; each is read from `shots` once."""
    windows = []
    for sphere in spheres:
        rows, columns = sphere_window(sphere, rays.height, rays.width)
        shape = (count, rows.stop - rows.start, columns.stop - columns.start)
        windows.append(SphereWindow(rows, columns, np.empty(shape, np.float32), np.empty(shape, bool)))
    for light, shot in enumerate(shots):
        for window in windows:
            part = shot.part((window.rows, window.columns))
            window.level[light] = part.luminance()
            window.clipped[light] = part.clipped.any(axis=2)
    return windows
