"""Plan a capture: places of the lamps, exposures, calibration shots, and what it takes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from impasto.capture.light_files import read_light_file
from impasto.capture.lights import check_rows
from impasto.capture.simulate.lamps import dome_directions
from impasto.errors import CaptureError, ImpastoError, OptionError, Problem, raise_problems
from impasto.output import write_text
from impasto.stand.drivers import CAMERAS, LIGHTS, settings_of
from impasto.stand.metering import Metering, meter
from impasto.stand.plan_file import SUBJECTS, Plan, parse_plan
from impasto.stand.plan_text import plan_text
from impasto.stand.steps import shots

CALIBRATION = ("dark", "white", "ambient")
"""What is photographed besides the painting if nobody says otherwise."""

_USUAL_TIMES_S = (0.5, 0.0625, 0.0078)
# What moving the lamp takes, by the light's driver; for the estimate only.
_MOVE_S = {"hand": 15.0, "gcode": 5.0, "dmx": 0.1, "command": 2.0, "simulated": 0.0}
_SETTLE_S = {"hand": 1.0, "gcode": 1.0, "dmx": 0.3, "command": 1.0, "simulated": 0.0}
_ARM_DEG = 1e-6


@dataclass(frozen=True)
class CapturePlanSummary:
    """What `plan` wrote.

    Parameters
    ----------
    file : Path
    places, exposures, photographs : int
        Lamps, exposures of each, and photographs in all, those for calibration among them.
    hours : float
        About how long it takes.
    gigabytes : float
        About how much room the photographs need.
    order : tuple of str
        What is photographed, in words.
    notes : tuple of str
    """

    file: Path
    places: int
    exposures: int
    photographs: int
    hours: float
    gigabytes: float
    order: tuple[str, ...]
    notes: tuple[str, ...]


def plan(
    out: str | PathLike[str],
    *,
    arm_deg: Sequence[float] = (),
    dome: int | None = None,
    lights: str | PathLike[str] | None = None,
    camera: str = "folder",
    light: str = "hand",
    times_s: Sequence[float] = (),
    meter_photograph: str | PathLike[str] | None = None,
    meter_exposure_s: float | None = None,
    meter_place: str | None = None,
    calibration: Iterable[str] = CALIBRATION,
    title: str = "",
    overwrite: bool = False,
) -> CapturePlanSummary:
    """Write a plan.

    Parameters
    ----------
    out : path
        The file to write, ending in .toml.
    arm_deg : sequence of float, optional
        Angles of an arm in degrees.
    dome : int, optional
        So many places spread evenly over a dome.
    lights : path, optional
        A light file, such as ``impasto angles --plan`` writes. One of these three has to be given.
    camera, light : str, optional
        Drivers, see `CAMERAS` and `LIGHTS`.
    times_s : sequence of float, optional
        Exposure times of each light.
    meter_photograph : path, optional
        A metering shot, from which the exposure times of each light follow.
    meter_exposure_s : float, optional
        Its exposure time, if the file does not say it.
    meter_place : str, optional
        The place of its lamp; by default that nearest to the painting's normal.
    calibration : iterable of str, optional
        What to photograph besides the painting: keys of `SUBJECTS`.
    title : str, optional
    overwrite : bool, optional
        Whether to replace a plan that is there.

    Returns
    -------
    CapturePlanSummary

    Raises
    ------
    OptionError
        With everything that is wrong with the options.
    CaptureError
        If the light file or the metering shot cannot be used.
    OutputError
        If the plan cannot be written.
    """
    path = Path(out)
    calibration = tuple(calibration)
    problems = [
        *_option_problems(path, camera, light, calibration, overwrite),
        *_exclusive(
            {"--arm": bool(len(arm_deg)), "--dome": dome is not None, "--lights": lights is not None}
        ),
    ]
    if len(times_s) and meter_photograph is not None:
        what = "were both given, expected one of them"
        problems.append(Problem("--times and --meter", what, "Leave one of them out"))
    metering = None
    try:
        metering = None if meter_photograph is None else meter(Path(meter_photograph), meter_exposure_s)
    except ImpastoError as error:
        problems += error.problems
    raise_problems(OptionError, problems)
    places = _places(arm_deg, dome, lights)
    frontal = max(places, key=_cosine)["name"]
    times, remarks = list(times_s or _USUAL_TIMES_S), []
    if metering is not None:
        times = _meter_places(places, metering, meter_place or frontal)
        remarks += list(metering.remarks())
    elif not len(times_s):
        remarks.append("Exposure times are a guess: give a metering shot, or correct them")
    if light == "dmx":
        for number, place in enumerate(places, start=1):
            place["dmx_channel"] = number
    content: dict[str, Any] = {
        "impasto_plan": 1,
        **({"title": title} if title else {}),
        "camera": {
            "driver": camera,
            "view": [0.0, 0.0, 1.0],
            "transfer_s": 0.0 if camera == "simulated" else 2.0,
            camera: settings_of(CAMERAS, camera)().model_dump(exclude_none=True),
        },
        "light": {
            "driver": light,
            "move_s": _MOVE_S[light],
            "settle_s": _SETTLE_S[light],
            light: settings_of(LIGHTS, light)().model_dump(exclude_none=True),
        },
        "exposure": {
            "times_s": times,
            "photograph_mb": metering.photograph_mb if metering else 0.2 if camera == "simulated" else 60.0,
        },
        "limits": {"clipped": 0.001, "dark": 0.03, "moved_px": 0.33, "blur": 0.15, "ambient": 0.01},
        "calibration": _calibration(calibration, times, frontal),
        "place": places,
    }
    made = parse_plan(plan_text(content, ()), path)
    hours, gigabytes = estimate(made)
    count = len(shots(made))
    remarks.append(f"{count} photographs, about {hours:.1f} h and {gigabytes:.1f} GB")
    write_text(path, plan_text(content, remarks))
    return CapturePlanSummary(
        file=path,
        places=len(places),
        exposures=len(times),
        photographs=count,
        hours=hours,
        gigabytes=gigabytes,
        order=tuple(dict.fromkeys(SUBJECTS[shot.kind] for shot in shots(made))),
        notes=tuple(remarks[:-1]),
    )


def estimate(plan: Plan) -> tuple[float, float]:
    """Return about how many hours a capture takes, and how many GB."""
    camera, light, taken = plan.file.camera, plan.file.light, shots(plan)
    stops = sum(a.place != b.place or a.kind != b.kind for a, b in pairwise(taken)) + 1
    seconds = sum(shot.exposure_s + camera.transfer_s for shot in taken)
    seconds += stops * (light.move_s + light.settle_s)
    return seconds / 3600, len(taken) * plan.file.exposure.photograph_mb / 1000


def _option_problems(
    path: Path, camera: str, light: str, calibration: Sequence[str], overwrite: bool
) -> list[Problem]:
    problems = []
    for option, value, choices in (
        ("--camera", camera, tuple(CAMERAS)),
        ("--light", light, tuple(LIGHTS)),
        *(("--calibration", kind, tuple(kind for kind in SUBJECTS if kind != "painting"))
          for kind in calibration),
    ):  # fmt: skip
        if value not in choices:
            do = f"Choose from {', '.join(choices)}"
            problems.append(Problem(f"{option} {value}", "does not exist", do))
    if path.suffix.lower() != ".toml":
        problems.append(Problem(str(path), "does not end in .toml", "Name it for example plan.toml"))
    elif path.exists() and not overwrite:
        do = "Choose another name, or replace it with --overwrite"
        problems.append(Problem(str(path), "is there already", do))
    return problems


def _exclusive(given: dict[str, bool]) -> list[Problem]:
    used = [option for option, there in given.items() if there]
    if len(used) == 1:
        return []
    what = f"were given: {', '.join(used)}" if used else "are missing"
    do = "Say where the lamps stand: one of " + ", ".join(given)
    return [Problem("places of the lamps", f"{what}; expected exactly one", do)]


def _places(
    arm_deg: Sequence[float], dome: int | None, lights: str | PathLike[str] | None
) -> list[dict[str, Any]]:
    if lights is not None:
        return _read_places(Path(lights))
    if dome is not None:
        if not 1 <= dome <= 999:
            raise OptionError(Problem(f"--dome {dome}", "is not from 1 to 999", "Give a number of places"))
        return [_placed(f"dome{number:03d}", direction) for number, direction in
                enumerate(dome_directions(dome), start=1)]  # fmt: skip
    bad = [angle for angle in arm_deg if not -89.5 <= angle <= 89.5]
    raise_problems(
        OptionError,
        [Problem(f"--arm {angle:g}", "is not from -89.5 to 89.5", "Correct the angle") for angle in bad],
    )
    whole = all(float(angle).is_integer() for angle in arm_deg)
    return [
        {"name": f"arm{angle:+04.0f}" if whole else f"arm{angle:+06.1f}", "arm_angle_deg": float(angle)}
        for angle in arm_deg
    ]


def _read_places(path: Path) -> list[dict[str, Any]]:
    file = read_light_file(path)
    problems = [*file.problems, *check_rows(file.rows, None)[0]]
    raise_problems(CaptureError, problems)
    places = []
    for number, row in enumerate(file.rows, start=1):
        name = Path(row.file or f"light-{number:03d}").name
        place = _placed(Path(name).stem if Path(name).suffix[1:].isalpha() else name, np.array(row.direction))
        if row.position_mm is not None:
            place = {"name": place["name"], "position_mm": list(row.position_mm)}
        if row.gain != (1.0,):
            place["gain"] = list(row.gain)
        places.append(place)
    return places


def _placed(name: str, direction: np.ndarray[Any, Any]) -> dict[str, Any]:
    """Return a place in the way that a person finds it: by the arm's angle, or by zenith and azimuth."""
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    if abs(y) < _ARM_DEG:
        return {"name": name, "arm_angle_deg": round(math.degrees(math.atan2(x, z)), 3)}
    zenith, azimuth = math.degrees(math.acos(z)), math.degrees(math.atan2(y, x)) % 360
    return {"name": name, "zenith_deg": round(zenith, 3), "azimuth_deg": round(azimuth, 3)}


