"""The demo's calibration from shots of the simulator: spheres, grey scale, cap on, card, colours, trap."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
    return tuple(
        " ".join(
            ["calibrate", kind, *map(str, files)]
            + [f"--{name} {_written(value)}" for name, value in options.items()]
        )
        for kind, files, options in _shots(photos, folder, size)
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
    found: dict[str, Any] = {
        kind: getattr(calibrate, kind)(*files, **options)
        for kind, files, options in _shots(photos, folder, size)
    }
    true, lights = read_capture(photos).lights, found["lights"]
    order = [true.names.index(name) for name in lights.names]
    off_deg = float(np.median(degrees_between(true.direction[order], lights.lights.direction)))
    return CalibrationSummary(off_deg=off_deg, response=found.pop("oecf"), **found)


def _shots(
    photos: Path, folder: Path, size: tuple[int, int]
) -> Iterator[tuple[str, tuple[Path, ...], dict[str, Any]]]:
    """Yield each `calibrate` command, the files that it takes and makes, and its options by name."""
    shots, made = photos / "calibration", folder / PART
    lights, dark, card = made / "lights", made / "dark.json", shots / "white_card.tif"
    scale, chart = shots / "grey_scale.tif", shots / "colour_chart.tif"
    yield "lights", (shots / "spheres",), {"camera": photos / "capture.toml", "out": lights}
    yield (
        "oecf",
        (scale, scale.with_suffix(".csv"), made / "oecf.json"),
        {"card": shots / "grey_scale_card.tif", "dark": shots / "dark.tif"},
    )
    yield "dark", (shots / "dark.tif", dark), {}
    yield "flat", (card, made / "flat.json"), {"dark": dark}
    yield (
        "white",
        (card, made / "white.json"),
        {
            "box": _middle(size),
            "reflectance": 1,
            "lights": lights / "lights.toml",
            "light": _frontal(read_capture(photos).lights),
        },
    )
    yield (
        "colour",
        (chart, chart.with_suffix(".csv"), made / "colour.json"),
        {"card": card, "dark": dark},
    )
    yield "glare", (shots / "glare.tif",), _areas(shots)
    yield "steadiness", (photos, made / "steadiness.json"), {}


def _written(value: Any) -> str:
    """Return an option's value as the command line takes it."""
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


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
