"""Invite observers, export their answers, forget them: what the laboratory's page does, without a server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from sqlalchemy import Engine

from impasto.errors import OptionError, Problem
from impasto.output import write_json, write_text
from impasto.psychophysics.experiment.answers import answer_rows, answers_csv, answers_json
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import (
    Experiment,
    ExperimentError,
    Viewing,
    read_experiment,
)
from impasto.psychophysics.experiment.sessions import Invitation, forget_observer, invite_observers
from impasto.psychophysics.scaling.trials import is_simulated

_MOST_OBSERVERS = 1000


@dataclass(frozen=True)
class ExportSummary:
    """What `export` wrote.

    Parameters
    ----------
    file : Path
    answers : int
        Of all kinds of trials.
    observers : int
        Who gave them.
    simulated : int
        How many of these are no persons.
    """

    file: Path
    answers: int
    observers: int
    simulated: int


def invite(
    experiment: str | PathLike[str],
    *,
    observers: int = 1,
    sessions: int = 1,
    again: str | None = None,
    simulated: bool = False,
    viewing: Viewing | None = None,
    database: str | None = None,
) -> list[Invitation]:
    """Make sessions for observers; each is opened by its code.

    Parameters
    ----------
    experiment : path
        Folder that `create` made.
    observers : int, optional
        How many new ones.
    sessions : int, optional
        How many for each.
    again : str, optional
        An observer who comes again, instead of new ones.
    simulated : bool, optional
        Whether they are no persons; their names say so wherever their answers appear.
    viewing : Viewing, optional
        Their viewing conditions, where these differ from the experiment's.
    database : str, optional
        As for `serve`.

    Returns
    -------
    list of Invitation

    Raises
    ------
    ExperimentError
        If the experiment or its database cannot be used, or there is no observer to come again.
    OptionError
        If too few or too many are asked for.
    """
    for option, number in (("--observers", observers), ("--sessions", sessions)):
        if not 1 <= number <= _MOST_OBSERVERS:
            what = f"is {number}, expected 1 to {_MOST_OBSERVERS}"
            raise OptionError(Problem(option, what, "Invite more in a second run"))
    with opened(experiment, database) as (described, engine):
        return invite_observers(
            engine,
            described,
            observers=observers,
            runs=sessions,
            again=again,
            simulated=simulated,
            viewing=viewing,
        )


def export(
    experiment: str | PathLike[str], out: str | PathLike[str], *, database: str | None = None
) -> ExportSummary:
    """Write the answers: as CSV one row per trial, as JSON all that is known about each session too.

    Parameters
    ----------
    experiment : path
        Folder that `create` made.
    out : path
        File that ends in ``.csv`` or ``.json``.
    database : str, optional
        As for `serve`, which may go on while answers are exported.

    Returns
    -------
    ExportSummary

    Raises
    ------
    ExperimentError
        If the experiment or its database cannot be used.
    OptionError
        If the file ends otherwise.
    OutputError
        If it cannot be written.
    """
    file = Path(out)
    if file.suffix not in (".csv", ".json"):
        raise OptionError(Problem(str(file), "ends in neither .csv nor .json", "Choose one of them"))
    with opened(experiment, database) as (described, engine):
        rows = answer_rows(engine)
        if file.suffix == ".csv":
            write_text(file, answers_csv(rows))
        else:
            write_json(file, answers_json(engine, described))
    observers = {row["observer"] for row in rows}
    return ExportSummary(file, len(rows), len(observers), sum(map(is_simulated, observers)))


def forget(experiment: str | PathLike[str], observer: str, *, database: str | None = None) -> int:
    """Delete everything about an observer.

    Parameters
    ----------
    experiment : path
        Folder that `create` made.
    observer : str
        Such as ``O007``.
    database : str, optional
        As for `serve`.

    Returns
    -------
    int
        How many sessions that were.

    Raises
    ------
    ExperimentError
        If the experiment or its database cannot be used, or there is no such observer.
    """
    with opened(experiment, database) as (_, engine):
        deleted = forget_observer(engine, observer)
    if not deleted:
        do = "The laboratory's page lists the observers"
        raise ExperimentError(Problem(f"observer {observer}", "is not known", do))
    return deleted


@contextmanager
def opened(
    experiment: str | PathLike[str], database: str | None, *, check_stimuli: bool = False
) -> Iterator[tuple[Experiment, Engine]]:
    """Give the description of an experiment and its open database, which is closed afterwards.

    Raises
    ------
    ExperimentError
        If either cannot be used; with `check_stimuli` also if a picture has changed.
    """
    folder = Path(experiment)
    described = read_experiment(folder, check_stimuli=check_stimuli)
    engine = open_database(database_url(database, folder), described)
    try:
        yield described, engine
    finally:
        engine.dispose()
