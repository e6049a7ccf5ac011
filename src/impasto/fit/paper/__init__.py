"""The paper's procedure [Chen2007]_, Fig. 3, literal and refined, for lights on an arm in one plane."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.arm import find_arm
from impasto.errors import OptionError, raise_problems
from impasto.fit.paper import notes
from impasto.fit.paper.brightest import Pixel, fit_brightest, specular_at_peak
from impasto.fit.paper.crossing import Crossing, normal_reach
from impasto.fit.paper.refusals import lights_needed, refusals
from impasto.fit.paper.survey import Survey, survey
from impasto.fit.paper.threshold import choose_threshold
from impasto.fit.procedure import Findings, FitOptions
from impasto.fit.tile import Sample, fit_tile
from impasto.geometry import direction_tilts
from impasto.models import MODELS, ModelSpec

__all__ = ["Paper"]

_FOREIGN = dict.fromkeys(
    (
        *("loss", "loss_scale", "shadows", "share_reflectance", "highlight_colour"),
        *("residual", "residual_components", "self_calibrate"),
        *("calibrate_directions", "calibrate_distances"),
    ),
    "joint",
)
# What the highlight's width is told by, whatever model is fitted.
_WIDTH_MODEL = "torrance-sparrow"
# The paper's residuals are unweighted.
_UNWEIGHTED = (1.0, 0.0, 0.0)


class Paper:
    """The paper's procedure: the diffuse term from lights far from the highlight, one As, then the shape.

    Parameters
    ----------
    stack : Stack
    model : ModelSpec
    options : FitOptions

    Raises
    ------
    OptionError
        Listing everything that the procedure is not defined for.
    """

    name = "paper"

    def __init__(self, stack: stores.Stack, model: ModelSpec, options: FitOptions) -> None:
        self._stack = stack
        self._model = model
        self._options = options
        channels = stack.shape[3]
        names = stack.lights.names
        self.lights = [number for number, name in enumerate(names) if name not in options.exclude]
        selected = stack.lights.select(self.lights)
        self._arm = find_arm(selected.direction)
        self._arm_lights = self._arm.lights(selected)
        self._arm_camera = self._arm.camera(stack.camera)
        self._light_rgb = stack.light_rgb
        self._sample: Sample | None = None
        self._peak: tuple[float, float, float] | None = None
        self.maps = _maps(model, channels, refined=options.refined)
        raise_problems(
            OptionError,
            [
                *options.foreign(_FOREIGN, self.name),
                *refusals(model, self._arm, selected, stack.camera, options),
            ],
        )

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the fit."""
        return {
            "model": self._model.name,
            "procedure": self.name,
            **self._options.attributes(_FOREIGN),
            "light_rgb": self._light_rgb.tolist(),
            "light_rgb_source": self._stack.light_rgb_source,
            "stack_sha256": self._stack.sha256,
            "photographs": len(self.lights),
        }

    def prepare(self, show_progress: bool | None) -> Findings:
        """Find As, whether it is identified, and the threshold; see `Procedure.prepare`."""
        found = survey(self._stack, self.lights, show_progress)
        pixel = self._pixel(found)
        width_model = MODELS[_WIDTH_MODEL]
        apparent = fit_brightest(width_model, pixel, self._options.shadow_level)
        threshold_deg = self._options.threshold_deg
        some = Sample(np.radians(35.0 if threshold_deg is None else threshold_deg), apparent.specular, True)
        grid = self._fit(width_model, found.grid, some)
        seen_deg = None
        if threshold_deg is None:
            threshold_deg, seen_deg = choose_threshold(
                width_model,
                grid,
                self._arm_lights.direction,
                self._arm_camera,
                self._options,
                lights_needed(self._model),
            )
        view_phi = float(direction_tilts(self._arm_camera.view_direction)[1])
        diffuse = self._fit(width_model, found.grid, replace(some, specular=float("nan")))
        reach = normal_reach(
            grid, diffuse, light_direction=self._arm_lights.direction, noise=self._stack.noise
        )
        crossing = Crossing(view_phi, reach, apparent.shape)
        threshold = float(np.radians(threshold_deg))
        if self._options.highlight == "sample":
            x, y, z = self._arm_lights.direction[found.light].tolist()
            self._peak = (x, y, z)
        specular = self._specular(found, pixel, threshold)
        identified = crossing.identified and specular > 0
        self._sample = Sample(
            threshold, specular if identified else float("nan"), self._options.refined, self._peak
        )
        light = self._arm_lights.names[found.light]
        return Findings(
            attributes={
                "sample": {
                    "specular": specular if identified else None,
                    "row": found.row,
                    "column": found.column,
                    "light": light,
                    "clipped_pixels": found.clipped_pixels,
                    "threshold_deg": threshold_deg,
                    "arm_azimuth_deg": float(np.degrees(self._arm.azimuth)),
                    "view_tilt_out_of_plane_deg": float(np.degrees(view_phi)),
                    "normals_reach_deg": float(np.degrees(reach)),
                    "c_apparent": apparent.shape,
                }
            },
            notes=(
                *notes.plane(self._arm, view_phi, self._options.refined),
                notes.threshold(threshold_deg, seen_deg, self._options.highlight),
                notes.specular(specular, crossing, found, light),
                *notes.clipped(found.clipped_pixels, self._stack.shape[1] * self._stack.shape[2]),
            ),
        )

    def conclude(self, read: Callable[..., Iterator[stores.Maps]]) -> Findings:
        """Say how large the error of θn is, as θv tells it in the literal form; see `Procedure.conclude`."""
        if self._options.refined:
            return Findings()
        count, total, squares = 0, 0.0, 0.0
        for maps in read("view_tilt", "status"):
            tilt = maps["view_tilt"][maps["status"] == 0].astype(np.float64)
            count += tilt.size
            total += float(tilt.sum())
            squares += float((tilt**2).sum())
        if not count:
            return Findings()
        error_deg = float(np.degrees(np.sqrt(max(0.0, squares / count - (total / count) ** 2)))) / 2
        return Findings({"theta_error_deg": error_deg}, (notes.theta_error(error_deg),))

    def fit(self, radiance: NDArray[Any], rows: slice, columns: slice) -> stores.Maps:
        """Fit a tile, after `prepare`; see `Procedure.fit`."""
        assert self._sample is not None
        pixels = radiance.reshape(len(radiance), -1, radiance.shape[-1])
        maps = self._fit(self._model, pixels, self._sample)
        return {**maps, "normal": self._arm.back(maps["normal"])}

    def _fit(self, model: ModelSpec, radiance: NDArray[Any], sample: Sample) -> stores.Maps:
        """Fit pixels of shape (L, N, C) in the arm's frame."""
        return fit_tile(
            model,
            radiance,
            lights=self._arm_lights,
            camera=self._arm_camera,
            light_rgb=self._light_rgb,
            clip_level=self._stack.clip_level,
            noise=_UNWEIGHTED,
            scale=self._stack.scale,
            offset=self._stack.offset,
            options=self._options,
            paper=sample,
        )

    def _pixel(self, found: Survey) -> Pixel:
        values = found.peak[:, 0].astype(np.float64)
        return Pixel(
            radiance=(values * self._stack.scale + self._stack.offset) / self._arm_lights.intensity,
            light_direction=self._arm_lights.direction,
            view_direction=self._arm_camera.view_direction,
            light_rgb=self._light_rgb,
            brightest=found.light,
            index=self._options.index,
            fresnel=self._options.fresnel,
        )

    def _specular(self, found: Survey, pixel: Pixel, threshold: float) -> float:
        """Return As, by the form of the procedure."""
        if self._options.refined:
            return fit_brightest(self._model, pixel, self._options.shadow_level).specular
        diffuse = self._fit(self._model, found.peak, Sample(threshold, float("nan"), False, self._peak))
        if not np.isfinite(diffuse["diffuse"]).all():
            return 0.0
        ambient = float(diffuse["ambient"][0, 0]) if self._model.ambient else 0.0
        return specular_at_peak(
            self._model, pixel, diffuse["normal"][0], diffuse["diffuse"][0].astype(np.float64), ambient
        )


def _maps(model: ModelSpec, channels: int, *, refined: bool) -> tuple[stores.Map, ...]:
    """Return the maps of a fit: residuals are unweighted, so there are no standard deviations."""
    *maps, status = stores.fit_maps(
        model.shape_names, lobes=model.lobes, ambient=model.ambient, channels=channels
    )
    kept = [map for map in maps if not map.name.endswith("_sd") and map.name != "chi2_reduced"]
    if not refined:
        kept.append(stores.Map("view_tilt", None, 1, "rad", "tilt of the view in the arm's plane, θv"))
    return (*kept, status)
