"""The paintings that can be simulated: a still life, a chart of swatches, and the paper's eight samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.materials import SHAPES
from impasto.capture.simulate.measured import MeasuredSet
from impasto.capture.simulate.painting import relief
from impasto.capture.simulate.painting.paints import INDEX, PAINTS
from impasto.capture.simulate.painting.relief import Grid, smooth_noise, smoothstep
from impasto.capture.simulate.painting.still_life import paint_still_life
from impasto.capture.simulate.painting.strokes import PaintLayer
from impasto.capture.simulate.surface import Material, Surface, make_surface

Array = NDArray[np.float64]

# How heavily the still life's paint stands: the median slope comes to about 6°.
_BODY = 0.85
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Sample:
    """One of the paper's samples as we allot it.

    Parameters
    ----------
    gloss : str
        The paper's gloss level.
    support : str
        ``smooth``, ``glass``, ``canvas`` or ``brush marks``; the allotment is ours.
    alpha : float
        Facet width, ours, after the gloss level and, for (a), the glossmeter's readings.
    ratio : float
        As/Ad of the Torrance-Sparrow model [Chen2007]_, Table II.
    hue : tuple of float
        Colour of the paint, ours; its luminance follows from `alpha` and `ratio`.
    measured : str
        Measured material that stands in for the paint.
    interface : bool
        Whether the smooth interface lies over the measured material; the duller ones have their own lobe.
    """

    gloss: str
    support: str
    alpha: float
    ratio: float
    hue: tuple[float, float, float]
    measured: str
    interface: bool = False

    @property
    def albedo(self) -> Array:
        """The albedo that has the paper's As/Ad in luminance, with As = 1/(4 alpha²)."""
        hue = np.array(self.hue)
        return np.asarray(hue / (LUMINANCE @ hue) / (4 * self.alpha**2 * self.ratio))


SAMPLES: dict[str, Sample] = {
    "a": Sample("high", "smooth", 0.0172, 5793.6, (0.10, 0.40, 0.62), "merl/blue-rubber", True),
    "b": Sample("low", "canvas", 0.50, 3.8, (0.50, 0.14, 0.08), "merl/dark-red-paint"),
    "c": Sample("medium", "glass", 0.035, 1712.9, (0.62, 0.07, 0.05), "rgl/vch_dragon_eye_red"),
    "d": Sample("low", "brush marks", 0.30, 17.8, (0.12, 0.20, 0.08), "merl/green-latex"),
    "e": Sample("medium", "canvas", 0.10, 142.6, (0.06, 0.16, 0.46), "merl/blue-acrylic"),
    "f": Sample("low", "brush marks", 0.45, 4.3, (0.45, 0.25, 0.12), "merl/beige-fabric"),
    "g": Sample("high", "brush marks", 0.0172, 1752.1, (0.50, 0.49, 0.45), "rgl/paper_white", True),
    "h": Sample("medium", "canvas", 0.05, 560.9, (0.34, 0.12, 0.40), "merl/violet-acrylic"),
}


@dataclass(frozen=True)
class Order:
    """What to paint.

    Parameters
    ----------
    grid : Grid
    seed : int
    model : str
        The model of the specular reflection; ``mixed`` gives the paints different ones in turn.
    measured : MeasuredSet or None
        Measured materials, to take the place of the paints' own reflectance.
    mm_per_px : float
    relief_scale : float
    """

    grid: Grid
    seed: int
    model: str
    measured: MeasuredSet | None
    mm_per_px: float
    relief_scale: float

    def rng(self, purpose: int) -> np.random.Generator:
        """Return the random numbers of one purpose."""
        return np.random.default_rng((self.seed, 100 + purpose))


def paint_sample(order: Order, sample: Sample) -> Surface:
    """Return one of the paper's samples: one paint, evenly applied on its support."""
    grid, rng = order.grid, order.rng(0)
    if sample.support == "canvas":
        height = relief.weave(grid, rng, depth_mm=0.05) + relief.waviness(grid, rng, 9.0, 1.5)
    elif sample.support == "brush marks":
        height = relief.brushed(grid, rng, 5.0) + relief.waviness(grid, rng, 9.0, 1.0)
    else:
        scale_mm, tilt_deg = (35.0, 0.3) if sample.support == "glass" else (9.0, 1.5)
        height = relief.waviness(grid, rng, scale_mm, tilt_deg)
    shade = np.exp(0.04 * smooth_noise(grid, 12.0, rng) + 0.02 * smooth_noise(grid, 2.0, rng))
    alpha = sample.alpha * np.exp(0.04 * smooth_noise(grid, 25.0, rng))
    kappa = np.ones_like(alpha)
    albedo = shade[..., None] * sample.albedo
    measured = None
    if order.measured is not None:
        measured = sample.measured
        kappa *= sample.interface
        albedo = shade[..., None] * order.measured.radiance_factor(measured)
    material = Material(f"sample paint, {sample.gloss} gloss", _models(order.model)[0], measured=measured)
    return _surface(order, height, albedo, alpha, kappa, np.zeros(alpha.shape, np.uint8), (material,))


