"""The plan of a capture: a TOML file that a person can read and edit, and what is wrong with it."""

from __future__ import annotations

import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from impasto.capture.lights import LightRow, check_rows, make_lights
from impasto.capture.lights_toml import LampTable
from impasto.capture.toml_tables import (
    CameraTable,
    NotNegative,
    PhotographsTable,
    Positive,
    Table,
    camera_of,
    table_problems,
)
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.geometry import Camera, Lights
from impasto.stand.drivers import CAMERAS, LIGHTS, settings_of

SUBJECTS = {
    "dark": "the cap on the lens",
    "ambient": "the painting, with every lamp of the stand off",
    "white": "an even white card in the painting's place",
    "grey-scale": "the grey scale in the painting's place",
    "colour": "the colour target in the painting's place",
    "scale-bar": "a ruler in the painting's plane",
    "spheres": "the mirror spheres in the painting's place",
    "painting": "the painting",
}
"""What stands before the camera, by the name of each kind of photograph."""

_Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=60)]
_Share = Annotated[float, Field(ge=0, le=1)]


class CameraPlan(CameraTable):
    """The table ``[camera]``: what takes the photographs, and where it stands.

    `driver` names one of `CAMERAS`; the table of that name below holds its settings.
    """

    driver: str
    transfer_s: NotNegative = 2.0


class LightPlan(Table):
    """The table ``[light]``: what moves and switches the lamps; `driver` is one of `LIGHTS`."""

    driver: str
    settle_s: NotNegative = 1.0
    move_s: NotNegative = 5.0


class Limits(Table):
    """The table ``[limits]``: from when on a photograph is to be taken again; see docs/copy-stand.md."""

    clipped: _Share = 0.001
    dark: _Share = 0.03
    moved_px: Positive = 0.33
    blur: Annotated[float, Field(gt=0, lt=1)] = 0.15
    ambient: _Share = 0.01


class Exposure(Table):
    """The table ``[exposure]``: the times of each light that has none of its own, longest first."""

    times_s: list[Positive] = Field(min_length=1, max_length=9)
    photograph_mb: Positive = 60.0


class Calibration(Table):
    """A photograph of something else than the painting: one of ``[[calibration]]``."""

    kind: Literal["dark", "ambient", "white", "grey-scale", "colour", "scale-bar", "spheres"]
    name: _Name
    times_s: list[Positive] = Field(min_length=1, max_length=9)
    place: str | None = None
    each_place: bool = False
    after: bool = False


class PlacePlan(LampTable):
    """One of ``[[place]]``, in the order in which they are lit."""

    name: _Name
    times_s: list[Positive] = Field(default_factory=list, max_length=9)
    dmx_channel: Annotated[int, Field(ge=1, le=512)] | None = None

    def light(self) -> LightRow:
        """Return the place as the light of its photograph; see `LampTable.row`."""
        return self.row(f"place {self.name}", self.name)


class PlanFile(Table):
    """The whole file."""

    impasto_plan: Literal[1] = 1
    title: str = ""
    camera: CameraPlan
    light: LightPlan
    photographs: PhotographsTable = PhotographsTable()
    exposure: Exposure
    limits: Limits = Limits()
    calibration: list[Calibration] = Field(default_factory=list)
    place: list[PlacePlan] = Field(min_length=1)


@dataclass(frozen=True)
class Plan:
    """A plan that has been checked as a whole.

    Parameters
    ----------
    path : Path
    text : str
        The file as it was read.
    file : PlanFile
    camera : Camera
        Where the camera stands.
    lights : Lights
        One per place, in their order, with the places' names.
    camera_settings, light_settings : Table
        As the drivers want them.
    """

    path: Path
    text: str
    file: PlanFile
    camera: Camera
    lights: Lights
    camera_settings: Table
    light_settings: Table

    def times_s(self, place: PlacePlan) -> list[float]:
        """Return the exposure times at a place, longest first."""
        return sorted(place.times_s or self.file.exposure.times_s, reverse=True)

    def place(self, name: str) -> PlacePlan:
        """Return the place of a name."""
        return next(place for place in self.file.place if place.name == name)


