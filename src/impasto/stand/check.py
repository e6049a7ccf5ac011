"""Check photographs that were taken without the program as it checks its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.capture import Capture, read_capture
from impasto.capture.photographs import find_photographs
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.geometry import Array
from impasto.progress import progress
from impasto.stack.brackets import Exposure, read_brackets
from impasto.stand.checks.coverage import Coverage
from impasto.stand.checks.finding import Finding
from impasto.stand.checks.spheres import check_spheres
from impasto.stand.judge import Judge
from impasto.stand.look import Look, look_at
from impasto.stand.plan_file import Limits
from impasto.stand.steps import CALIBRATION, Shot

# What lies in the folder of calibration shots under names that begin so, as a plan calls them.
_BESIDES = ("dark", "ambient", "white", "grey-scale", "colour")


@dataclass(frozen=True)
class CheckedCapture:
    """What `check` found.

    Parameters
    ----------
    folder : Path
    photographs : int
        Of the painting, further exposures among them.
    names : tuple of str, length L
        The longest exposures.
    clipped : ndarray of shape (L,)
        Share of the samples of each that are at full scale.
    shift_px : ndarray of shape (L, 2)
        Columns and rows by which each lies off those under the lamps nearest to its own; NaN where nobody can
        tell.
    findings : tuple of Finding
    coverage : Coverage or None
    """

    folder: Path
    photographs: int
    names: tuple[str, ...]
    clipped: Array
    shift_px: Array
    findings: tuple[Finding, ...]
    coverage: Coverage | None


def check(
    folder: str | PathLike[str],
    *,
    lights: str | PathLike[str] | None = None,
    limits: Limits | None = None,
    show_progress: bool | None = None,
) -> CheckedCapture:
    """Check the photographs of a capture.

    Parameters
    ----------
    folder : path
        As `impasto stack` reads it. In ``calibration`` the spheres and what is named ``dark``, ``ambient``,
        ``white``, ``grey-scale`` or ``colour`` are looked at too.
    lights : path, optional
        Light file; found in the folder if it is the only one.
    limits : Limits, optional
        From when on something is a finding.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    CheckedCapture

    Raises
    ------
    CaptureError
        If photographs or lights cannot be read at all.
    """
    capture = read_capture(folder, lights)
    groups = read_brackets(capture, capture.brackets)
    judge = Judge(capture.lights, capture.camera, limits or Limits())
    # The lights' intensity counts exposures already: a shot's time is relative to the first of its light.
    taken = [
        (_shot(capture, name, group, number), exposure.photograph)
        for name, group in zip(capture.lights.names, groups, strict=True)
        for number, exposure in enumerate(group)
    ]
    longest: dict[Shot, Look] = {}
    findings: list[Finding] = []
    broken: list[Problem] = []
    with progress("Checking photographs", len(taken), show=show_progress) as advance:
        for shot, photograph in taken:
            try:
                look = look_at(photograph.path, photograph.transfer, capture.clip_level)
            except CaptureError as error:
                broken += error.problems
            else:
                if shot.bracket:
                    findings += judge.judge(shot, look)
                else:
                    longest[shot] = look.thinned()
                judge.accept(shot, look)
            advance(1)
    # Now that all are known, each is compared with those under the lamps nearest to its own.
    findings += [finding for shot, look in longest.items() for finding in judge.judge(shot, look)]
    for kind, path in _besides(Path(folder)):
        try:
            look = look_at(path, None, capture.clip_level)
        except CaptureError as error:
            broken += error.problems
        else:
            time = _relative_time(look, list(longest.values()))
            shot = Shot(f"{CALIBRATION}/{path.stem}", kind, None, time, 0, True)
            findings += judge.judge(shot, look)
            judge.accept(shot, look)
    raise_problems(CaptureError, broken)
    return CheckedCapture(
        folder=Path(folder),
        photographs=len(taken),
        names=tuple(shot.name for shot in longest),
        clipped=np.array([look.clipped for look in longest.values()]),
        shift_px=np.array([judge.shift_px.get(shot.name, (np.nan, np.nan)) for shot in longest]),
        findings=(*findings, *judge.order(), *_spheres(Path(folder), capture)),
        coverage=judge.coverage(),
    )


def _shot(capture: Capture, place: str, group: Sequence[Exposure], number: int) -> Shot:
    path = group[number].photograph.path
    try:
        name = path.relative_to(capture.light_file.parent).with_suffix("")
    except ValueError:  # the light file lies elsewhere
        name = Path(path.stem)
    return Shot(name.as_posix(), "painting", place, group[number].time, number, number == len(group) - 1)


def _besides(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield what is in the photographs beside the painting's, and these."""
    place = folder / CALIBRATION
    for path in find_photographs(place) if place.is_dir() else ():
        for kind in _BESIDES:
            if path.stem == kind or path.stem.startswith((f"{kind}-", f"{kind}_")):
                yield kind, path


def _relative_time(look: Look, longest: Sequence[Look]) -> float:
    """Return the exposure time relative to the painting's longest, 1 where the files do not say."""
    own, others = look.photograph.exposure_s, [other.photograph.exposure_s for other in longest]
    known = [time for time in others if time]
    return own / float(np.median(known)) if own and known else 1.0


def _spheres(folder: Path, capture: Capture) -> list[Finding]:
    """Return what is wrong with the photographs of spheres, if there are some."""
    place = folder / CALIBRATION / "spheres"
    if not place.is_dir():
        return []
    paths = {f"{CALIBRATION}/spheres/{path.stem}": path for path in find_photographs(place)}
    lights = zip(capture.lights.names, capture.lights.direction, strict=True)
    planned = {f"{CALIBRATION}/spheres/{name}": direction for name, direction in lights}
    return check_spheres(paths, planned, capture.camera)
