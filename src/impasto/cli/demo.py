"""The subcommand `demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, app
from impasto.console import reporting
from impasto.summaries.words import seconds


@app.command(epilog="Example: impasto demo demo/")
def demo(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")] = Path("demo"),
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Run everything on a small simulated painting, and write a page about it."""
    with reporting("demo", json, debug) as report:
        summary = impasto.demo(out, say=report.say)
        report.say()
        report.say(f"everything took {seconds(summary.seconds)}; open this page in a browser:")
        report.say(f"    {summary.page.resolve()}")
        report.done(summary)
