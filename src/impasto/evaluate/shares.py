"""Where the error on held-out photographs comes from: lights, shadows, noise, their number, the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.evaluate.criteria import unknowns
from impasto.evaluate.sampling import PaintingSample
from impasto.fit import FitOptions, fit_tile
from impasto.fit.remainder import usual_toe
from impasto.fit.robust import robust_fit
from impasto.fit.self_calibration import found_lights
from impasto.fit.trend import find_trend
from impasto.geometry import Array, Camera, Lights, join_lights
from impasto.light_distance import place_lights
from impasto.models import ModelSpec
from impasto.pixels import Pixels, near_positions_mm, pixels_of_maps, render_pixels
from impasto.residual import encode
from impasto.store import Fit, Maps, Stack

Values = NDArray[np.float32]
Mask = NDArray[np.bool_]

# Enough for sums over the painting, few enough to be fitted several times over.
_PIXELS = 4096

# Rounds of fitting the pixels and then the lights.
_ROUNDS = 4
_STEP = np.radians(0.5)
# Standard deviations of a light's log strength and of its two angles, and how many of them it may be off: a
# model that is wrong must not find its excuse in lights that stood somewhere else.
_PRIOR_SD = (0.3, np.radians(2.0), np.radians(2.0))
_MOST_SDS = 3.0
# What a model gets wrong is common to all pixels of a paint, so that samples count as no more than these.
_INDEPENDENT = 64

# A shadowed sample is darker than this share of the pixel's diffuse part alone, by so many sigmas of noise.
_SHADOW_SHARE = 0.5
_SHADOW_SIGMAS = 4.0


@dataclass(frozen=True)
class ErrorShares:
    """Whose the squared error on photographs is that a fit has not seen; the five shares add to 1.

    Parameters
    ----------
    model, lights, shadows, noise : float
    sampling : float
        Share of what the fitted photographs do not show, such as a highlight that only those held out do.
    photographs : int
        How many photographs they are from.
    pixels : int
        How many pixels they are from.
    samples : int
        How many samples of these photographs and pixels count, which are neither clipped nor missing.
    shadowed : float
        Share of the samples of all photographs that lie in a cast shadow.
    rms : float
        Root of the mean squared error, on the scale of `impasto.residual.encode`.
    """

    model: float
    lights: float
    shadows: float
    noise: float
    sampling: float
    photographs: int
    pixels: int
    samples: int
    shadowed: float
    rms: float


@dataclass(frozen=True)
class Photographed:
    """Pixels as they were photographed.

    Parameters
    ----------
    radiance : ndarray of shape (L, P, C), float32
        Relative radiance; NaN where a sample is missing.
    held_out : ndarray of shape (L,), bool
        Which photographs the fit has not seen; its error on them is to be divided.
    lights : Lights
        As they are known before the photographs held out are looked at, one per photograph.
    camera : Camera
    light_rgb, clip_level : ndarray of shape (C,)
    noise : tuple of float
        (read, photon, relative); see `store.Stack.noise`.
    row, column : ndarray of shape (P,), int
        Where the pixels lie.
    size : tuple of int
        Height and width of the painting.
    """

    radiance: Values
    held_out: Mask
    lights: Lights
    camera: Camera
    light_rgb: Array
    clip_level: Array
    noise: tuple[float, float, float]
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    size: tuple[int, int]
    toe: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "toe", usual_toe(self.radiance))

    @classmethod
    def of(cls, fitted: Fit, stack: Stack, held_out: Sequence[int]) -> Photographed:
        """Return up to 4096 pixels, spread over a painting, of a fit's photographs and of those held out.

        Lights of the fit are as it found them, in strength, direction and distance; those held out are as a
        rendering without a residual term has them.

        Raises
        ------
        StoreError
            If the stack or the fit is damaged.
        """
        sample = PaintingSample(stack, {fitted.attributes["model"]: fitted})
        pixels = sample.pixels(fitted.attributes["model"])
        chosen = np.linspace(0, len(pixels) - 1, min(len(pixels), _PIXELS)).astype(np.intp)
        left_out = fitted.attributes["options"]["exclude"]
        seen = [number for number, name in enumerate(stack.lights.names) if name not in left_out]
        told, camera = place_lights(
            fitted.attributes, fitted.shape, stack.lights.select(held_out), stack.camera
        )
        extent_mm = max(fitted.shape) * (camera.mm_per_px or 1.0)
        found = found_lights(fitted.attributes, stack.lights.select(seen), extent_mm)
        return cls(
            radiance=np.ascontiguousarray(sample.radiance[[*seen, *held_out]][:, chosen]),
            held_out=np.repeat([False, True], [len(seen), len(held_out)]),
            lights=join_lights([found, told]),
            camera=camera,
            light_rgb=stack.light_rgb,
            clip_level=stack.clip_level,
            noise=stack.noise,
            row=pixels.row[chosen],
            column=pixels.column[chosen],
            size=fitted.shape,
        )

    @property
    def usable(self) -> Mask:
        """Which samples (L, P, C) are neither clipped nor missing."""
        result: Mask = np.isfinite(self.radiance) & (self.radiance < self.clip_level)
        return result

    @property
    def variance(self) -> Array:
        """Variance of the noise of each sample (L, P, C), in relative radiance."""
        read, photon, relative = self.noise
        level = np.maximum(np.nan_to_num(self.radiance), 0.0).astype(np.float64)
        result: Array = read**2 + photon * level + np.square(relative * level)
        return result


def error_shares(model: ModelSpec, seen: Photographed, options: FitOptions) -> ErrorShares:
    """Divide the squared error of a joint fit on photographs held out between its sources.

    Parameters
    ----------
    model : ModelSpec
    seen : Photographed
        Pixels spread over the painting, of which there should be some hundred or more.
    options : FitOptions
        Of the fit; what concerns the residual and self-calibration is left away, because the shares are those
        of what the model alone leaves over under the lights as they are given.

    Notes
    -----
    What is divided is E0, the sum of (f(measured) − f(model))² over all held-out samples that are neither
    clipped nor missing, f being the square-root scale of `impasto.residual.encode`, on which no highlight
    outweighs the rest. Each source is taken away in turn, the pixels are fitted again, and the sum is taken
    over the same photographs:

    1. each photograph is given the strength and the direction that bring a robust fit closest to it, less
       what of these is a quadratic function of the direction over all lights, as a material that the model
       does not know brings about: E1. The lights' share is (E0 − E1) / E0;
    2. samples in a cast shadow are left out: E2. The shadows' share is (E1 − E2) / E0;
    3. the photographs held out are fitted with the others: E3. The share of what those did not tell, called
       sampling, is (E2 − E3) / E0;
    4. the noise that the noise model expects of the samples left, times the share of them that the pixel's
       own unknowns do not take up, at most E3, is the noise's; what is left is the model's.

    A sample is in a cast shadow if the mean of its channels is less than half of what the pixel's diffuse
    part alone gives by a robust fit, and is so by more than four standard deviations of the noise. Attached
    shadows are part of the model. A step that makes the error no smaller has no share.
    """
    options = replace(options, residual=False, self_calibrate=False)
    found, robust = _find_lights(model, seen, options)
    shadow = _shadowed(model, seen, found, robust, options)
    unseen = np.broadcast_to(seen.held_out[:, None], shadow.shape)
    fits = [
        (seen.lights, _fit(model, seen, seen.lights, options, unseen)),
        (found, _fit(model, seen, found, options, unseen)),
        (found, _fit(model, seen, found, options, unseen | shadow)),
        (found, _fit(model, seen, found, options, shadow)),
    ]
    rest = [_rest(model, seen, lights, maps, options) for lights, maps in fits]
    usable = seen.usable & np.logical_and.reduce([np.isfinite(part) for part in rest])
    kept = usable & ~shadow[..., None]
    judged = usable & unseen[..., None]
    samples = int(judged.sum())
    counted = (judged, judged, judged & kept, judged & kept)
    sums = [
        float(np.square(part[where], dtype=np.float64).sum())
        for part, where in zip(rest, counted, strict=True)
    ]
    rms = float(np.sqrt(sums[0] / max(samples, 1)))
    # A step that makes the error larger takes nothing away.
    left = np.minimum.accumulate([*sums, _expected_noise(model, seen, kept, options)])
    if left[0] == 0.0:  # a perfect fit, of which noise is all that is known
        left = np.ones_like(left)
    lights, shadows, sampling, own = (left[:-1] - left[1:]) / left[0]
    return ErrorShares(
        model=float(own),
        lights=float(lights),
        shadows=float(shadows),
        noise=float(left[-1] / left[0]),
        sampling=float(sampling),
        photographs=int(seen.held_out.sum()),
        pixels=int(judged.any(axis=(0, 2)).sum()),
        samples=samples,
        shadowed=float((usable & shadow[..., None]).sum()) / max(int(usable.sum()), 1),
        rms=rms,
    )


def _fit(
    model: ModelSpec, seen: Photographed, lights: Lights, options: FitOptions, left_out: Mask | None = None
) -> Maps:
    return fit_tile(
        model,
        seen.radiance,
        lights=lights,
        camera=seen.camera,
        light_rgb=seen.light_rgb,
        clip_level=seen.clip_level,
        noise=seen.noise,
        position_mm=near_positions_mm(seen.row, seen.column, seen.size, lights, seen.camera),
        options=options,
        left_out=left_out,
    )


def _pixels(model: ModelSpec, seen: Photographed, maps: Mapping[str, Any], options: FitOptions) -> Pixels:
    attributes = {
        "model": model.name,
        "light_rgb": seen.light_rgb,
        "index_of_refraction": options.index,
        "fresnel": options.fresnel,
    }
    return pixels_of_maps(attributes, seen.size, seen.row, seen.column, maps)


def _render(
    model: ModelSpec, seen: Photographed, lights: Lights, maps: Mapping[str, Any], options: FitOptions
) -> Values:
    return render_pixels(_pixels(model, seen, maps, options), lights, seen.camera)


def _encoded(values: Values, toe: float) -> Values:
    return np.where(np.isfinite(values), encode(values, toe), np.float32(np.nan))


def _rest(model: ModelSpec, seen: Photographed, lights: Lights, maps: Maps, options: FitOptions) -> Values:
    """Return f(measured) − f(model), shape (L, P, C); NaN where either is missing."""
    rendered = _render(model, seen, lights, maps, options)
    return _encoded(seen.radiance, seen.toe) - _encoded(rendered, seen.toe)


def _expected_noise(model: ModelSpec, seen: Photographed, kept: Mask, options: FitOptions) -> float:
    """Return the sum of squares that noise alone leaves of the held-out photographs after a fit of `kept`."""
    # The encoding's slope is 1 / 2√(Y + a).
    slope_squared = 0.25 / (np.maximum(np.nan_to_num(seen.radiance), 0.0) + seen.toe)
    expected = np.where(kept, seen.variance * slope_squared, 0.0)[seen.held_out].sum(axis=(0, 2))
    count = kept.sum(axis=(0, 2))
    free = 1.0 - unknowns(
        model, seen.radiance.shape[2], coloured=options.highlight_colour == "own"
    ) / np.maximum(count, 1)
    return float((expected * np.maximum(free, 0.0)).sum())


def _find_lights(model: ModelSpec, seen: Photographed, options: FitOptions) -> tuple[Lights, Maps]:
    """Return the lights that bring a robust fit closest to the photographs, and that fit under them."""
    robust = replace(options, loss="cauchy", loss_scale=3.0)
    correction = np.zeros((3, len(seen.lights)))
    lights = seen.lights
    maps = _fit(model, seen, lights, robust)
    for _ in range(_ROUNDS):
        rest = _rest(model, seen, lights, maps, robust)
        slope = _slopes(model, seen, lights, maps, robust)
        usable = seen.usable & np.isfinite(rest) & np.isfinite(slope).all(axis=0)
        for light in range(len(seen.lights)):
            here = usable[light]
            part = slope[:, light][:, here]
            correction[:, light] = _correction(part, rest[light][here] + correction[:, light] @ part)
        # In doubt a trend is the material's: lights that are not to blame must not be named.
        correction -= find_trend(seen.lights.direction, correction.T, told=False).T
        lights = _corrected(seen.lights, correction)
        maps = _fit(model, seen, lights, robust)
    return lights, maps


def _slopes(model: ModelSpec, seen: Photographed, lights: Lights, maps: Maps, options: FitOptions) -> Values:
    """Return how f(model) changes with each light's log strength and two angles, shape (3, L, P, C)."""
    rendered = _render(model, seen, lights, maps, options)
    gain = rendered / (2 * np.sqrt(np.maximum(rendered, 0) + np.float32(seen.toe)))
    turned = []
    for axis in (1, 2):
        ends = []
        for sign in (1.0, -1.0):
            small = np.zeros((3, len(lights)))
            small[axis] = sign * _STEP
            under = _corrected(lights, small)
            ends.append(_encoded(_render(model, seen, under, maps, options), seen.toe))
        turned.append((ends[0] - ends[1]) / (2 * _STEP))
    return np.stack([gain, *turned]).astype(np.float32)


