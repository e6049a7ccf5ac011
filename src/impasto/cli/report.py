"""The subcommand `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Store, app
from impasto.console import reporting
from impasto.summaries.words import count, seconds


@app.command(epilog="Example: impasto report painting.zarr report.html")
def report(
    store: Store,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="HTML file to write.")],
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Write one page about everything that the store holds, to be opened anywhere."""
    with reporting("report", json, debug) as said:
        summary = impasto.report(store, out, models=model or ())
        said.say(f"{count(len(summary.sections), 'section')} about {', '.join(summary.models)}")
        said.say(f"statistics from {summary.sampled_pixels:,} of {count(summary.pixels, 'pixel')}")
        said.say(f"{summary.page} is ready ({summary.bytes / 1e6:.1f} MB, {seconds(summary.seconds)})")
        said.done(summary)