def still_life(order: Order) -> Surface:
    """Return a small still life in oil on canvas, cracked, varnished unevenly, and retouched in one place."""
    from scipy.ndimage import gaussian_filter  # slow to import

    grid = order.grid
    layer = PaintLayer(grid, relief.weave(grid, order.rng(0)).astype(np.float32))
    paint_still_life(layer, order.seed)
    height = _BODY * layer.relief.astype(np.float64)
    x, y = grid.x[None, :], grid.y[:, None]
    # Age cracks, strongest in the upper left and gone in the fresh impasto of the lower right.
    rng = order.rng(1)
    aged = smoothstep(-0.1, 0.9, 0.25 - (x + 0.6 * y) / 70 + 0.35 * smooth_noise(grid, 18.0, rng))
    cracks, dirt = relief.craquelure(grid, rng)
    height += aged * cracks
    # Wet paint levels: nothing survives below about a tenth of a millimetre.
    height = gaussian_filter(height, 0.11 / grid.pitch_mm + 0.3)
    albedo = layer.albedo * np.asarray(1 - 0.6 * aged * dirt)[..., None]
    # The varnish pools and thins out; where it is thick its own smooth surface shows, else the paint's.
    rng = order.rng(2)
    cover = np.clip(0.55 + 0.30 * smooth_noise(grid, 22.0, rng) + 0.0022 * y, 0.08, 0.95)
    varnish_alpha = 0.085 * np.exp(0.28 * smooth_noise(grid, 26.0, rng))
    gilded = layer.material == INDEX["shell gold"]
    cover = np.where(gilded, 0.25 * cover, cover)
    # A matte retouching that nearly matches in colour and gives itself away in the highlight.
    blot = np.hypot(x - 37.0, 1.25 * (y - 5.0)) + 1.6 * smooth_noise(grid, 4.0, rng)
    retouch = 1 - smoothstep(6.0, 7.2, blot)
    cover = cover * (1 - retouch)
    fresh = PAINTS[INDEX["retouching"]]
    albedo += (0.55 * retouch)[..., None] * (np.array(fresh.albedo) - albedo)
    log_alpha = layer.log_alpha + retouch * (np.log(fresh.alpha) - layer.log_alpha)
    bare = layer.kappa + retouch * (fresh.kappa - layer.kappa)
    material = np.where(retouch > 0.5, np.uint8(INDEX["retouching"]), layer.material)
    alpha = np.exp((1 - cover) * log_alpha + cover * np.log(varnish_alpha))
    # Over a measured paint, whose own surface is in the measurement, only the varnish adds a lobe.
    kappa = cover.copy() if order.measured else bare * (1 - cover) + cover
    models = _models(order.model)
    materials = tuple(
        Material(
            paint.name, models[index % len(models)], paint.tint, paint.measured if order.measured else None
        )
        for index, paint in enumerate(PAINTS)
    )
    return _surface(order, height, albedo, alpha, kappa, material, materials)


def swatches(order: Order) -> Surface:
    """Return a chart of c, 0.02 to 0.9 in ten columns of equal ratios, by six paints, on a gentle relief."""
    grid = order.grid
    names = ("lead white", "lead-tin yellow", "vermilion", "terre verte", "ultramarine", "ivory black")
    widths = np.geomspace(0.02, 0.9, 10)
    column = np.clip((np.arange(grid.width) * 10) // grid.width, 0, 9)
    row = np.clip((np.arange(grid.height) * 6) // grid.height, 0, 5)
    alpha = np.broadcast_to(widths[column][None, :], (grid.height, grid.width)).astype(np.float64)
    material = np.broadcast_to(row[:, None], alpha.shape).astype(np.uint8)
    albedo = np.array([PAINTS[INDEX[name]].albedo for name in names])[material]
    models = _models(order.model)
    materials = tuple(
        Material(
            name, models[n % len(models)], measured=PAINTS[INDEX[name]].measured if order.measured else None
        )
        for n, name in enumerate(names)
    )
    height = relief.waviness(grid, order.rng(0), 3.0, 6.0)
    return _surface(order, height, albedo, alpha, np.ones_like(alpha), material, materials)


def _models(model: str) -> tuple[str, ...]:
    return tuple(name for name in SHAPES if name != "lambert") if model == "mixed" else (model,)


def _surface(
    order: Order, height: Array, albedo: Array, alpha: Array, kappa: Array, material: NDArray[np.uint8],
    materials: tuple[Material, ...],
) -> Surface:  # fmt: skip
    """Return the surface; where materials are measured, its diffuse map holds their radiance factors."""
    surface = make_surface(
        height, albedo, alpha, kappa, material, materials,
        pitch_mm=order.grid.pitch_mm, mm_per_px=order.mm_per_px, relief_scale=order.relief_scale,
    )  # fmt: skip
    if order.measured is None:
        return surface
    factors = np.array([order.measured.radiance_factor(entry.measured or "") for entry in materials])
    diffuse = factors[material] * surface.strength[..., None]
    return replace(surface, diffuse=diffuse.astype(np.float32))


PRESETS: Mapping[str, Callable[[Order], Surface]] = {"still-life": still_life, "swatches": swatches}
