"""The subcommand `experiment export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import Database, Experiment
from impasto.console import reporting


@commands.command(epilog="Example: impasto experiment export experiment/ trials.csv")
def export(
    experiment: Experiment,
    out: Annotated[Path, typer.Argument(metavar="FILE", help="Ends in .csv or .json.")],
    database: Database = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Write the answers: as CSV one row per trial, as JSON the checks and conditions too."""
    with reporting("experiment export", json, debug) as report:
        from impasto.summaries.experiment import export_lines

        summary = impasto.experiment.export(experiment, out, database=database)
        report.say_all(export_lines(summary))
        report.done(summary)
