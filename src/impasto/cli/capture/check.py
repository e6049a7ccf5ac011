"""The subcommand `capture check`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impasto import stand
from impasto.cli.app import Debug, Json
from impasto.cli.capture import commands
from impasto.console import reporting


@commands.command(epilog="Example: impasto capture check photos/")
def check(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Capture as impasto stack reads it.")],
    lights: Annotated[
        Path | None, typer.Option("--lights", metavar="FILE", help="Light file; found in FOLDER by default.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Check photographs that are there: clipping, movement, blur, lamps, spheres, highlights."""
    with reporting("capture check", json, debug) as report:
        from impasto.summaries.capture import check_lines, check_table

        found = stand.check(folder, lights=lights)
        report.table(*check_table(found))
        report.say_all(check_lines(found))
        report.done(found)
