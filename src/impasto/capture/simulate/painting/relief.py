"""Relief of simulated paintings: height maps in mm and the normals that belong to them.

Features are laid out in *studio millimetres*, in which the short side of every painting measures 100 mm, so
that a painting keeps its design at any number of pixels. Features finer than the pixels can carry fade out
instead of aliasing. Rows run downwards, so y here points down the painting; only `normals` turns it up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Map = NDArray[np.float32]

SHORT_SIDE_MM = 100.0


@dataclass(frozen=True)
class Grid:
    """The pixels of a painting in studio millimetres.

    Parameters
    ----------
    height, width : int
        Size in pixels.
    """

    height: int
    width: int

    @property
    def pitch_mm(self) -> float:
        """Studio millimetres per pixel."""
        return SHORT_SIDE_MM / min(self.height, self.width)

    @property
    def x(self) -> Array:
        """Columns' centres, ndarray of shape (W,), studio mm from the painting's centre, to the right."""
        return np.asarray((np.arange(self.width) - (self.width - 1) / 2) * self.pitch_mm, dtype=np.float64)

    @property
    def y(self) -> Array:
        """Rows' centres, ndarray of shape (H,), studio mm from the painting's centre, downwards."""
        return np.asarray((np.arange(self.height) - (self.height - 1) / 2) * self.pitch_mm, dtype=np.float64)

    def carries(self, period_mm: float) -> float:
        """Return how much of a feature of this period the pixels carry: 0 below 2 px, 1 above 4 px."""
        return float(np.clip(period_mm / self.pitch_mm / 2 - 1, 0, 1))


def smoothstep(low: float, high: float, x: Array) -> Array:
    """Return the cubic step from 0 at `low` to 1 at `high`."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def smooth_noise(grid: Grid, scale_mm: float, rng: np.random.Generator, aspect: float = 1.0) -> Array:
    """Return smooth noise of mean 0 and variance about 1, the same at any number of pixels.

    Parameters
    ----------
    grid : Grid
    scale_mm : float
        Spacing of the random lattice along y, in studio mm.
    rng : numpy.random.Generator
    aspect : float
        The spacing along x is `aspect` times that along y.

    Returns
    -------
    ndarray of shape (H, W), float64

    Notes
    -----
    A cubic B-spline with random coefficients; as it is separable, one product of three matrices makes it.
    """
    rows, columns = _spline_basis(grid.y, scale_mm), _spline_basis(grid.x, scale_mm * aspect)
    lattice = rng.standard_normal((rows.shape[1], columns.shape[1]))
    # A cubic B-spline's squared coefficients sum to 151/315 on average over its phase, per axis.
    return np.asarray(rows @ lattice @ columns.T / (151 / 315))


def _spline_basis(positions: Array, spacing: float) -> Array:
    """Return the cubic B-spline weights of each position, ndarray of shape (N, lattice points)."""
    knot = (positions - positions[0] + spacing / 2) / spacing
    distance = np.abs(knot[:, None] - np.arange(-1, int(np.ceil(knot[-1])) + 2)[None, :])
    inner = 2 / 3 - distance**2 + distance**3 / 2
    outer = np.clip(2 - distance, 0, None) ** 3 / 6
    return np.asarray(np.where(distance < 1, inner, outer))


def weave(grid: Grid, rng: np.random.Generator, pitch_mm: float = 0.95, depth_mm: float = 0.09) -> Array:
    """Return the relief of a plain-woven canvas, ndarray of shape (H, W), mm.

    Parameters
    ----------
    grid : Grid
    rng : numpy.random.Generator
        Bends the threads a little.
    pitch_mm : float
        Distance between threads.
    depth_mm : float
        Height of a thread's back over the hollows.
    """
    bend = 0.18 * pitch_mm
    x = grid.x[None, :] + bend * smooth_noise(grid, 6.0, rng) + bend * smooth_noise(grid, 40.0, rng)
    y = grid.y[:, None] + bend * smooth_noise(grid, 6.0, rng) + bend * smooth_noise(grid, 40.0, rng)
    warp, weft = np.sin(np.pi * x / pitch_mm), np.sin(np.pi * y / pitch_mm)
    over = 0.5 + 0.5 * warp * weft
    threads = np.maximum(warp**2 * (0.35 + 0.65 * over), weft**2 * (1 - 0.65 * over))
    thickness = 1 + 0.15 * smooth_noise(grid, 2.0, rng, aspect=8.0)
    return depth_mm * grid.carries(pitch_mm) * threads * thickness


