"""Lights as a light file gives them, and their check and conversion into `Lights`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from impasto.errors import Problem
from impasto.geometry import Array, Camera, Lights, arm_direction, dome_direction

Vector = tuple[float, float, float]

# A light within 0.2 arc seconds of the painting's plane lights nothing, and cos 90° is not 0 in floats.
_HORIZON = 1e-6
# Directions are often written with three decimals; only larger departures are worth a note.
_UNIT_TOLERANCE = 2e-3

_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)(e[-+]?\d+)?|[-+]?(nan|inf(inity)?)", re.IGNORECASE)


@dataclass(frozen=True)
class LightRow:
    """One light as its file gives it, not checked yet.

    Parameters
    ----------
    where : str
        File and row, for messages.
    file : str or None
        Name of the photograph as written; None in a file without names.
    direction : tuple of 3 floats
        Towards the light, of any length; a near light's position.
    position_mm : tuple of 3 floats or None
        Position of a near light.
    gain : tuple of float
        Relative irradiance, one number or one per channel.
    angular_size_deg : float
        Angular diameter of the source; NaN where unknown.
    exposure_s : float or None
        Exposure time of the photograph, instead of what its EXIF data say.
    """

    where: str
    file: str | None
    direction: Vector
    position_mm: Vector | None = None
    gain: tuple[float, ...] = (1.0,)
    angular_size_deg: float = math.nan
    exposure_s: float | None = None


@dataclass
class LightFile:
    """What a light file holds, and all that is wrong with it.

    Parameters
    ----------
    path : Path
    rows : list of LightRow
    notes : list of str
        What was assumed while reading.
    problems : list of Problem
    camera : Camera
    transfer : str or None
        Transfer function that overrides the photographs' own.
    clip_level : float or None
        Value, as stored in the photographs, from which on a sample is clipped.
    noise : dict of str to float
        Overrides of ``read``, ``photon`` and ``relative``.
    brackets : tuple of str
        Folders with further exposures of the same names, relative to that of the file.
    """

    path: Path
    rows: list[LightRow] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    camera: Camera = field(default_factory=Camera)
    transfer: str | None = None
    clip_level: float | None = None
    noise: dict[str, float] = field(default_factory=dict)
    brackets: tuple[str, ...] = ()


def parse_number(text: str) -> float:
    """Return a number written with a decimal point or a decimal comma.

    Raises
    ------
    ValueError
        If the text is not a number.
    """
    text = text.strip().replace("\N{MINUS SIGN}", "-")
    if not _NUMBER.fullmatch(text):
        raise ValueError(f"{text!r} is not a number")
    return float(text.replace(",", "."))


def place(
    *,
    direction: Sequence[float] | None = None,
    arm_angle_deg: float | None = None,
    zenith_deg: float | None = None,
    azimuth_deg: float | None = None,
    position_mm: Sequence[float] | None = None,
) -> tuple[Vector, Vector | None]:
    """Return the direction and the position, if any, of a light that is given in exactly one of four ways.

    Raises
    ------
    ValueError
        If it is given in no way or in several, or a vector has not three numbers.
    """
    ways = {
        "direction": direction is not None,
        "arm_angle_deg": arm_angle_deg is not None,
        "zenith_deg and azimuth_deg": zenith_deg is not None or azimuth_deg is not None,
        "position_mm": position_mm is not None,
    }
    given = [way for way, used in ways.items() if used]
    if len(given) != 1:
        raise ValueError(
            f"gives the light by {' and '.join(given) or 'nothing'}, expected exactly one of "
            f"{', '.join(ways)}"
        )
    with np.errstate(invalid="ignore"):  # infinite angles become NaN, which `check_rows` reports
        if arm_angle_deg is not None:
            return _vector(arm_direction(math.radians(arm_angle_deg))), None
        if zenith_deg is not None or azimuth_deg is not None:
            if zenith_deg is None or azimuth_deg is None:
                raise ValueError("gives only one of zenith_deg and azimuth_deg, expected both")
            return _vector(dome_direction(math.radians(zenith_deg), math.radians(azimuth_deg))), None
    if position_mm is not None:
        return _vector(position_mm), _vector(position_mm)
    assert direction is not None
    return _vector(direction), None


def check_rows(rows: Sequence[LightRow], channels: int | None) -> tuple[list[Problem], list[str]]:
    """Return all that is wrong with lights, and notes on directions that are not of unit length.

    Parameters
    ----------
    rows : sequence of LightRow
    channels : int or None
        Channels of the photographs, where they are known.
    """
    problems = []
    for row in rows:
        problems += _check_direction(row)
        problems += _check_numbers(row, channels)
    directional = [math.hypot(*row.direction) for row in rows if row.position_mm is None]
    lengths = [
        length
        for length in directional
        if math.isfinite(length) and length and abs(length - 1) > _UNIT_TOLERANCE
    ]
    notes = []
    if lengths:
        span = f"{min(lengths):.4g}" + (f" to {max(lengths):.4g}" if max(lengths) > min(lengths) else "")
        notes.append(
            f"{len(lengths)} of {len(rows)} directions have not unit length ({span}): normalised, their "
            "lengths are not taken for distances"
        )
    return problems, notes


def _check_direction(row: LightRow) -> list[Problem]:
    length = math.hypot(*row.direction)
    kind = "direction" if row.position_mm is None else "position_mm"
    if not math.isfinite(length):
        what, do = f"{kind} {_text(row.direction)} is not finite", "Give three finite numbers"
    elif length == 0:
        what, do = f"{kind} (0, 0, 0) points nowhere", f"Give the {kind} of this light"
    elif row.direction[2] / length <= _HORIZON:
        what = f"{kind} {_text(row.direction)} lies below the surface; z must be > 0"
        do = "Flip the sign or check the frame in docs/notation.md"
    else:
        return []
    return [Problem(row.where, what, do)]


def _check_numbers(row: LightRow, channels: int | None) -> list[Problem]:
    problems = []
    if not all(math.isfinite(gain) and gain > 0 for gain in row.gain):
        problems.append(
            Problem(
                row.where, f"gain {_text(row.gain)} is not above 0", "Give the light's relative intensity"
            )
        )
    if channels is not None and len(row.gain) not in (1, channels):
        problems.append(
            Problem(
                row.where,
                f"gain has {len(row.gain)} numbers, the photographs have {channels} channels",
                "Give one number, or one per channel",
            )
        )
    if not (math.isnan(row.angular_size_deg) or 0 <= row.angular_size_deg < 180):
        problems.append(
            Problem(
                row.where,
                f"angular_size_deg {row.angular_size_deg:g} is not from 0 to 180",
                "Give the angle under which the source appears from the painting, in degrees",
            )
        )
    if row.exposure_s is not None and not (math.isfinite(row.exposure_s) and row.exposure_s > 0):
        problems.append(
            Problem(row.where, f"exposure_s {row.exposure_s:g} is not above 0", "Give the time in seconds")
        )
    return problems


def make_lights(rows: Sequence[LightRow], names: Sequence[str], exposure: Array) -> Lights:
    """Return checked rows as `Lights`.

    Parameters
    ----------
    rows : sequence of LightRow, length L
    names : sequence of str, length L
        The photographs' names.
    exposure : ndarray of shape (L,), float64
        Relative exposure of each photograph, which multiplies the light's gain.
    """
    direction = np.array([row.direction for row in rows], dtype=np.float64)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    channels = max(len(row.gain) for row in rows)
    gain = np.array([row.gain * (channels // len(row.gain)) for row in rows], dtype=np.float64)
    return Lights(
        names=tuple(names),
        direction=direction,
        position_mm=np.array([row.position_mm or (np.nan,) * 3 for row in rows]),
        intensity=gain * exposure[:, None],
        angular_size_deg=np.array([row.angular_size_deg for row in rows]),
    )


def _vector(numbers: Sequence[float] | Array) -> Vector:
    if len(numbers) != 3:
        raise ValueError(f"gives {len(numbers)} numbers, expected 3: x, y, z")
    x, y, z = (float(number) for number in numbers)
    return x, y, z


def _text(numbers: Sequence[float]) -> str:
    return "(" + ", ".join(f"{number:.4g}" for number in numbers) + ")"
