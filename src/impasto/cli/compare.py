"""The subcommand `compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Clusters, Debug, Json, Regions, Store, app
from impasto.console import reporting
from impasto.summaries.compare import compare_lines, compare_tables


@app.command(epilog="Example: impasto compare painting.zarr --regions drawn.png --out comparison/")
def compare(
    store: Store,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    regions: Regions = None,
    clusters: Clusters = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for a map of the models chosen.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Compare the fitted models: As/Ad, errors at highlights and elsewhere, and the choice per pixel."""
    with reporting("compare", json, debug) as report:
        summary = impasto.compare(store, models=model or (), regions=regions, clusters=clusters, out=out)
        for heading, header, rows in compare_tables(summary):
            report.say(heading)
            report.table(header, rows)
            report.say()
        report.say_all(compare_lines(summary))
        report.done(summary)
