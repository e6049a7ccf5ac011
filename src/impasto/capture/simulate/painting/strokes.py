"""Paint laid stroke by stroke: each stroke leaves relief, colour and its paint's surface behind."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.painting.paints import INDEX, PAINTS
from impasto.capture.simulate.painting.relief import Grid, smoothstep

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stroke:
    """One stroke of a brush or a palette knife.

    Parameters
    ----------
    place : tuple of float
        Its middle in studio mm (x, y down) and its direction in radians, from x towards y.
    size : tuple of float
        Length, width, and the thickness of the paint left behind, studio mm.
    paint : str
        The paint that decides the surface and the material index.
    colours : tuple of ndarray of shape (3,)
        Two albedos that the bristles carry, not quite mixed.
    bend : float
        How far its ends turn to one side, studio mm.
    dryness : float
        0 for a loaded brush; near 1 the bristles skip towards the end.
    taper : float
        How much of its width a stroke loses towards its ends, 0 to 1; leaves and petals taper.
    knife : bool
        A palette knife: a flat layer with ridges pushed up at its edges.
    """

    place: tuple[float, float, float]
    size: tuple[float, float, float]
    paint: str
    colours: tuple[Array, Array]
    bend: float = 0.0
    dryness: float = 0.2
    taper: float = 0.0
    knife: bool = False

    @property
    def length(self) -> float:
        """Its length, studio mm."""
        return self.size[0]

    @property
    def width(self) -> float:
        """Its width, studio mm."""
        return self.size[1]

    @property
    def thickness(self) -> float:
        """The thickness of its paint, studio mm."""
        return self.size[2]


@dataclass
class PaintLayer:
    """What has been painted so far.

    Parameters
    ----------
    grid : Grid
    relief : ndarray of shape (H, W), float32, mm
        The support's relief, on which strokes pile up.
    """

    grid: Grid
    relief: NDArray[np.float32]
    albedo: NDArray[np.float32] = field(init=False)
    log_alpha: NDArray[np.float32] = field(init=False)
    kappa: NDArray[np.float32] = field(init=False)
    material: NDArray[np.uint8] = field(init=False)
    count: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        size = (self.grid.height, self.grid.width)
        ground = PAINTS[INDEX["ground"]]
        self.albedo = np.full((*size, 3), ground.albedo, np.float32)
        self.log_alpha = np.full(size, np.log(ground.alpha), np.float32)
        self.kappa = np.full(size, ground.kappa, np.float32)
        self.material = np.full(size, INDEX["ground"], np.uint8)

    def lay(self, stroke: Stroke, seed: int) -> None:
        """Lay one stroke; its bristles are drawn from `seed` and the number of strokes before it."""
        rng = np.random.default_rng((seed, self.count))
        self.count += 1
        window = self._window(stroke)
        if window is None:
            return
        along, across = self._stroke_frame(stroke, window)
        inside = (np.abs(along) <= 1) & (np.abs(across) <= 1)
        shape = _knife if stroke.knife else _brush
        cover, profile, streak = shape(stroke, self.grid, along[inside], across[inside], rng)
        weight = float(cover.sum())
        if weight == 0:
            return
        paint = PAINTS[INDEX[stroke.paint]]
        relief = self.relief[window][inside]
        # Paint fills the hollows of what lies under it, about halfway.
        level = float((cover * relief).sum()) / weight
        self.relief[window][inside] += cover * (0.55 * (level - relief) + profile)
        colour = stroke.colours[0] + streak[:, None] * (stroke.colours[1] - stroke.colours[0])
        for layer, target in (
            (self.albedo[window], colour),
            (self.log_alpha[window], np.log(paint.alpha)),
            (self.kappa[window], paint.kappa),
        ):
            under = layer[inside]
            share = cover[:, None] if layer.ndim == 3 else cover
            layer[inside] = under + share * (target - under)
        inside[inside] = cover > 0.5
        self.material[window][inside] = INDEX[stroke.paint]

    def _window(self, stroke: Stroke) -> tuple[slice, slice] | None:
        """Return the pixels that the stroke can touch, or None outside the painting."""
        pitch = self.grid.pitch_mm
        x, y, angle = stroke.place
        cos, sin = abs(np.cos(angle)), abs(np.sin(angle))
        half_length, half_width = stroke.length / 2, stroke.width / 2 + abs(stroke.bend)
        reach_x = cos * half_length + sin * half_width
        reach_y = sin * half_length + cos * half_width
        limits = []
        for centre, reach, origin, size in (
            (y, reach_y, self.grid.y[0], self.grid.height),
            (x, reach_x, self.grid.x[0], self.grid.width),
        ):
            first = max(0, int(np.floor((centre - reach - origin) / pitch)))
            last = min(size, int(np.ceil((centre + reach - origin) / pitch)) + 1)
            if first >= last:
                return None
            limits.append(slice(first, last))
        return limits[0], limits[1]

    def _stroke_frame(self, stroke: Stroke, window: tuple[slice, slice]) -> tuple[Array, Array]:
        """Return each pixel's place along and across the stroke, -1 to 1 within it."""
        x0, y0, angle = stroke.place
        x = self.grid.x[window[1]][None, :] - x0
        y = self.grid.y[window[0]][:, None] - y0
        cos, sin = np.cos(angle), np.sin(angle)
        along = (cos * x + sin * y) / (stroke.length / 2)
        half_width = stroke.width / 2 * (1 - stroke.taper * np.clip(along**2, 0, 1) * 0.95)
        across = (cos * y - sin * x - stroke.bend * along**2) / half_width
        return along, across


