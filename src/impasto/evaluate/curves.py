"""Radiance against angle at a place of the painting: as measured, and as each model has it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.arm import Arm, find_arm
from impasto.geometry import Array, Camera, Lights, arm_direction, turn_about_z
from impasto.models import basis
from impasto.pixels import Pixels, luminance, render_pixels
from impasto.store import Stack

SHOULDER = (1.0, 3.0)
"""Where the shoulder of a highlight begins and ends, in half-widths from the mirror direction."""

_SWEEP_STEP_DEG = 0.25
_SWEEP_DEG = np.linspace(0.0, 89.0, 1781)


@dataclass(frozen=True)
class Sweep:
    """A model under a light of unit strength that moves along the arm.

    Parameters
    ----------
    angle_deg : ndarray of shape (A,)
        Evenly spaced over the lights' range.
    diffuse, specular : ndarray of shape (A, C), float64
    """

    angle_deg: Array
    diffuse: Array
    specular: Array


@dataclass(frozen=True)
class ModelCurve:
    """What a model says.

    Parameters
    ----------
    swept : Sweep or None
        The same between the lights, of a single pixel under lights on an arm.
    diffuse, specular : ndarray of shape (L, C), float64
        Relative radiance per unit of irradiance; `diffuse` includes the ambient term.
    signed_error : dict of str to float or None
        Mean of model minus measurement in luminance, as share of the mean measured luminance, over the lights
        of the ``peak``, the ``shoulder`` and the ``rest``; None where there are none.
    """

    diffuse: Array
    specular: Array
    signed_error: dict[str, float | None]
    swept: Sweep | None


@dataclass(frozen=True)
class Curve:
    """Radiance of a pixel or a region under each light.

    Parameters
    ----------
    name : str
    pixels : int
        How many pixels the curve is the mean of.
    pixel : (int, int) or None
        Column and row, where it is the curve of one.
    lights : tuple of str
    angle_deg : ndarray of shape (L,)
        The lights' angle on the arm, or, for lights that do not lie in a plane, from the mirror direction.
    angle_name : str
        Which of the two.
    off_mirror_deg : ndarray of shape (L,)
        Angle between light and mirror direction of the view.
    half_width_deg : float
        Angle from the mirror direction at which the first model's highlight has half its height; NaN without
        a highlight.
    measured : ndarray of shape (L, C), float64
        Relative radiance per unit of irradiance; NaN where every sample is clipped or missing.
    clipped : ndarray of shape (L,), float64
        Share of the samples that are clipped.
    models : dict of str to ModelCurve
    """

    name: str
    pixels: int
    pixel: tuple[int, int] | None
    lights: tuple[str, ...]
    angle_deg: Array
    angle_name: str
    off_mirror_deg: Array
    half_width_deg: float
    measured: Array
    clipped: Array
    models: dict[str, ModelCurve]

    @property
    def band(self) -> NDArray[np.str_]:
        """The band of each light: ``peak``, ``shoulder`` or ``rest``."""
        widths = self.off_mirror_deg / self.half_width_deg
        names: NDArray[np.str_] = np.where(
            widths <= SHOULDER[0], "peak", np.where(widths <= SHOULDER[1], "shoulder", "rest")
        )
        return names


class CurveSums:
    """Sums over the pixels of a place, tile by tile.

    Parameters
    ----------
    name : str
    stack : Stack
    models : sequence of str
    """

    def __init__(self, name: str, stack: Stack, models: Sequence[str]) -> None:
        count, _, _, channels = stack.shape
        self._name, self._stack = name, stack
        self._weight = np.zeros((count, 1))
        self._clipped = np.zeros(count)
        self._pixels = 0
        self._measured = np.zeros((count, channels))
        self._models = {model: np.zeros((2, count, channels)) for model in models}
        self._normal = np.zeros(3)
        self._shape: list[Array] = []
        self._last: dict[str, Pixels] = {}

    def add(self, radiance: NDArray[np.float32], fitted: Mapping[str, Pixels]) -> None:
        """Add pixels.

        Parameters
        ----------
        radiance : ndarray of shape (L, P, C)
            As photographed.
        fitted : mapping of str to Pixels
            The same pixels of each model's fit.
        """
        whole = np.all([pixels.whole for pixels in fitted.values()], axis=0)
        chosen = {name: pixels.select(whole) for name, pixels in fitted.items()}
        measured = radiance[:, whole].astype(np.float64)
        clipped = (measured >= self._stack.clip_level).any(axis=-1)
        usable = np.asarray(np.isfinite(measured).all(axis=-1) & ~clipped)
        lights = self._stack.lights
        intensity = lights.intensity[:, None]
        self._pixels += int(whole.sum())
        self._weight += usable.sum(axis=1, keepdims=True)
        self._clipped += clipped.sum(axis=1)
        self._measured += np.where(usable[..., None], measured / intensity, 0.0).sum(axis=1)
        for name, pixels in chosen.items():
            total = render_pixels(pixels, lights, self._stack.camera) / intensity
            matte = pixels.without_highlights()
            diffuse = render_pixels(matte, lights, self._stack.camera) / intensity
            parts = np.stack([diffuse, total - diffuse])
            self._models[name] += np.where(usable[..., None], parts, 0.0).sum(axis=2)
        first = next(iter(chosen.values()))
        self._normal += first.normal.sum(axis=0)
        self._shape.append(first.shape.astype(np.float64))
        self._last = chosen

    def curve(self) -> Curve:
        """Return the means; pixels must have been added, with a fit or without."""
        first = next(iter(self._last.values()))
        lights, camera = self._stack.lights, self._stack.camera
        with np.errstate(invalid="ignore"):
            measured = self._measured / self._weight
            parts = {name: sums / self._weight for name, sums in self._models.items()}
        length = np.linalg.norm(self._normal)
        normal = self._normal / (length if length else 1.0)
        view = camera.view_direction
        mirror = 2 * (normal @ view) * normal - view
        off_mirror = np.degrees(np.arccos(np.clip(lights.direction @ mirror, -1.0, 1.0)))
        arm = find_arm(lights.direction)
        in_arm = arm.into(lights.direction)
        angle = np.degrees(np.arctan2(in_arm[:, 0], in_arm[:, 2])) if arm.planar else off_mirror
        shapes = np.concatenate(self._shape)
        half_width = (
            half_width_deg(first, np.median(shapes, axis=0), normal, camera) if len(shapes) else np.nan
        )
        curve = Curve(
            name=self._name,
            pixels=self._pixels,
            pixel=(int(first.column[0]), int(first.row[0])) if len(first) == self._pixels == 1 else None,
            lights=lights.names,
            angle_deg=angle,
            angle_name="angle of the light on the arm" if arm.planar else "angle from the mirror direction",
            off_mirror_deg=off_mirror,
            half_width_deg=float(half_width),
            measured=measured,
            clipped=self._clipped / max(self._pixels, 1),
            models={},
        )
        for name, (diffuse, specular) in parts.items():
            errors = _signed_errors(curve, diffuse + specular)
            alone = curve.pixel is not None and arm.planar and not lights.near
            swept = _sweep(self._last[name], angle, arm, camera) if alone else None
            curve.models[name] = ModelCurve(diffuse, specular, errors, swept)
        return curve


def _sweep(pixel: Pixels, angle_deg: Array, arm: Arm, camera: Camera) -> Sweep:
    """Return what the model of one pixel says along the arm."""
    count = 1 + round(float(np.ptp(angle_deg)) / _SWEEP_STEP_DEG)
    angles = np.linspace(angle_deg.min(), angle_deg.max(), count)
    lights = Lights(
        names=tuple(f"{angle:g}" for angle in angles),
        direction=turn_about_z(arm_direction(np.radians(angles)), arm.azimuth),
    )
    matte = pixel.without_highlights()
    total, diffuse = (render_pixels(each, lights, camera)[:, 0].astype(np.float64) for each in (pixel, matte))
    return Sweep(angles, diffuse, total - diffuse)


def half_width_deg(pixels: Pixels, shape: Array, normal: Array, camera: Camera) -> float:
    """Return how far from the mirror direction a highlight falls to half its height, mean of both sides.

    Parameters
    ----------
    pixels : Pixels
        Of the model; their median magnitudes weigh several lobes against each other.
    shape : ndarray of shape (S,)
    normal : ndarray of shape (3,)
    camera : Camera

    Returns
    -------
    float
        Degrees; NaN for a model without a lobe.
    """
    if not pixels.model.lobes:
        return float("nan")
    several = pixels.model.lobes > 1
    weight = np.nanmedian(pixels.specular, axis=0) if several else np.ones(1)
    view = camera.view_direction
    mirror = 2 * (normal @ view) * normal - view
    aside = np.array([1.0, 0.0, 0.0]) - mirror[0] * mirror
    aside /= np.linalg.norm(aside)
    angle = np.radians(_SWEEP_DEG)[:, None]
    sides = []
    for sign in (1.0, -1.0):
        light = np.cos(angle) * mirror + sign * np.sin(angle) * aside
        count = len(light)
        _, lobes = basis(
            pixels.model,
            np.tile(normal, (count, 1)),
            light,
            np.tile(view, (count, 1)),
            np.tile(shape, (count, 1)),
            index=pixels.attributes["index_of_refraction"],
            fresnel=pixels.attributes["fresnel"],
        )
        highlight = lobes @ weight
        below = np.flatnonzero(highlight < 0.5 * highlight[0])
        sides.append(_SWEEP_DEG[below[0]] if len(below) else _SWEEP_DEG[-1])
    return float(np.mean(sides))


def _signed_errors(curve: Curve, modelled: Array) -> dict[str, float | None]:
    measured, modelled = luminance(curve.measured), luminance(modelled)
    known = np.isfinite(measured)
    errors: dict[str, float | None] = {}
    for band in ("peak", "shoulder", "rest"):
        chosen = known & (curve.band == band)
        scale = float(measured[chosen].sum())
        errors[band] = float((modelled - measured)[chosen].sum()) / scale if scale > 0 else None
    return errors


def columns(curve: Curve) -> dict[str, Any]:
    """Return a curve as columns of a table, by their names."""
    channels = "rgb" if curve.measured.shape[1] == 3 else "y"
    table: dict[str, Any] = {
        "light": curve.lights,
        "angle_deg": curve.angle_deg,
        "off_mirror_deg": curve.off_mirror_deg,
        "band": curve.band,
        "clipped_share": curve.clipped,
    }
    parts = {"measured": curve.measured}
    for name, model in curve.models.items():
        parts |= {f"{name}_diffuse": model.diffuse, f"{name}_specular": model.specular}
    for name, values in parts.items():
        table |= {f"{name}_{letter}": values[:, index] for index, letter in enumerate(channels)}
    return table
