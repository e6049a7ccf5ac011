"""The subcommand `capture run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impasto import stand
from impasto.cli.app import Debug, Json
from impasto.cli.capture import commands
from impasto.console import EXIT_INTERRUPTED, reporting


@commands.command(epilog="Example: impasto capture run plan.toml photos/ --page")
def run(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="File that impasto capture plan wrote.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make, or one that was begun.")],
    unattended: Annotated[
        bool,
        typer.Option("--unattended", help="Ask nobody: try what fails three times, then end with an error."),
    ] = False,
    page: Annotated[
        bool, typer.Option("--page", help="Serve a page for a tablet at the stand, beside the terminal.")
    ] = False,
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Of the page; 0.0.0.0 for the local network.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", metavar="N", help="Of the page; 0 for any that is free.")
    ] = 0,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Take the photographs of a plan, checking each; go on where an earlier run stopped."""
    with reporting("capture run", json, debug) as report:
        from impasto.stand.desk import Desk
        from impasto.stand.terminal import at_terminal
        from impasto.summaries.capture import run_lines

        if unattended:
            summary = stand.run(plan, out, say=report.say)
        else:
            desk = Desk()
            with at_terminal(desk, report.say, page=(host, port) if page else None):
                summary = stand.run(plan, out, desk=desk, say=report.say)
        report.say_all(run_lines(summary))
        if summary.complete:
            report.say(f"next: impasto stack {out} painting.zarr")
        else:
            report.exit_code = EXIT_INTERRUPTED  # what follows in a script needs all photographs
        report.done(summary)
