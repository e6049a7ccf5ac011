"""The joint procedure: one bounded least-squares problem per pixel over all lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from numpy.typing import NDArray

from impasto import store as stores
from impasto.arm import find_arm
from impasto.errors import OptionError, Problem, raise_problems
from impasto.fit.procedure import Findings, FitOptions
from impasto.fit.tile import fit_tile
from impasto.geometry import pixel_position_mm
from impasto.models import ModelSpec

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
        self._model = model
        self._options = options
        _, self._height, self._width, channels = stack.shape
        names = stack.lights.names
        self.lights = [number for number, name in enumerate(names) if name not in options.exclude]
        self._selected = stack.lights.select(self.lights)
        self._camera = stack.camera
        self._light_rgb = stack.light_rgb
        self.maps = stores.fit_maps(
            model.shape_names, lobes=model.lobes, ambient=model.ambient, channels=channels
        )
        raise_problems(OptionError, self._problems())

    def _problems(self) -> list[Problem]:
        problems = self._options.foreign(_FOREIGN, self.name)
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
        """Say what lights in one plane leave open; see `Procedure.prepare`."""
        if not find_arm(self._selected.direction).planar:
            return Findings()
        return Findings(
            notes=(
                "the lights lie in one plane, which does not tell how far a normal tilts out of it, nor Ad "
                "and As apart from that tilt: they rest on where the joint fit starts. --procedure paper "
                "--refined says what it assumes instead",
            )
        )

    def conclude(self, read: Callable[..., Iterator[stores.Maps]]) -> Findings:
        """Add nothing; see `Procedure.conclude`."""
        return Findings()

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
