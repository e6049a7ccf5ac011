"""Calibration shots of the simulated camera: dark frame, white card, charts and mirror spheres."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from impasto.capture.simulate import charts, spheres
from impasto.capture.simulate.camera import Sensor
from impasto.capture.simulate.files import write_image
from impasto.capture.simulate.illumination import light_at
from impasto.geometry import Array, Camera, Lights, pixel_position_mm
from impasto.images import Compression
from impasto.output import prepare_folder, write_text


@dataclass(frozen=True)
class Studio:
    """What the calibration shots share with the painting's.

    Parameters
    ----------
    lights : Lights
    camera : Camera
    sensor : Sensor
    ending : str
        Of the image files.
    compression : {'zstd', 'deflate', 'lzw', 'none'}
    seed : int
    """

    lights: Lights
    camera: Camera
    sensor: Sensor
    ending: str
    compression: Compression
    seed: int

    @property
    def frontal(self) -> int:
        """The light nearest to the painting's normal, under which cards and charts are taken."""
        return int(np.argmax(self.lights.direction[:, 2]))


def write_calibration(folder: Path, studio: Studio) -> None:
    """Write all calibration shots; those that an interrupted run has written stay.

    Parameters
    ----------
    folder : Path
    studio : Studio
    """
    prepare_folder(folder / "spheres")
    tables: dict[str, Callable[[], str]] = {
        "grey_scale.csv": lambda: charts.grey_scale().table(),
        "colour_chart.csv": lambda: charts.colour_chart().table(),
        "spheres/spheres.csv": lambda: spheres.table(studio.camera),
    }
    for name, table in tables.items():
        if not (folder / name).exists():
            write_text(folder / name, table())
    for shot, (name, radiance) in enumerate(_shots(studio)):
        path = folder / (name + studio.ending)
        if not path.exists():
            rng = np.random.default_rng((studio.seed, 3, shot))
            write_image(path, studio.sensor.expose(radiance(), rng), studio.compression)


def _shots(studio: Studio) -> Iterator[tuple[str, Callable[[], Array]]]:
    """Yield each shot's name with the function that gives its radiance."""
    yield "dark", lambda: np.zeros((*charts.CARD_PX, 3))
    yield "white_card", lambda: _card(studio)
    yield "grey_scale", lambda: charts.grey_scale().image * _card(studio)
    yield "colour_chart", lambda: charts.colour_chart().image * _card(studio)
    for light, name in enumerate(studio.lights.names):
        yield f"spheres/{name}", partial(spheres.radiance, studio.camera, studio.lights, light)


def _card(studio: Studio) -> Array:
    """Return the radiance of a perfect white diffuser that fills the frame, under the most frontal light."""
    height, width = charts.CARD_PX
    light = studio.frontal
    flat = pixel_position_mm(slice(0, height), slice(0, width), height, width, charts.FRAME_MM / height)
    place = np.column_stack([flat.astype(np.float64), np.zeros(len(flat))])
    direction, fall_off = light_at(studio.lights, light, place)
    shade = np.broadcast_to(direction[..., 2] * fall_off, len(place)).reshape(height, width, 1)
    return np.asarray(np.broadcast_to(shade * studio.lights.intensity[light], (height, width, 3)))
