"""Smooth surfaces over the frame: how bright an even card is, or the dark, on a coarse grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRID = (33, 49)
"""Rows and columns of the grid, whose outer nodes lie on the frame's outer pixels."""

# Cells whose means the surface follows.
_CELLS = (40, 60)
# A speck of dust differs from its neighbours by this many standard deviations.
_SPECK = 5.0


def nodes(height: int, width: int) -> tuple[Array, Array]:
    """Return the rows and columns, in pixels, on which the grid's nodes lie."""
    return np.linspace(0, height - 1, GRID[0]), np.linspace(0, width - 1, GRID[1])


def smooth_surface(image: NDArray[np.floating]) -> tuple[Array, Array]:
    """Smooth an image of something even.

    Parameters
    ----------
    image : ndarray of shape (H, W, C)

    Returns
    -------
    grid : ndarray of shape (rows, columns, C)
        The surface on the nodes of the grid.
    residual : ndarray of shape (C,)
        Root mean square relative difference of the cells' means from it; infinite for an image that no smooth
        surface follows, whose mean stands for one.
    """
    from scipy.interpolate import RectBivariateSpline  # long to import, and not used to apply a surface

    height, width, channels = image.shape
    rows, columns = (
        np.linspace(0, length, min(cells, length) + 1).astype(int)
        for length, cells in zip((height, width), _CELLS, strict=True)
    )
    sums = np.add.reduceat(np.add.reduceat(image, rows[:-1], axis=0, dtype=np.float64), columns[:-1], axis=1)
    means = sums / (np.diff(rows)[:, None, None] * np.diff(columns)[None, :, None])
    y, x = ((edges[:-1] + edges[1:] - 1) / 2 for edges in (rows, columns))
    grid, residual = [], []
    for channel in range(channels):
        cells = means[..., channel]
        noise = _noise(cells)
        degree = min(3, len(y) - 1), min(3, len(x) - 1)
        try:
            for _ in range(2):
                spline = RectBivariateSpline(
                    y, x, cells, kx=degree[0], ky=degree[1], s=cells.size * noise**2,
                    bbox=[0, height - 1, 0, width - 1],
                )  # fmt: skip
                off = cells - spline(y, x)
                # Dust and scratches are the card's and not the light's.
                cells = np.where(np.abs(off) > _SPECK * max(noise, 1e-12), spline(y, x), cells)
        except ValueError:
            grid.append(np.full(GRID, cells.mean()))
            residual.append(np.inf)
            continue
        grid.append(spline(*nodes(height, width)))
        level = max(float(np.abs(means[..., channel]).mean()), 1e-12)
        residual.append(float(np.sqrt(np.mean((means[..., channel] - spline(y, x)) ** 2))) / level)
    return np.stack(grid, axis=-1), np.array(residual)


def over_frame(grid: Array, height: int, width: int) -> NDArray[np.float32]:
    """Interpolate a grid (rows, columns, C) linearly over a frame, ndarray of shape (H, W, C)."""
    surface = grid.astype(np.float32)
    for axis, length in enumerate((height, width)):
        place = np.linspace(0, grid.shape[axis] - 1, length, dtype=np.float32)
        before = np.minimum(place.astype(int), grid.shape[axis] - 2)
        share = np.expand_dims(place - before, [other for other in range(3) if other != axis])
        surface = (1 - share) * surface.take(before, axis) + share * surface.take(before + 1, axis)
    return surface


def _noise(cells: Array) -> float:
    """Return the standard deviation of a cell's mean, from third differences, which smooth light lacks."""
    if min(cells.shape) < 5:
        return 1e-6 * float(np.abs(cells).max() + 1e-12)
    third = np.diff(np.diff(cells, 2, axis=0)[:, :], 2, axis=1)
    # Variance of the difference of four, each weighted 1, -2, 1: 36 times the cell's.
    return float(np.median(np.abs(third)) / 0.6745 / 6) + 1e-9 * float(np.abs(cells).max())
