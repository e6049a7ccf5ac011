"""Take the camera's response from its calibration file."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from impasto.calibrate.files import Subject, read_calibration, subject_of
from impasto.calibrate.response import Array, Response
from impasto.calibrate.shots import Shot
from impasto.errors import CaptureError, Problem, raise_problems


def response_table(oecf: str | PathLike[str] | None, shots: list[Shot]) -> Array | None:
    """Return relative radiance of every code, ndarray of shape (codes, C), None without a calibration file.

    Raises
    ------
    CaptureError
        If the file cannot be read, or is for another camera, ISO or type of photographs.
    """
    if oecf is None:
        return None
    calibration = read_calibration(Path(oecf), "oecf")
    raise_problems(
        CaptureError,
        mismatches(calibration.path, calibration.subject, subject_of(shots, iso=True)),
    )
    dtype = shots[0].codes.dtype
    if dtype.name != calibration.content["dtype"]:
        what = (
            f"is for photographs of {calibration.content['dtype']}, and {shots[0].path.name} has {dtype.name}"
        )
        raise CaptureError(Problem(str(oecf), what, "Make it from photographs of the same type"))
    return Response.from_json(calibration.content["response"]).table(dtype)


def mismatches(path: Path, made_for: Subject, used_for: Subject) -> list[Problem]:
    """Return a problem for each way in which photographs are not those that a calibration is for."""
    return [
        Problem(path.name, f"is for {difference}", "Calibrate anew with these settings, or leave it out")
        for difference in made_for.differences(used_for)
    ]
