"""The joint procedure: one bounded least-squares problem per pixel over all lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.arm import find_arm
from impasto.errors import OptionError, Problem, raise_problems
from impasto.fit.choice import Choice, choose
from impasto.fit.deviating import deviating, tell_deviating
from impasto.fit.notes import calibration_notes, residual_notes, sharing_notes
from impasto.fit.procedure import Findings, FitOptions
from impasto.fit.remainder import (
    Remainder,
    find_remainder,
    left_out_db,
    left_over,
    usual_toe,
)
from impasto.fit.sample import Sample, grid_pixels, sample_pixels
from impasto.fit.self_calibration import Calibration, self_calibrate
from impasto.fit.shadows import count_shadows, shadow_warnings
from impasto.fit.sharing import STEP as SHARING_STEP
from impasto.fit.sharing import Sharing, sharing_problems
from impasto.fit.strength import find_strength
from impasto.fit.tile import fit_tile
from impasto.geometry import Lights, rows_and_columns
from impasto.models import ModelSpec
from impasto.pixels import Pixels, near_positions_mm, pixels_of_maps, render_pixels

# Enough, because what limits the directions is the model's error, not the noise.
_DIRECTION_PIXELS = 2000

# Lights are left out of the process, not of the model, which comes closer to all with two more numbers per
# pixel: by 0.2 dB on a simulated painting whose held-out photographs are met no closer for it.
_COLOUR_WORTH_DB = 0.5

_FOREIGN = {"refined": "paper", "threshold_deg": "paper", "highlight": "paper"}


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
        self.model = model
        self._options = options
        _, height, width, channels = stack.shape
        self._size = (height, width)
        names = stack.lights.names
        self.lights = [number for number, name in enumerate(names) if name not in options.exclude]
        self._selected = stack.lights.select(self.lights)
        # Without a scale, lengths are in pixels.
        self._mm_per_px = stack.camera.mm_per_px or 1.0
        self._camera = replace(stack.camera, mm_per_px=self._mm_per_px)
        self._light_rgb = stack.light_rgb
        self._sharing: Sharing | None = None
        self._remainder: Remainder | None = None
        self._channels = channels
        # Whether it is still to be chosen if highlights have a colour of their own.
        self._undecided = (
            options.highlight_colour == "auto"
            and (options.residual or options.calibrates)
            and channels > 1
            and model.lobes > 0
        )
        self._coloured = options.highlight_colour == "own"
        raise_problems(OptionError, self._problems())

    def _problems(self) -> list[Problem]:
        problems = self._options.foreign(_FOREIGN, self.name)
        # Counted for one channel: the others of a grey pixel tell nothing more.
        unknowns = 2 + len(self.model.shape_names) + 1 + self.model.lobes + int(self.model.ambient)
        if len(self.lights) < unknowns:
            problems.append(
                Problem(
                    where=f"--model {self.model.name}",
                    what=f"has {unknowns} unknowns per channel, and there are {len(self.lights)} lights",
                    do="Take more photographs, or fit a model with fewer parameters such as lambert",
                )
            )
        if self._options.share_reflectance:
            problems += sharing_problems(self.model)
        near = self._selected.near or self._stack.camera.distance_mm is not None
        if near and self._stack.camera.mm_per_px is None:
            problems.append(
                Problem(
                    where=f"{self._stack.store}: stack",
                    what="has lights or a camera at a finite distance, and no mm_per_px",
                    do="Add mm_per_px under [camera] in a TOML light file, and stack again with --overwrite",
                )
            )
        return problems

    @property
    def noise(self) -> tuple[float, float, float]:
        """Of the stack."""
        return self._stack.noise

    @property
    def stated_lights(self) -> Lights:
        """The lights of its photographs, as the stack states them."""
        return self._stack.lights.select(self.lights)

    @property
    def maps(self) -> tuple[stores.Map, ...]:
        """The maps it makes; until `prepare` has chosen, the most that there may be."""
        model, options = self.model, self._options
        *maps, status = stores.fit_maps(
            model.shape_names,
            lobes=model.lobes,
            ambient=model.ambient,
            channels=self._channels,
            coloured=self._coloured or self._undecided,
        )
        shadowed = [stores.shadowed_map()] if options.shadows else []
        residual = [stores.residual_map(options.residual_components)] if options.residual else []
        return (*maps, *shadowed, *residual, status)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the fit."""
        return {
            "model": self.model.name,
            "procedure": self.name,
            **self._options.attributes(_FOREIGN),
            "light_rgb": self._light_rgb.tolist(),
            "light_rgb_source": self._stack.light_rgb_source,
            "stack_sha256": self._stack.sha256,
            "photographs": len(self.lights),
        }

    def prepare(self, show_progress: bool | None) -> Findings:
        """Find strength and direction of the lights and the residual's process; see `Procedure.prepare`."""
        notes: tuple[str, ...] = ()
        attributes: dict[str, Any] = {}
        if find_arm(self._selected.direction).planar:
            notes += (
                "the lights lie in one plane, which does not tell how far a normal tilts out of it, nor Ad "
                "and As apart from that tilt: they rest on where the joint fit starts. --procedure paper "
                "--refined says what it assumes instead",
            )
        calibration = None
        if self._options.residual or self._options.calibrates or self._options.shadows:
            sample = _SampledPixels(self, sample_pixels(self._stack, self.lights, show_progress))
            toe = sample.toe
        if self._options.calibrates:
            calibration = self._calibrate(sample)
        if self._undecided:
            # With the lights as they are found: errors of directions look like colours.
            lights = self._selected if calibration is None else calibration.lights
            choice = self._choose_highlight_colour(sample, lights)
            attributes["highlight_colour"] = choice.attributes()
            notes += (choice.note("highlight colour"),)
            if self._coloured and calibration is not None:
                calibration = self._calibrate(sample)
        if calibration is not None:
            self._selected = calibration.lights
            attributes["self_calibration"] = calibration.attributes()
            notes += calibration_notes(calibration)
        if self._options.share_reflectance:
            self._sharing = self._find_sharing(show_progress)
            attributes["reflectance_sharing"] = self._sharing.attributes
            notes += sharing_notes(self._sharing.attributes)
        if self._options.residual:
            self._remainder = find_remainder(
                sample.left_over(self._selected),
                self._selected,
                toe,
                self._options.residual_components,
            )
            attributes["residual"] = self._remainder.attributes
            if calibration is not None and (
                strength := find_strength(calibration.lights.direction, calibration.departure)
            ):
                attributes["residual"]["strength"] = strength
            notes += residual_notes(self._remainder.attributes)
        if self._options.shadows:
            shadowed, deviating = sample.outliers(self._selected)
            dirt = tell_deviating(deviating, self._selected.names)
            attributes |= dirt.attributes
            notes += (*shadow_warnings(shadowed, self._selected.names), *dirt.notes)
        return Findings(attributes, notes)

    def _find_sharing(self, show_progress: bool | None) -> Sharing:
        """Fit every few pixels, and keep what they show."""
        sharing = Sharing(self.model)
        title = "Looking for highlights"
        for values, row, column in grid_pixels(self._stack, self.lights, SHARING_STEP, title, show_progress):
            fit = self._fitting(values, row, column, self._selected)
            sharing.add(fit(belief=sharing.doubt(fit())), row, column)
        return sharing

    def _calibrate(self, sample: _SampledPixels) -> Calibration:
        """Find strength, distance and direction of the lights."""
        few = sample.thinned(_DIRECTION_PIXELS)
        options = self._options
        return self_calibrate(
            sample,
            few,
            self._selected,
            directions=options.calibrate_directions,
            distances=options.calibrate_distances,
        )

    def _choose_highlight_colour(self, sample: _SampledPixels, lights: Lights) -> Choice:
        """Choose the colour of highlights by how close lights left out are met."""

        def left_out(colour: str) -> float:
            self._coloured = colour == "own"
            return sample.left_out_db(lights)

        choice = choose(("white", "own"), left_out, _COLOUR_WORTH_DB)
        self._coloured, self._undecided = choice.used == "own", False
        return choice

    def conclude(self, read: Callable[..., Iterator[stores.Maps]]) -> Findings:
        """Count what lies in cast shadows, where these were left out; see `Procedure.conclude`."""
        return count_shadows(read) if self._options.shadows else Findings()

    def fit(self, radiance: NDArray[Any], rows: slice, columns: slice) -> stores.Maps:
        """Fit a tile; see `Procedure.fit`."""
        row, column = rows_and_columns(rows, columns)
        values = radiance.reshape(len(radiance), -1, radiance.shape[-1])
        maps = self.fit_pixels(values, row, column, self._selected)
        if self._options.shadows:
            maps[stores.SHADOWED] = maps[stores.SHADOWED].mean(axis=1)
        remainder = self._remainder
        if remainder is not None:
            pixels = self.pixels(maps, row, column)
            maps[stores.RESIDUAL] = left_over(
                self._stack, values, pixels, self._selected, remainder.toe, remainder.encoder
            )
        return maps

    def fit_pixels(
        self, values: NDArray[Any], row: NDArray[np.intp], column: NDArray[np.intp], lights: Lights
    ) -> stores.Maps:
        """Fit pixels (L, N, C) that lie at rows and columns, as if lit by `lights`."""
        fit = self._fitting(values, row, column, lights)
        maps = fit()
        return maps if self._sharing is None else fit(belief=self._sharing.belief(maps, row, column))

    def _fitting(
        self, values: NDArray[Any], row: NDArray[np.intp], column: NDArray[np.intp], lights: Lights
    ) -> Callable[..., stores.Maps]:
        """Return `fit_tile` with everything but the belief."""
        return partial(
            fit_tile,
            self.model,
            values,
            lights=lights,
            camera=self._camera,
            light_rgb=self._light_rgb,
            clip_level=self._stack.clip_level,
            noise=self._stack.noise,
            scale=self._stack.scale,
            offset=self._stack.offset,
            position_mm=near_positions_mm(row, column, self._size, lights, self._camera),
            options=replace(self._options, highlight_colour="own" if self._coloured else "white"),
        )

    @property
    def extent_mm(self) -> float:
        """Longer side of the picture in mm, or in pixels where nothing is known of its scale."""
        return max(self._size) * self._mm_per_px

    def pixels(self, maps: stores.Maps, row: NDArray[np.intp], column: NDArray[np.intp]) -> Pixels:
        """Return fitted maps as pixels."""
        return pixels_of_maps(self.attributes, self._size, row, column, maps)

    def measured(self, values: NDArray[Any]) -> NDArray[np.float32]:
        """Return the radiance of stored values."""
        return values * np.float32(self._stack.scale) + np.float32(self._stack.offset)

    def clipped(self, measured: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return which samples of radiance are clipped."""
        return measured >= self._stack.clip_level.astype(np.float32)

    def render(self, pixels: Pixels, lights: Lights) -> NDArray[np.float32]:
        """Return the radiance of pixels under lights."""
        return render_pixels(pixels, lights, self._camera)

    def left_over(
        self, values: NDArray[Any], pixels: Pixels, lights: Lights, toe: float
    ) -> NDArray[np.float32]:
        """Return what the model leaves over of stored values (L, N, C); see `remainder.left_over`."""
        return left_over(self._stack, values, pixels, lights, toe)


@dataclass(frozen=True)
class _SampledPixels:
    """A sample of the painting, as the self-calibration takes it."""

    procedure: Joint
    sample: Sample

    def fit(self, lights: Lights) -> stores.Maps:
        return self.procedure.fit_pixels(self.sample.values, self.sample.row, self.sample.column, lights)

    def radiance(self, maps: stores.Maps, lights: Lights, *, highlights: bool = True) -> NDArray[np.float32]:
        pixels = self.procedure.pixels(maps, self.sample.row, self.sample.column)
        return self.procedure.render(pixels if highlights else pixels.without_highlights(), lights)

    def measured(self) -> NDArray[np.float32]:
        return self.procedure.measured(self.sample.values)

    def clipped(self) -> NDArray[np.bool_]:
        return self.procedure.clipped(self.measured())

    def crosses(self) -> NDArray[np.float32]:
        measured = self.procedure.measured(self.sample.crosses)
        measured[self.procedure.clipped(measured)] = np.nan
        grey: NDArray[np.float32] = measured.mean(axis=3)
        return grey

    @property
    def extent_mm(self) -> float:
        return self.procedure.extent_mm

    @property
    def toe(self) -> float:
        return usual_toe(self.measured())

    def outliers(self, lights: Lights) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return which samples (N, L) lie in shadow, and which (L, N) deviate otherwise."""
        maps = self.fit(lights)
        shadowed = maps[stores.SHADOWED]
        measured = self.measured()
        measured[self.procedure.clipped(measured)] = np.nan
        radiance = self.radiance(maps, lights)
        noise = self.procedure.noise
        return shadowed, deviating(measured, radiance, noise, np.nan_to_num(shadowed).T > 0)

    def left_over(self, lights: Lights) -> NDArray[np.float32]:
        pixels = self.procedure.pixels(self.fit(lights), self.sample.row, self.sample.column)
        return self.procedure.left_over(self.sample.values, pixels, lights, self.toe)

    def left_out_db(self, lights: Lights) -> float:
        return left_out_db(self.left_over(lights), lights)

    def thinned(self, count: int) -> _SampledPixels:
        """Return about `count` of the pixels, or all of fewer."""
        return _SampledPixels(self.procedure, self.sample.thinned(count))
