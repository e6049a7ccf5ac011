"""The subcommand `experiment invite`."""

from __future__ import annotations

from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import Database, Experiment, ViewingFile, read_viewing
from impasto.console import reporting


@commands.command(epilog="Example: impasto experiment invite experiment/ --observers 18")
def invite(
    experiment: Experiment,
    observers: Annotated[int, typer.Option("--observers", metavar="N", help="How many new ones.")] = 1,
    sessions: Annotated[int, typer.Option("--sessions", metavar="N", help="How many for each.")] = 1,
    again: Annotated[
        str | None,
        typer.Option("--again", metavar="OBSERVER", help="One who comes again, instead of new ones."),
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="They are no persons; their names will say so.")
    ] = False,
    viewing: ViewingFile = None,
    database: Database = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Make sessions for observers, and print the code of each."""
    with reporting("experiment invite", json, debug) as report:
        made = impasto.experiment.invite(
            experiment,
            observers=observers,
            sessions=sessions,
            again=again,
            simulated=simulated,
            viewing=read_viewing(viewing),
            database=database,
        )
        rows = [(entry.observer, str(entry.run), entry.code) for entry in made]
        report.table(("observer", "session", "code"), rows)
        report.say("Each code opens one session, at the address that impasto experiment serve prints.")
        report.done({"invitations": made})
