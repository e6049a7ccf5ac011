"""The subcommand `height`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Model, Store, app
from impasto.console import reporting
from impasto.summaries.maps import height_lines


@app.command(epilog="Example: impasto height painting.zarr --model torrance-sparrow --out relief.stl")
def height(
    store: Store,
    model: Model,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write: .tif, .stl or .ply.")],
    bits: Annotated[
        int, typer.Option("--bits", metavar="N", help="Of a TIFF file: 32 (heights) or 16 (codes).")
    ] = 32,
    step: Annotated[
        int | None,
        typer.Option("--step", metavar="N", help="Pixels per height; a mesh has up to a million by default."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Write the relief that the normals make."""
    with reporting("height", json, debug) as report:
        summary = impasto.height(store, model=model, out=out, bits=bits, step=step)
        report.say_all(height_lines(summary))
        report.done(summary)
