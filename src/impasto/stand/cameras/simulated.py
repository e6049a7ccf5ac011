"""A simulated camera before a simulated painting, under the lamp that is on."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from impasto.capture.simulate import charts, spheres
from impasto.capture.simulate.calibration import Studio, card_radiance
from impasto.capture.simulate.camera import Sensor
from impasto.capture.simulate.capture import set_up
from impasto.capture.simulate.files import ENDINGS, write_image
from impasto.capture.simulate.illumination import Scene
from impasto.capture.simulate.settings import Settings as Painting
from impasto.capture.toml_tables import NotNegative, Positive, Table
from impasto.errors import OptionError, raise_problems
from impasto.geometry import Array
from impasto.stand.drivers import Stand
from impasto.stand.steps import Shot

# Of a lamp's light: what a darkened room leaves.
_ROOM = 0.001


class SimulatedCamera:
    """Renders what the lamp lights; noise differs from one photograph to the next, as a camera's does.

    Parameters
    ----------
    settings : SimulatedCamera.Settings
    stand : Stand
        Its light says which lamp is on in ``lit``; a light that does not is taken to do what it is told.

    Raises
    ------
    OptionError
        If the simulator does not know the painting.
    """

    class Settings(Table):
        """The table ``[camera.simulated]``; an exposure of 1 s shows a white card as `exposure`."""

        sample: str | None = None
        preset: str | None = None
        size: Annotated[list[int], Field(min_length=2, max_length=2)] = Field(default=[192, 128])
        seed: Annotated[int, Field(ge=0)] = 0
        exposure: Positive = 0.5
        ambient: NotNegative = _ROOM
        format: Literal["tiff", "png", "jpeg", "dng"] = "tiff"

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self._settings, self._stand = settings, stand
        self._painting = Painting(
            sample=settings.sample,
            preset=settings.preset,
            lights=stand.plan.lights,
            size=(settings.size[0], settings.size[1]),
            seed=settings.seed,
            format=settings.format,
        )
        raise_problems(OptionError, self._painting.problems())
        self._sensor = Sensor(exposure=settings.exposure, response=self._painting.sensor_response,
                              dtype=self._painting.dtype)  # fmt: skip
        self._noise = np.random.default_rng()

    def take(self, shot: Shot, folder: Path) -> Path:
        """Render and write a photograph."""
        lit = getattr(self._stand.light, "lit", shot.place)
        radiance = np.zeros((1, 1, 1)) if shot.kind == "dark" else self._radiance(shot.kind, lit)
        size = radiance.shape[:2] if shot.kind == "spheres" else self._painting.size[::-1]
        radiance = np.broadcast_to(radiance, (*size, 3))
        image = self._sensor.expose(radiance, self._noise, float(np.log2(shot.exposure_s)))
        path = folder / (shot.name.replace("/", "_") + ENDINGS[self._settings.format])
        write_image(path, image)
        return path

    def close(self) -> None:
        """Do nothing."""

    def _radiance(self, kind: str, lit: str | None) -> Array:
        lights, scene = self._stand.plan.lights, self._scene
        if kind in ("painting", "ambient"):
            room = self._settings.ambient * scene.surface.diffuse
            lamp = 0.0 if lit is None else scene.radiance(lights, lights.names.index(lit))
            return np.asarray(room + lamp, np.float64)
        if lit is None:
            return np.full((1, 1, 1), self._settings.ambient)
        light, size = lights.names.index(lit), self._painting.size[::-1]
        if kind == "spheres":
            return spheres.radiance(scene.camera, lights, light)
        card = card_radiance(self._studio, light)
        if kind == "grey-scale":
            return np.asarray(charts.grey_scale().image(size) * card)
        if kind == "colour":
            return np.asarray(charts.colour_chart().image(size) * card)
        return card

    @cached_property
    def _scene(self) -> Scene:
        return Scene(set_up(self._painting)[0].surface, self._stand.plan.camera, cast_shadows=True)

    @cached_property
    def _studio(self) -> Studio:
        size = self._painting.size[::-1]
        return Studio(self._stand.plan.lights, self._scene.camera, self._sensor, size, "", "none", 0)
