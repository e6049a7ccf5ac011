"""The demo's calibration from the shots that the simulator makes: spheres, grey scale, cap on, colours."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impasto import calibrate
from impasto.calibrate.colour import Colour
from impasto.calibrate.dark import Dark
from impasto.calibrate.lights import LightsCalibration
from impasto.calibrate.oecf import Oecf
from impasto.capture import read_capture

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
    white : float
        What a white surface that faces the brightest lamp reads, as the simulation has it: pictures are
        brightened by as much.
    response : Oecf
    dark : Dark
    colour : Colour
    """

    lights: LightsCalibration
    off_deg: float
    white: float
    response: Oecf
    dark: Dark
    colour: Colour

    @property
    def lights_file(self) -> Path:
        """What `stack` reads of the lights."""
        return self.lights.folder / "lights.toml"


def commands(photos: Path, folder: Path) -> tuple[str, ...]:
    """Return the commands that do what `calibrate_studio` does, without the program's name."""
    shots, made = photos / "calibration", folder / PART
    return (
        f"calibrate lights {shots}/spheres --camera {photos}/capture.toml --out {made}/lights",
        f"calibrate oecf {shots}/grey_scale.tif {shots}/grey_scale.csv {made}/oecf.json "
        f"--card {shots}/grey_scale_card.tif --dark {shots}/dark.tif",
        f"calibrate dark {shots}/dark.tif {made}/dark.json",
        f"calibrate colour {shots}/colour_chart.tif {shots}/colour_chart.csv {made}/colour.json "
        f"--card {shots}/white_card.tif --dark {made}/dark.json",
    )


def calibrate_studio(photos: Path, folder: Path) -> CalibrationSummary:
    """Find lights, response, dark level and colours of the simulated studio from its calibration shots.

    Parameters
    ----------
    photos : Path
        Folder that `simulate` made.
    folder : Path
        The demo's; the calibration files become a folder in it.

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
    colour = calibrate.colour(
        shots / "colour_chart.tif",
        shots / "colour_chart.csv",
        made / "colour.json",
        card=shots / "white_card.tif",
        dark=dark.file,
    )
    true = read_capture(photos).lights
    order = [true.names.index(name) for name in lights.names]
    cosine = np.sum(true.direction[order] * lights.lights.direction, axis=1)
    off_deg = float(np.median(np.degrees(np.arccos(np.clip(cosine, -1, 1)))))
    return CalibrationSummary(lights, off_deg, float(true.intensity.max()), response, dark, colour)