def read_plan(path: Path) -> Plan:
    """Read and check a plan.

    Raises
    ------
    CaptureError
        With everything that is wrong with it.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8"
        do = "Give the file that impasto capture plan wrote"
        raise CaptureError(Problem(str(path), f"cannot be read: {reason}", do)) from error
    return parse_plan(text, path)


def parse_plan(text: str, path: Path) -> Plan:
    """Return the plan in a text; `path` is what messages call it. Errors as for `read_plan`."""
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        problem = Problem(path.name, f"is not valid TOML: {error}", "Correct the syntax there")
        raise CaptureError(problem) from error
    problems: list[Problem] = []
    own = [
        _take_settings(content, table, drivers, path.name, problems)
        for table, drivers in (("camera", CAMERAS), ("light", LIGHTS))
    ]
    try:
        file = PlanFile.model_validate(content)
    except ValidationError as error:
        raise CaptureError([*problems, *table_problems(path.name, content, PlanFile, error)]) from error
    camera = Camera()
    try:
        camera = camera_of(file.camera, f"{path.name} [camera]")
    except CaptureError as error:
        problems += error.problems
    lights, more = _lights(file, path.name)
    problems += more + _disagreements(file, path.name)
    raise_problems(CaptureError, problems)
    assert lights is not None
    assert own[0] is not None
    assert own[1] is not None
    return Plan(path, text, file, camera, lights, own[0], own[1])


def _take_settings(
    content: dict[str, Any], table: str, drivers: dict[str, str], name: str, problems: list[Problem]
) -> Table | None:
    """Take the driver's own table out of that of camera or light, and return it as the driver has it."""
    entry = content.get(table)
    driver = entry.get("driver") if isinstance(entry, dict) else None
    if not isinstance(entry, dict) or not isinstance(driver, str):
        return None  # pydantic says so
    given = entry.get(driver, {})
    # What other drivers would want may stay in the plan.
    content[table] = {key: value for key, value in entry.items() if key not in drivers and key != driver}
    if driver not in drivers:
        do = f"Choose from {', '.join(drivers)}"
        problems.append(Problem(f"{name} [{table}]", f"there is no driver {driver!r}", do))
        return None
    model = settings_of(drivers, driver)
    try:
        return model.model_validate(given)
    except ValidationError as error:
        problems += [
            Problem(f"{name} [{table}.{driver}]" + found.where.removeprefix("settings"), found.what, found.do)
            for found in table_problems("settings", given, model, error)
        ]
        return None


def _lights(file: PlanFile, name: str) -> tuple[Lights | None, list[Problem]]:
    rows, problems = [], []
    for place in file.place:
        try:
            rows.append(place.light())
        except ValueError as error:
            problems.append(Problem(f"{name} place {place.name}", str(error), "Correct this place"))
    problems += check_rows(rows, None)[0]
    if problems:
        return None, problems
    return make_lights(rows, [place.name for place in file.place], np.ones(len(rows))), []


def _disagreements(file: PlanFile, name: str) -> list[Problem]:
    problems = []
    for kind, names in (
        ("place", [place.name.casefold() for place in file.place]),
        ("calibration", [shot.name.casefold() for shot in file.calibration]),
    ):
        problems += [
            Problem(name, f"{count} tables [[{kind}]] have the name {repeated}", "Give each its own")
            for repeated, count in Counter(names).items()
            if count > 1
        ]
    counts = {len(place.times_s or file.exposure.times_s) for place in file.place}
    if len(counts) > 1:
        what = f"places have {min(counts)} to {max(counts)} exposures, expected equally many at each"
        do = "Give each place as many times_s as [exposure] has; the times may differ"
        problems.append(Problem(name, what, do))
    places = {place.name for place in file.place}
    for shot in file.calibration:
        where = f"{name} calibration {shot.name}"
        if shot.kind in ("dark", "ambient"):
            if shot.place is not None or shot.each_place:
                do = "Leave place and each_place out"
                problems.append(Problem(where, f"{shot.kind} is photographed without a lamp", do))
        elif shot.each_place == (shot.place is not None):
            do = "Give place, or each_place = true"
            problems.append(Problem(where, "needs a lamp: the name of a place, or each of them", do))
        if shot.place is not None and shot.place not in places:
            problems.append(Problem(where, f"there is no place {shot.place}", "Correct the name"))
    if file.light.driver == "dmx":
        problems += [
            Problem(f"{name} place {place.name}", "key dmx_channel is missing", "Add dmx_channel = …")
            for place in file.place
            if place.dmx_channel is None
        ]
    return problems