def waviness(grid: Grid, rng: np.random.Generator, scale_mm: float, tilt_deg: float) -> Array:
    """Return gentle undulation whose slopes have the given root mean square per axis, (H, W), mm."""
    field = smooth_noise(grid, scale_mm, rng)
    slope = np.sqrt(np.mean([np.mean(axis**2) for axis in np.gradient(field, grid.pitch_mm)]))
    return np.asarray(field * np.tan(np.radians(tilt_deg)) / slope)


def brushed(grid: Grid, rng: np.random.Generator, tilt_deg: float) -> Array:
    """Return the parallel furrows of a broad brush drawn along x, ndarray of shape (H, W), mm."""
    drift = 0.8 * smooth_noise(grid, 30.0, rng)
    furrows = smooth_noise(grid, 0.8, rng, aspect=25.0) + 1.5 * smooth_noise(grid, 2.4, rng, aspect=12.0)
    slope = np.gradient(furrows, grid.pitch_mm, axis=0).std()
    return np.asarray(furrows * np.tan(np.radians(tilt_deg)) / slope + 0.02 * drift)


def craquelure(grid: Grid, rng: np.random.Generator, spacing_mm: float = 6.5) -> tuple[Array, Array]:
    """Return an age-crack network: relief in mm and the cracks' darkness, each of shape (H, W).

    Parameters
    ----------
    grid : Grid
    rng : numpy.random.Generator
    spacing_mm : float
        Mean size of an island of paint.

    Returns
    -------
    relief : ndarray of shape (H, W), float64, mm
        Negative in the cracks; the islands' edges cup up.
    darkness : ndarray of shape (H, W), float64
        1 in the middle of a crack, 0 on the islands.

    Notes
    -----
    Cracks are the borders between the cells of scattered points [Worley1996]_, the plane bent first so that
    they do not run straight.
    """
    from scipy.spatial import cKDTree  # slow to import

    x = grid.x[None, :] + 1.2 * smooth_noise(grid, 5.0, rng) + 0.35 * smooth_noise(grid, 1.5, rng)
    y = grid.y[:, None] + 1.2 * smooth_noise(grid, 5.0, rng) + 0.35 * smooth_noise(grid, 1.5, rng)
    margin = 2 * spacing_mm
    low = np.array([grid.x[0] - margin, grid.y[0] - margin])
    high = np.array([grid.x[-1] + margin, grid.y[-1] + margin])
    cells = rng.uniform(low, high, size=(int(np.prod((high - low) / spacing_mm)), 2))
    near = cKDTree(cells).query(np.stack([x, y], axis=-1).reshape(-1, 2), k=2)[0].reshape(*x.shape, 2)
    border = near[..., 1] - near[..., 0]
    crack_mm = max(0.35, 1.6 * grid.pitch_mm)
    darkness = 1 - smoothstep(0.2 * crack_mm, 1.2 * crack_mm, border)
    cupping = np.exp(-border / 1.2)
    return 0.05 * cupping - 0.13 * darkness, darkness


def normals(height_mm: NDArray[np.floating], mm_per_px: float) -> Map:
    """Return the normals of a height map in the painting's frame (X right, Y up, Z to the viewer).

    Parameters
    ----------
    height_mm : ndarray of shape (H, W), mm
    mm_per_px : float

    Returns
    -------
    ndarray of shape (H, W, 3), float32
        Unit vectors, from central differences of the heights (one-sided at the borders).
    """
    down, right = np.gradient(np.asarray(height_mm, dtype=np.float64), mm_per_px)
    normal = np.stack([-right, down, np.ones_like(right)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return normal.astype(np.float32)
