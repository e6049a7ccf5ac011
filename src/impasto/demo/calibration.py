"""The demo's calibration from shots of the simulator: spheres, grey scale, cap on, card, colours, trap."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impasto import calibrate
from impasto.calibrate.colour import Colour
from impasto.calibrate.dark import Dark
from impasto.calibrate.flat import Flat
from impasto.calibrate.glare import Glare
from impasto.calibrate.lights import LightsCalibration
from impasto.calibrate.oecf import Oecf
from impasto.calibrate.steadiness import Steadiness
from impasto.calibrate.white import White
from impasto.capture import read_capture
from impasto.geometry import Lights, degrees_between

PART = "calibration"
"""What it makes in the demo's folder."""


@dataclass(frozen=True)
class CalibrationSummary:
    """What was found about the simulated studio.

    Parameters
    ----------
    lights : LightsCalibration
    off_deg : float
        Median angle between the directions found and those of the simulated lamps.
    response : Oecf
    dark : Dark
    flat : Flat
    white : White
    colour : Colour
    """

    lights: LightsCalibration
    off_deg: float
    response: Oecf
    dark: Dark
    flat: Flat
    white: White
    colour: Colour
    glare: Glare
    steadiness: Steadiness

    @property
    def lights_file(self) -> Path:
        """What `stack` reads of the lights."""
        return self.lights.folder / "lights.toml"

    @property
    def files(self) -> dict[str, Path]:
        """The calibration files that `stack` applies, by kind."""
        return {name: getattr(self, name).file for name in ("dark", "flat", "white", "colour", "steadiness")}


def commands(photos: Path, folder: Path, size: tuple[int, int]) -> tuple[str, ...]:
    """Return the commands that do what `calibrate_studio` does, without the program's name."""
    shots, made = photos / "calibration", folder / PART
    box = ",".join(str(edge) for edge in _middle(size))
    frontal = _frontal(read_capture(photos).lights)
    return (
        f"calibrate lights {shots}/spheres --camera {photos}/capture.toml --out {made}/lights",
        f"calibrate oecf {shots}/grey_scale.tif {shots}/grey_scale.csv {made}/oecf.json "
        f"--card {shots}/grey_scale_card.tif --dark {shots}/dark.tif",
        f"calibrate dark {shots}/dark.tif {made}/dark.json",
        f"calibrate flat {shots}/white_card.tif {made}/flat.json --dark {made}/dark.json",
        f"calibrate white {shots}/white_card.tif {made}/white.json --box {box} --reflectance 1 "
        f"--lights {made}/lights/lights.toml --light {frontal}",
        f"calibrate colour {shots}/colour_chart.tif {shots}/colour_chart.csv {made}/colour.json "
        f"--card {shots}/white_card.tif --dark {made}/dark.json",
        f"calibrate glare {shots}/glare.tif "
        + " ".join(f"--{name} {','.join(map(str, box))}" for name, box in _areas(shots).items()),
        f"calibrate steadiness {photos} {made}/steadiness.json",
    )


def calibrate_studio(photos: Path, folder: Path, size: tuple[int, int]) -> CalibrationSummary:
    """Find lights, response, dark level, evenness, white and colours of the simulated studio from its shots.

    Parameters
    ----------
    photos : Path
        Folder that `simulate` made.
    folder : Path
        The demo's; the calibration files become a folder in it.
    size : (int, int)
        Width and height of the photographs.

    Returns
    -------
    CalibrationSummary
    """
    shots, made = photos / "calibration", folder / PART
    lights = calibrate.lights(shots / "spheres", made / "lights", camera=photos / "capture.toml")
    response = calibrate.oecf(
        shots / "grey_scale.tif",
        shots / "grey_scale.csv",
        made / "oecf.json",
        card=shots / "grey_scale_card.tif",
        dark=shots / "dark.tif",
    )
    dark = calibrate.dark(shots / "dark.tif", made / "dark.json")
    flat = calibrate.flat(shots / "white_card.tif", made / "flat.json", dark=dark.file)
    true = read_capture(photos).lights
    white = calibrate.white(
        shots / "white_card.tif",
        made / "white.json",
        box=_middle(size),
        reflectance=1,
        lights=made / "lights" / "lights.toml",
        light=_frontal(true),
    )
    colour = calibrate.colour(
        shots / "colour_chart.tif",
        shots / "colour_chart.csv",
        made / "colour.json",
        card=shots / "white_card.tif",
        dark=dark.file,
    )
    areas = _areas(shots)
    glare = calibrate.glare(shots / "glare.tif", trap=areas["trap"], bright=areas["bright"])
    steadiness = calibrate.steadiness(photos, made / "steadiness.json")
    order = [true.names.index(name) for name in lights.names]
    off_deg = float(np.median(degrees_between(true.direction[order], lights.lights.direction)))
    return CalibrationSummary(lights, off_deg, response, dark, flat, white, colour, glare, steadiness)


def _areas(shots: Path) -> dict[str, tuple[int, ...]]:
    """Return where the black trap and the card beside it lie, by name."""
    with (shots / "glare.csv").open(encoding="utf-8") as file:
        return {row.pop("area"): tuple(map(int, row.values())) for row in csv.DictReader(file)}


def _middle(size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the box in the middle of the frame, where a flat field is 1."""
    width, height = size
    return width * 4 // 9, height * 4 // 9, width * 5 // 9, height * 5 // 9


def _frontal(lights: Lights) -> str:
    """Return the name of the light under which the simulator photographs cards and charts."""
    return lights.names[int(np.argmax(lights.direction[:, 2]))]
