"""The subcommand `experiment serve`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import Database, Experiment
from impasto.console import reporting


@commands.command(epilog="Example: impasto experiment serve experiment/ --port 8000")
def serve(
    experiment: Experiment,
    database: Database = None,
    host: Annotated[
        str,
        typer.Option("--host", metavar="ADDRESS", help="0.0.0.0 to serve other machines too."),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", metavar="N", help="0 for any that is free.")] = 8000,
    certificate: Annotated[
        Path | None, typer.Option("--certificate", metavar="FILE", help="For https, in PEM format.")
    ] = None,
    key: Annotated[
        Path | None, typer.Option("--key", metavar="FILE", help="Of the certificate, in PEM format.")
    ] = None,
    debug: Debug = False,
) -> None:
    """Serve an experiment to its observers, until it is stopped with Ctrl-C."""
    with reporting("experiment serve", None, debug) as report:
        impasto.experiment.serve(
            experiment,
            database=database,
            host=host,
            port=port,
            certificate=certificate,
            key=key,
            say=report.say,
        )
