"""The subcommand `experiment forget`."""

from __future__ import annotations

from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import Database, Experiment
from impasto.console import reporting


@commands.command(epilog="Example: impasto experiment forget experiment/ O007")
def forget(
    experiment: Experiment,
    observer: Annotated[str, typer.Argument(metavar="OBSERVER", help="Whose data are deleted.")],
    database: Database = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Delete everything about an observer."""
    with reporting("experiment forget", json, debug) as report:
        from impasto.summaries.words import count

        deleted = impasto.experiment.forget(experiment, observer, database=database)
        report.say(f"{observer}: {count(deleted, 'session')} deleted, with all answers")
        report.done({"observer": observer, "sessions": deleted})
