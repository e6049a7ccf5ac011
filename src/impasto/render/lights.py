"""The lights that a rendering is asked for: from a light file, by zenith and azimuth, or along the arm."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path, PurePosixPath

import numpy as np

from impasto.capture.light_files import read_light_file
from impasto.capture.lights import LightRow, check_rows, make_lights, place
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.geometry import Camera, Lights

# More than anybody looks at: 100 s of film at 100 pictures per second.
_MOST_ANGLES = 10_000


def parse_angles(texts: Iterable[str]) -> list[float]:
    """Return arm angles in degrees from texts such as ``30``, ``-60,0,60`` and ``-60:60:5``.

    Parameters
    ----------
    texts : iterable of str
        Single angles, several with commas between them, or START:STOP:STEP with both ends included.

    Returns
    -------
    list of float

    Raises
    ------
    OptionError
        Listing every text that is none of these, or asks for more than 10,000 angles.
    """
    angles: list[float] = []
    problems = []
    for text in texts:
        try:
            if ":" in text:
                start, stop, step = (_finite(part) for part in text.split(":"))
                count = _steps(start, stop, step)
                if count > _MOST_ANGLES:
                    what = f"asks for {count:,} angles, expected {_MOST_ANGLES:,} at most"
                    problems.append(Problem(f"--arm {text}", what, "Give a larger step"))
                    continue
                angles += [round(start + index * step, 9) for index in range(count)]
            else:
                angles += [_finite(part) for part in text.split(",")]
        except ValueError:
            problems.append(
                Problem(
                    where=f"--arm {text}",
                    what="is not an angle, expected degrees such as 30 or a sweep START:STOP:STEP",
                    do="Write for example --arm 30 or --arm -60:60:5",
                )
            )
    raise_problems(OptionError, problems)
    return angles


def parse_light(text: str) -> tuple[float, float]:
    """Return zenith and azimuth in degrees from a text such as ``45,90``.

    Raises
    ------
    OptionError
        If the text is not two numbers.
    """
    try:
        zenith, azimuth = (_finite(part) for part in text.split(","))
    except ValueError:
        raise OptionError(
            Problem(
                where=f"--light {text}",
                what="is not a direction, expected ZENITH,AZIMUTH in degrees",
                do="Write for example --light 45,90 for a light from the top at 45° from the normal",
            )
        ) from None
    return zenith, azimuth


def requested_lights(
    lights: str | PathLike[str] | None,
    light: Sequence[tuple[float, float]],
    arm: Sequence[float],
    channels: int,
    camera: Camera,
) -> Lights:
    """Return the lights to render, in the order file, directions, arm angles.

    Parameters
    ----------
    lights : path, optional
        A light file, as `stack` reads it.
    light : sequence of (float, float)
        Zenith and azimuth in degrees.
    arm : sequence of float
        Arm angles in degrees.
    channels : int
        Channels of the stack.
    camera : Camera
        The stack's camera, whose scale near lights need.

    Returns
    -------
    Lights
        A light's name is that of its photograph in the file, without ending, or its number from 1.

    Raises
    ------
    OptionError
        If no light is asked for, or listing every light that cannot be used.
    CaptureError
        If the light file cannot be read.
    """
    rows: list[LightRow] = []
    unreadable: list[Problem] = []
    if lights is not None:
        file = read_light_file(Path(lights))
        unreadable = file.problems
        rows += file.rows
    for zenith_deg, azimuth_deg in light:
        direction, _ = place(zenith_deg=zenith_deg, azimuth_deg=azimuth_deg)
        rows.append(LightRow(where=f"--light {zenith_deg:g},{azimuth_deg:g}", file=None, direction=direction))
    for angle in arm:
        direction, _ = place(arm_angle_deg=angle)
        rows.append(LightRow(where=f"--arm {angle:g}", file=None, direction=direction))
    if not rows and not unreadable:
        raise OptionError(
            Problem(
                where="render",
                what="no light is given",
                do="Give --lights FILE, --light ZENITH,AZIMUTH or --arm DEG",
            )
        )
    names = [_name(row, number) for number, row in enumerate(rows, start=1)]
    problems, _ = check_rows(rows, channels)
    problems += [
        Problem(row.where, f"the name {name!r} is used {count} times", "Give each light a name of its own")
        for (name, count), row in zip(Counter(names).items(), _firsts(rows, names), strict=True)
        if count > 1
    ]
    near = [row for row in rows if row.position_mm is not None]
    if near and camera.mm_per_px is None:
        problems.append(
            Problem(
                where=near[0].where,
                what=f"{len(near)} lights have a position in mm, and the stack has no mm_per_px",
                do="State mm_per_px under [camera] in the photographs' TOML file and stack them again",
            )
        )
    raise_problems(CaptureError if unreadable else OptionError, [*unreadable, *problems])
    return make_lights(rows, names, np.ones(len(rows)))


def _name(row: LightRow, number: int) -> str:
    return str(number) if row.file is None else PurePosixPath(row.file.replace("\\", "/")).stem


def _firsts(rows: Sequence[LightRow], names: Sequence[str]) -> list[LightRow]:
    """Return the first row of each name, in the order in which the names appear."""
    first: dict[str, LightRow] = {}
    for row, name in zip(rows, names, strict=True):
        first.setdefault(name, row)
    return list(first.values())


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _steps(start: float, stop: float, step: float) -> int:
    """Return how many angles lie from `start` to `stop`, both included where the step meets the end."""
    if step == 0 or (stop - start) / step < 0:
        raise ValueError("the step leads away from the end")
    # A thousandth of a step makes up for the rounding of decimal fractions.
    return math.floor((stop - start) / step + 1e-3) + 1