def _brush(
    stroke: Stroke, grid: Grid, along: Array, across: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return a brush stroke's cover (0 to 1), relief in mm and share of the streak colour."""
    bristle_mm = max(0.42, 2.4 * grid.pitch_mm)
    marks = np.linspace(-1, 1, max(4, int(stroke.width / bristle_mm)) + 1)
    # Drawn for the finest brush and cut short, so that the stroke does not change with the pixels' size.
    depth, reach, colour = (rng.standard_normal(64)[: marks.size] for _ in range(3))
    bristle = np.interp(across, marks, depth)
    end = 1 - 0.22 * np.abs(np.interp(across, marks, reach)) * min(1.0, stroke.width / stroke.length * 2)
    soft_mm = max(0.30, 1.2 * grid.pitch_mm)
    side = smoothstep(0, 2 * soft_mm / stroke.width, 1 - np.abs(across))
    lift = smoothstep(0, 4 * soft_mm / stroke.length, end - along)
    touch = smoothstep(0, 4 * soft_mm / stroke.length, end + along)
    skip = smoothstep(-0.6, 0.6, bristle + 2.4 - 3.4 * stroke.dryness * (along + 1))
    cover = side * lift * touch * skip
    ridge = np.exp(-(((np.abs(across) - 0.82) / 0.16) ** 2))
    lip = np.exp(-(((end - along - 0.10) / 0.10) ** 2))
    wane = 1 - 0.35 * along
    profile = stroke.thickness * wane * (0.55 + 0.26 * bristle * (1 - 0.5 * lip) + 0.30 * ridge + 0.35 * lip)
    streak = np.clip(0.5 + 0.45 * np.interp(across, marks, colour) - 0.15 * along, 0, 1)
    return cover, profile, streak


def _knife(
    stroke: Stroke, grid: Grid, along: Array, across: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return a palette knife's cover, relief in mm and share of the streak colour."""
    lean = rng.choice([-1.0, 1.0])
    marks = np.linspace(-1, 1, 25)
    drag, reach, colour = (rng.standard_normal(marks.size) for _ in range(3))
    end = 1 - 0.03 * np.abs(np.interp(across, marks, reach)) - 0.10 * lean * across
    soft_mm = max(0.22, 1.1 * grid.pitch_mm)
    side = smoothstep(0, 2 * soft_mm / stroke.width, 1 - np.abs(across))
    cover = side * smoothstep(0, 3 * soft_mm / stroke.length, end - np.abs(along))
    ridge = np.exp(-(((lean * across - 0.90) / 0.07) ** 2)) + 0.5 * np.exp(
        -(((end - along - 0.05) / 0.05) ** 2)
    )
    profile = stroke.thickness * (0.75 + 0.5 * lean * across * 0.6 + 0.9 * ridge)
    profile = profile + 0.05 * stroke.thickness * np.interp(across, marks, drag)
    streak = np.clip(0.4 + 0.6 * np.interp(across, marks, colour), 0, 1) * smoothstep(-1.2, 1.0, along)
    return cover, profile, streak
