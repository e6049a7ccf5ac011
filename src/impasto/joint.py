"""The joint procedure: one bounded least-squares problem per pixel over all lights."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.errors import OptionError, Problem, raise_problems
from impasto.geometry import Camera, Lights, pixel_position_mm
from impasto.models import ModelSpec
from impasto.procedure import FitOptions


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
) -> stores.Maps:
    """Fit a model to pixels by the joint procedure.

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

    Returns
    -------
    dict of str to ndarray of shape (N[, k]), float32; ``status`` uint8
        By the names of `store.fit_maps`.
    """
    from impasto import _core

    options = options or FitOptions()
    count, _, channels = radiance.shape
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
        sample_mask=None,
        noise=noise,
        index=options.index,
        fresnel=options.fresnel,
        loss=options.loss,
        loss_scale=options.loss_scale,
        max_steps=options.max_steps,
    )
    for ending in ("", "_sd"):
        if model.shape_names:
            shape = result.pop(f"shape{ending}")
            for column, name in enumerate(model.shape_names):
                result[f"{name}{ending}"] = shape[:, column]
        if model.lobes == 1:
            result[f"specular{ending}"] = result[f"specular{ending}"][:, 0]
    return dict(result)


class Joint:
    """The joint procedure: all parameters of a pixel in one bounded least-squares problem over all lights.

    Parameters
    ----------
    stack : Stack
    model : ModelSpec
    options : FitOptions

    Raises
    ------
    OptionError
        If there are fewer photographs than unknowns, or the stack lacks what near lights need.
    """

    name = "joint"

    def __init__(self, stack: stores.Stack, model: ModelSpec, options: FitOptions) -> None:
        self._stack = stack
        self._model = model
        self._options = options
        _, self._height, self._width, channels = stack.shape
        names = stack.lights.names
        self.lights = [number for number, name in enumerate(names) if name not in options.exclude]
        self._selected = stack.lights.select(self.lights)
        self._camera = stack.camera
        self._light_rgb = np.ones(channels) if stack.light_rgb is None else stack.light_rgb
        self.maps = stores.fit_maps(
            model.shape_names, lobes=model.lobes, ambient=model.ambient, channels=channels
        )
        raise_problems(OptionError, self._problems())

    def _problems(self) -> list[Problem]:
        problems = []
        # Counted for one channel: the others of a grey pixel tell nothing more.
        unknowns = 2 + len(self._model.shape_names) + 1 + self._model.lobes + int(self._model.ambient)
        if len(self.lights) < unknowns:
            problems.append(
                Problem(
                    where=f"--model {self._model.name}",
                    what=f"has {unknowns} unknowns per channel, and there are {len(self.lights)} lights",
                    do="Take more photographs, or fit a model with fewer parameters such as lambert",
                )
            )
        near = self._selected.near or self._camera.distance_mm is not None
        if near and self._camera.mm_per_px is None:
            problems.append(
                Problem(
                    where=f"{self._stack.store}: stack",
                    what="has lights or a camera at a finite distance, and no mm_per_px",
                    do="Add mm_per_px under [camera] in a TOML light file, and stack again with --overwrite",
                )
            )
        self._near = near
        return problems

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the fit."""
        options = asdict(self._options)
        return {
            "model": self._model.name,
            "procedure": self.name,
            "index_of_refraction": options.pop("index"),
            "fresnel": options.pop("fresnel"),
            "options": {**options, "exclude": list(options["exclude"])},
            "light_rgb": self._light_rgb.tolist(),
            "light_rgb_source": "assumed white" if self._stack.light_rgb is None else "stack",
            "stack_sha256": self._stack.sha256,
            "photographs": len(self.lights),
        }

    def fit(self, radiance: NDArray[Any], rows: slice, columns: slice) -> stores.Maps:
        """Fit a tile; see `Procedure.fit`."""
        position = None
        if self._near and self._camera.mm_per_px is not None:
            position = pixel_position_mm(rows, columns, self._height, self._width, self._camera.mm_per_px)
        return fit_tile(
            self._model,
            radiance.reshape(len(radiance), -1, radiance.shape[-1]),
            lights=self._selected,
            camera=self._camera,
            light_rgb=self._light_rgb,
            clip_level=self._stack.clip_level,
            noise=self._stack.noise,
            scale=self._stack.scale,
            offset=self._stack.offset,
            position_mm=position,
            options=self._options,
        )
