"""The subcommand `stack`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Overwrite, app
from impasto.console import reporting
from impasto.summaries.stack import stack_lines


@app.command(epilog="Example: impasto stack photos/ painting.zarr --lights dirs.lp --exclude blurred07")
def stack(
    photos: Annotated[Path, typer.Argument(metavar="PHOTOS", help="Folder with the photographs.")],
    store: Annotated[Path, typer.Argument(metavar="STORE", help="Folder to make, such as painting.zarr.")],
    lights: Annotated[
        Path | None,
        typer.Option("--lights", metavar="FILE", help="Light file; by default the one in PHOTOS."),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option("--exclude", metavar="NAME", help="Photograph to leave out; may be repeated."),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Read photographs and their lights into a store."""
    with reporting("stack", json, debug) as report:
        summary = impasto.stack(photos, store, lights=lights, exclude=exclude or (), overwrite=overwrite)
        report.say_all(stack_lines(summary))
        report.say(f"next: impasto fit {store}")
        report.done(summary)
