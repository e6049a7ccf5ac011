"""Calibration files: JSON with a version, what they were made from, and which photographs they are for."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from impasto.calibrate.shots import Shot, common
from impasto.errors import CaptureError, Problem
from impasto.output import prepare_folder, write_json

SCHEMA = 1
"""Version of the files' form; a program refuses files of a later one."""

_KEY = "impasto_calibration"

# What each kind holds at least.
_CONTENT = {
    "oecf": ("dtype", "response", "linear", "noise"),
    "dark": ("grid", "level"),
    "flat": ("grids", "fall_off_taken_out"),
    "colour": ("chosen", "methods", "white_xyz"),
    "white": ("radiance", "light_rgb", "reflectance", "normal", "box", "spread", "lights"),
    "steadiness": ("shift_px", "corrected", "turned_px"),
}


@dataclass(frozen=True)
class Subject:
    """Which photographs a calibration is for; None where that does not matter or is not known.

    Parameters
    ----------
    camera : str or None
        Make and model.
    iso : float or None
    f_number : float or None
    size : (int, int) or None
        Width and height in pixels.
    channels : int or None
    dtype : str or None
        "uint8" for photographs of 8 bits, whose tone curve is the camera's and whose steps are coarse.
    """

    camera: str | None = None
    iso: float | None = None
    f_number: float | None = None
    size: tuple[int, int] | None = None
    channels: int | None = None
    dtype: str | None = None

    def differences(self, other: Subject) -> list[str]:
        """Return in words how photographs of `other` are not those this is for."""
        words = {
            "camera": "camera {}",
            "iso": "ISO {:g}",
            "f_number": "aperture f/{:g}",
            "size": "{0[0]} x {0[1]} pixels",
            "channels": "{} channels",
            "dtype": "values of type {}",
        }
        differences = []
        for name, text in words.items():
            mine, theirs = getattr(self, name), getattr(other, name)
            if mine is not None and theirs is not None and mine != theirs:
                differences.append(f"{text.format(mine)}, and these photographs have {text.format(theirs)}")
        return differences


@dataclass(frozen=True)
class Calibration:
    """A calibration file as it was read.

    Parameters
    ----------
    path : Path
    kind : str
        ``oecf``, ``dark``, ``flat``, ``colour``, ``white``, ``steadiness`` or ``display``.
    subject : Subject
    content : dict
        What was calibrated.
    made_from : list of dict
        File name and SHA-256 of each input.
    """

    path: Path
    kind: str
    subject: Subject
    content: dict[str, Any]
    made_from: list[dict[str, Any]] = field(default_factory=list)


def subject_of(
    shots: list[Shot], *, iso: bool = False, f_number: bool = False, size: bool = False
) -> Subject:
    """Return which photographs a calibration made from `shots` is for.

    Parameters
    ----------
    shots : list of Shot
    iso, f_number, size : bool
        Whether another ISO, aperture or size makes it useless. Another camera always does.
    """
    first = shots[0].photograph
    return Subject(
        camera=common(shots, lambda photograph: photograph.camera),
        iso=common(shots, lambda photograph: photograph.iso) if iso else None,
        f_number=common(shots, lambda photograph: photograph.f_number) if f_number else None,
        size=(first.width, first.height) if size else None,
        channels=first.channels,
        dtype="uint8" if first.dtype.name == "uint8" else None,
    )


def write_calibration(
    path: Path,
    kind: str,
    content: Mapping[str, Any],
    *,
    subject: Subject | None = None,
    made_from: Iterable[Mapping[str, Any]],
) -> None:
    """Write a calibration file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    prepare_folder(path.parent)
    subject = subject or Subject()
    write_json(
        path,
        {
            _KEY: SCHEMA,
            "kind": kind,
            "program": f"impasto {version('impasto')}",
            "made_from": list(made_from),
            "for": {name: value for name, value in vars(subject).items() if value is not None},
            **content,
        },
    )


def read_calibration(path: Path, kind: str) -> Calibration:
    """Read a calibration file.

    Parameters
    ----------
    path : Path
    kind : str
        Which kind is needed.

    Raises
    ------
    CaptureError
        If it is missing, damaged, of another kind, or from a later version of the program.
    """
    remake = f"Make it again with impasto calibrate {kind}"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        schema, found = content.pop(_KEY), content.pop("kind")
        subject = content.pop("for")
        made_from = content.pop("made_from")
        if "size" in subject:
            subject["size"] = tuple(subject["size"])
        subject = Subject(**subject)
        missing = [name for name in _CONTENT.get(found, ()) if name not in content]
        later = int(schema) > SCHEMA
    except OSError as error:
        raise CaptureError(
            Problem(str(path), f"cannot be read: {error.strerror}", "Correct its name")
        ) from error
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise CaptureError(Problem(str(path), "is not a calibration file of impasto", remake)) from error
    if later:
        what = f"is of version {schema}, and this program reads up to {SCHEMA}"
        raise CaptureError(Problem(str(path), what, "Use a newer impasto, or make the file again"))
    if found != kind:
        what = f"is a calibration of kind {found}, expected {kind}"
        raise CaptureError(Problem(str(path), what, remake))
    if missing:
        what = f"is damaged: it lacks {', '.join(missing)}"
        raise CaptureError(Problem(str(path), what, remake))
    return Calibration(path, kind, subject, content, made_from)
