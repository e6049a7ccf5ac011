"""The subcommand `gloss`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Clusters, Debug, Json, Model, Regions, Store, app, pixels
from impasto.console import reporting
from impasto.summaries.gloss import gloss_lines, gloss_table


@app.command(epilog="Example: impasto gloss painting.zarr --model torrance-sparrow --regions drawn.png")
def gloss(
    store: Store,
    model: Model,
    regions: Regions = None,
    clusters: Clusters = None,
    pixel: Annotated[
        list[str] | None,
        typer.Option("--pixel", metavar="COLUMN,ROW", help="A single pixel; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for a map of each angle.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Predict what a glossmeter would read at 20, 60 and 85°."""
    with reporting("gloss", json, debug) as report:
        summary = impasto.gloss(
            store, model=model, regions=regions, clusters=clusters, pixels=pixels(pixel), out=out
        )
        report.table(*gloss_table(summary))
        report.say_all(gloss_lines(summary))
        report.done(summary)
