"""Calibration shots of the simulated camera: dark frame, white card, charts, black trap, mirror spheres."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from impasto.capture.simulate import charts, glare, spheres
from impasto.capture.simulate.camera import EXPOSURE_S, Sensor
from impasto.capture.simulate.files import write_image
from impasto.capture.simulate.illumination import light_at
from impasto.geometry import Array, Camera, Lights, pixel_position_mm
from impasto.images import Compression
from impasto.output import prepare_folder, write_text

_WHITE_OF_CHART = 0.8


@dataclass(frozen=True)
class Studio:
    """What the calibration shots share with the painting's.

    Parameters
    ----------
    lights : Lights
    camera : Camera
    sensor : Sensor
    size : (int, int)
        Height and width of a photograph.
    ending : str
        Of the image files.
    compression : {'zstd', 'deflate', 'lzw', 'none'}
    seed : int
    """

    lights: Lights
    camera: Camera
    sensor: Sensor
    size: tuple[int, int]
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
        "grey_scale.csv": lambda: charts.grey_scale().table(studio.size),
        "colour_chart.csv": lambda: charts.colour_chart().table(studio.size),
        "glare.csv": lambda: glare.table(studio.size),
        "spheres/spheres.csv": lambda: spheres.table(studio.camera),
    }
    for name, table in tables.items():
        if not (folder / name).exists():
            write_text(folder / name, table())
    for shot, (name, radiance, ev) in enumerate(_shots(studio)):
        path = folder / (name + studio.ending)
        if not path.exists():
            rng = np.random.default_rng((studio.seed, 3, shot))
            image = studio.sensor.expose(radiance(), rng, ev)
            write_image(path, image, studio.compression, exposure_s=EXPOSURE_S * 2.0**ev)


def _shots(studio: Studio) -> Iterator[tuple[str, Callable[[], Array], float]]:
    """Yield each shot's name, the function that gives its radiance, and its exposure in stops."""
    size, frontal = studio.size, studio.frontal
    yield "dark", lambda: np.zeros((*size, 3)), 0
    yield "white_card", partial(card_radiance, studio, frontal), 0
    # A chart is exposed so that its white just does not clip.
    full = np.log2(_WHITE_OF_CHART / (studio.sensor.exposure * studio.lights.intensity[frontal].max()))
    yield "grey_scale", lambda: charts.grey_scale().image(size) * card_radiance(studio, frontal), full
    yield (
        "grey_scale_card",
        partial(card_radiance, studio, frontal),
        full - 1,
    )  # within its range
    yield "colour_chart", lambda: charts.colour_chart().image(size) * card_radiance(studio, frontal), 0
    for light, name in enumerate(studio.lights.names):
        yield f"spheres/{name}", partial(spheres.radiance, studio.camera, studio.lights, light), 0
        if studio.lights.near:
            yield f"flat/{name}", partial(card_radiance, studio, light), 0
    yield "glare", lambda: glare.seen(glare.trap(size) * card_radiance(studio, frontal)), full


def card_radiance(studio: Studio, light: int) -> Array:
    """Return the radiance of a perfect white diffuser that fills the frame, under one light."""
    height, width = studio.size
    px = studio.camera.mm_per_px or 1.0
    flat = pixel_position_mm(slice(0, height), slice(0, width), height, width, px)
    place = np.column_stack([flat.astype(np.float64), np.zeros(len(flat))])
    direction, fall_off = light_at(studio.lights, light, place)
    shade = np.broadcast_to(direction[..., 2] * fall_off, len(place)).reshape(height, width, 1)
    return np.asarray(np.broadcast_to(shade * studio.lights.intensity[light], (height, width, 3)))
