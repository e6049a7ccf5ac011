"""One tile of pixels through the compiled core, by either procedure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto import store as stores
from impasto.fit.procedure import FitOptions
from impasto.geometry import Camera, Lights
from impasto.models import ModelSpec


@dataclass(frozen=True)
class Sample:
    """What the paper's procedure takes to hold for the whole sample.

    Parameters
    ----------
    threshold : float
        Lights at least this far from the highlight's peak, in radians, are taken to carry no specular term.
    specular : float
        As; NaN stops after the diffuse stage.
    refined : bool
        Whether the calibrated view is kept, and Ad, the normal and the shape are fitted over all lights.
    peak : tuple of float or None
        Direction of the light at the whole sample's peak; None for each pixel's own.
    """

    threshold: float
    specular: float
    refined: bool
    peak: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Belief:
    """What is known of N pixels before their fit: where it starts, and its prior in place of the weak one.

    The priors are normal and independent: of each shape parameter, or its logarithm where it is positive, and
    of each lobe's As over `_core.specular_scale`. See docs/decisions/0014-reflectance-sharing.md.

    Parameters
    ----------
    normal : ndarray of shape (N, 3), float32
        Unit normals to start from.
    shape : ndarray of shape (N, S), float32
        Shape parameters to start from.
    mean, deviation : ndarray of shape (N, S + lobes), float32
        Of the priors.
    """

    normal: NDArray[np.float32]
    shape: NDArray[np.float32]
    mean: NDArray[np.float32]
    deviation: NDArray[np.float32]

    @property
    def arrays(self) -> tuple[NDArray[np.float32], ...]:
        """The four arrays in their order, as the core takes them."""
        return tuple(
            np.ascontiguousarray(values, np.float32)
            for values in (self.normal, self.shape, self.mean, self.deviation)
        )


def fit_tile(
    model: ModelSpec,
    radiance: NDArray[Any],
    *,
    lights: Lights,
    camera: Camera,
    light_rgb: NDArray[np.float64],
    clip_level: NDArray[np.float64],
    noise: tuple[float, float, float],
    scale: float = 1.0,
    offset: float = 0.0,
    position_mm: NDArray[np.float32] | None = None,
    options: FitOptions | None = None,
    paper: Sample | None = None,
    normal: ArrayLike | None = None,
    left_out: NDArray[np.bool_] | None = None,
    belief: Belief | None = None,
) -> stores.Maps:
    """Fit a model to pixels: by the joint procedure, or by the paper's for a sample.

    Parameters
    ----------
    model : ModelSpec
    radiance : ndarray of shape (L, N, C), uint16 or float32
        Relative radiance = scale * value + offset; NaN where a float sample is missing.
    lights : Lights
        One per row of `radiance`.
    camera : Camera
    light_rgb : ndarray of shape (C,), float64
        Colour of the light, which is the colour of the specular term.
    clip_level : ndarray of shape (C,), float64
        Relative radiance from which on a sample is left out; infinite for none.
    noise : tuple of float
        (read, photon, relative) in relative radiance; see `store.Stack.noise`.
    scale, offset : float, optional
    position_mm : ndarray of shape (N, 2), float32, optional
        Where the pixels lie; needed if a light or the camera is near.
    options : FitOptions, optional
    paper : Sample, optional
        What holds for the whole sample, for the paper's procedure; its arm sweeps the XZ plane.
    normal : array_like of shape (3,) or (N, 3), optional
        Unit normal of all pixels or of each, for a surface that is known: it is held by the joint procedure,
        which then assumes nothing of the material either.
    left_out : ndarray of shape (L, N), bool, optional
        Samples to be left out besides those that are clipped or missing.
    belief : Belief, optional
        What is known of each pixel beforehand, for the joint procedure.

    Returns
    -------
    dict of str to ndarray of shape (N[, k]), float32; ``status`` uint8
        By the names of `store.fit_maps`; by the paper's procedure without standard deviations and chi-square,
        and with ``view_tilt``. Where cast shadows are left out, ``shadowed`` of shape (N, L) is 1 for samples
        that lie in one, else 0.
    """
    from impasto import _core

    options = options or FitOptions()
    count, pixels, channels = radiance.shape
    result = _core.fit(
        model.name,
        np.ascontiguousarray(radiance),
        scale=scale,
        offset=offset,
        light_direction=lights.direction,
        light_position_mm=lights.position_mm,
        light_intensity=np.ascontiguousarray(np.broadcast_to(lights.intensity, (count, channels))),
        view_direction=camera.view_direction,
        camera_distance_mm=camera.distance_mm,
        position_mm=position_mm,
        light_rgb=np.asarray(light_rgb, np.float64),
        clip_level=np.asarray(clip_level, np.float64),
        shadow_level=-np.inf if options.shadow_level is None else options.shadow_level,
        sample_mask=None if left_out is None else np.ascontiguousarray(left_out, np.uint8),
        noise=noise,
        index=options.index,
        fresnel=options.fresnel,
        loss=options.loss,
        loss_scale=options.loss_scale,
        max_steps=options.max_steps,
        shadows=options.shadows,
        coloured=options.highlight_colour == "own",
        paper=None if paper is None else (paper.threshold, paper.specular, paper.refined, paper.peak),
        normal=None if normal is None else _per_pixel(normal, pixels),
        belief=None if belief is None else belief.arrays,
    )
    for ending in ("", "_sd"):
        if f"normal{ending}" not in result:
            continue
        if model.shape_names and f"shape{ending}" in result:
            shape = result.pop(f"shape{ending}")
            for column, name in enumerate(model.shape_names):
                result[f"{name}{ending}"] = shape[:, column]
        if model.lobes == 1 and f"specular{ending}" in result:
            result[f"specular{ending}"] = result[f"specular{ending}"][:, 0]
    return dict(result)


def _per_pixel(normal: ArrayLike, pixels: int) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.broadcast_to(np.asarray(normal, np.float32), (pixels, 3)))