def _meter_places(places: list[dict[str, Any]], metering: Metering, metered: str) -> list[float]:
    """Give each place its exposure times, and return those of the metered one."""
    by_name = {place["name"]: place for place in places}
    if metered not in by_name:
        do = f"Name one such as {places[0]['name']}"
        raise OptionError(Problem(f"--meter-place {metered}", "is no place of the plan", do))
    cosine = _cosine(by_name[metered])
    usual = metering.times_s(1.0, 1.0)
    for place in places:
        times = metering.times_s(_cosine(place), cosine, len(usual))
        if times != usual:
            place["times_s"] = times
    return usual


def _cosine(place: dict[str, Any]) -> float:
    if "position_mm" in place:
        return float(place["position_mm"][2] / np.linalg.norm(place["position_mm"]))
    return math.cos(math.radians(place.get("arm_angle_deg", place.get("zenith_deg", 0.0))))


def _calibration(kinds: Sequence[str], times: Sequence[float], frontal: str) -> list[dict[str, Any]]:
    """Return the tables of what is photographed besides, in an order in which little has to be moved."""
    shot: list[dict[str, Any]] = []
    longest, middle = times[0], times[len(times) // 2]
    for kind in sorted(set(kinds), key=list(SUBJECTS).index):
        entry: dict[str, Any] = {"kind": kind, "name": kind}
        if kind in ("dark", "ambient"):
            entry["times_s"] = [longest]
        elif kind == "spheres":
            entry |= {"times_s": [middle], "each_place": True}
        else:
            entry |= {"times_s": [middle], "place": frontal}
        shot.append(entry)
    if "ambient" in kinds:
        # The painting lies there for it: it comes next to the painting's own, and again at their end.
        ambient = next(entry for entry in shot if entry["kind"] == "ambient")
        shot.remove(ambient)
        shot += [ambient, {**ambient, "name": "ambient-after", "after": True}]
    return shot
