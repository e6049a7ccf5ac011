"""Drive a capture: light, expose, fetch, check, record; go on where an earlier run stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.errors import CaptureError, Problem, raise_problems
from impasto.output import prepare_folder
from impasto.stand.checks.coverage import Coverage
from impasto.stand.desk import STOP, Desk, Question
from impasto.stand.drivers import Camera, Light, Stand, open_camera, open_light
from impasto.stand.folder import RECORD, CaptureFolder, free_bytes
from impasto.stand.journal import alone
from impasto.stand.plan_file import Plan, read_plan
from impasto.stand.session import AGAIN, Session
from impasto.stand.steps import shots

__all__ = ["RunSummary", "run"]

_TRIES = 3


@dataclass(frozen=True)
class RunSummary:
    """What `run` did.

    Parameters
    ----------
    folder : Path
    photographs : int
        Of the plan.
    taken : int
        By this run, those that were taken again among them.
    before : int
        Those that earlier runs had taken.
    again : int
        Photographs that this run set aside and took again.
    complete : bool
        Whether all are there, and the manifest with them.
    kept_findings : tuple of Problem
        What is wrong with photographs that were kept.
    coverage : Coverage or None
        What a coarse fit says of the highlights.
    notes : tuple of str
    seconds : float
    """

    folder: Path
    photographs: int
    taken: int
    before: int
    again: int
    complete: bool
    kept_findings: tuple[Problem, ...]
    coverage: Coverage | None
    notes: tuple[str, ...]
    seconds: float


def run(
    plan: str | PathLike[str],
    out: str | PathLike[str],
    *,
    desk: Desk | None = None,
    open_camera: Callable[[Stand], Camera] = open_camera,
    open_light: Callable[[Stand], Light] = open_light,
    say: Callable[[str], None] = print,
) -> RunSummary:
    """Take the photographs of a plan that are not there yet.

    Parameters
    ----------
    plan : path
        File that `plan` wrote.
    out : path
        Folder to make, or one that an earlier run began.
    desk : Desk, optional
        Where a person watches and answers. By default nobody attends: what a person would have to do counts
        as done, a photograph that fails a check is taken three times, and then the run ends with an error.
    open_camera, open_light : callable, optional
        Make the camera and the light, if they are to be others than the plan's.
    say : callable, optional
        Called with lines for the terminal.

    Returns
    -------
    RunSummary

    Raises
    ------
    CaptureError
        If the plan or the folder cannot be used, another run is under way, or, where nobody attends, a
        photograph fails its checks or a device fails three times.
    OutputError
        If the disk is full or the folder cannot be written.
    """
    started = time.perf_counter()
    checked = read_plan(Path(plan))
    desk = desk or unattended()
    raise_problems(CaptureError, _room(checked, Path(out)))
    # Before the lock file makes it, what is no capture has to be told from what is one.
    CaptureFolder.check(Path(out))
    prepare_folder(Path(out) / RECORD)
    with alone(Path(out) / RECORD / "lock", "capturing into it"):
        folder = CaptureFolder(Path(out), checked)
        session = Session(Stand(checked, desk), folder, open_camera, open_light, say)
        try:
            session.remember()
            before = len(folder.kept)
            complete = session.take_all()
        finally:
            session.close()
            folder.journal.close()
    return RunSummary(
        folder=folder.path,
        photographs=len(session.shots),
        taken=session.taken,
        before=before,
        again=session.again,
        complete=complete,
        kept_findings=tuple(
            Problem(name, finding, "It was kept as it is")
            for name, entry in folder.kept.items()
            for finding in entry.get("kept_with", ())
        ),
        coverage=session.coverage,
        notes=tuple(session.notes),
        seconds=time.perf_counter() - started,
    )


def unattended(tries: int = _TRIES) -> Desk:
    """Return a desk that nobody sits at: what fails is tried so many times, and then the run stops."""
    tried: dict[str, int] = {}

    def answer(question: Question) -> str:
        if not question.problem:
            return next(iter(question.choices))
        tried[question.about] = tried.get(question.about, 1) + 1
        return AGAIN if tried[question.about] <= tries else STOP

    return Desk(answer)


def _room(plan: Plan, out: Path) -> list[Problem]:
    """Return a problem if the disk cannot hold the photographs that are planned."""
    there = [shot for shot in shots(plan) if any((out / shot.name).parent.glob(f"{Path(shot.name).name}.*"))]
    needed = (len(shots(plan)) - len(there)) * plan.file.exposure.photograph_mb * 1e6
    free = free_bytes(out)
    if needed <= free:
        return []
    what = f"has {free / 1e9:.1f} GB left, and the photographs need about {needed / 1e9:.1f} GB"
    return [Problem(str(out), what, "Make room, choose another disk, or correct photograph_mb in the plan")]