def _correction(slope: Values, rest: Array) -> Array:
    """Return by how much to correct one light's log strength and two angles, shape (3,)."""
    if rest.size < 16:
        return np.zeros(3)
    precision = max(rest.size / _INDEPENDENT, 1.0) / np.square(_PRIOR_SD)
    terms, rest = slope.T.astype(np.float64), rest.astype(np.float64)
    found = robust_fit(terms, rest, np.ones_like(rest), precision, np.zeros(3))
    limit = _MOST_SDS * np.array(_PRIOR_SD)
    return np.clip(found, -limit, limit)


def _corrected(lights: Lights, correction: Array) -> Lights:
    """Return lights made stronger by exp(correction[0]) and turned by two small angles along x and y."""
    direction = lights.direction.copy()
    direction[:, :2] += correction[1:].T
    direction[:, 2] = np.maximum(direction[:, 2], 1e-3)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    distance = np.linalg.norm(lights.position_mm, axis=1, keepdims=True)
    return replace(
        lights,
        direction=direction,
        position_mm=direction * distance,
        intensity=lights.intensity * np.exp(correction[0])[:, None],
    )


def _shadowed(model: ModelSpec, seen: Photographed, lights: Lights, maps: Maps, options: FitOptions) -> Mask:
    """Return which samples (L, P) lie in a cast shadow; see `error_shares`."""
    matte = _pixels(model, seen, maps, options).without_highlights()
    expected = render_pixels(matte, lights, seen.camera).mean(axis=2)
    measured = np.where(seen.usable, seen.radiance, np.nan).mean(axis=2)
    sigma = np.sqrt(seen.variance.mean(axis=2) / seen.radiance.shape[2])
    dark: Mask = (measured < _SHADOW_SHARE * expected) & (expected - measured > _SHADOW_SIGMAS * sigma)
    return dark
