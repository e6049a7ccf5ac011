"""The subcommand `gonio`."""

from __future__ import annotations

from typing import Annotated

import typer

import impasto
from impasto.cli.app import Clusters, Debug, Json, Out, Regions, Store, app, pixels
from impasto.console import reporting
from impasto.summaries.gonio import gonio_lines, gonio_table


@app.command(epilog="Example: impasto gonio painting.zarr --pixel 120,80 --out curves/")
def gonio(
    store: Store,
    out: Out,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    pixel: Annotated[
        list[str] | None,
        typer.Option("--pixel", metavar="COLUMN,ROW", help="A single pixel; may be repeated."),
    ] = None,
    regions: Regions = None,
    clusters: Clusters = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Plot measured and modelled radiance against the angle of the light."""
    with reporting("gonio", json, debug) as report:
        summary = impasto.gonio(
            store, out=out, models=model or (), pixels=pixels(pixel), regions=regions, clusters=clusters
        )
        report.table(*gonio_table(summary))
        report.say_all(gonio_lines(summary))
        report.done(summary)
