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
    brackets: Annotated[
        list[Path] | None,
        typer.Option("--brackets", metavar="DIR", help="Further exposures, same names; may be repeated."),
    ] = None,
    oecf: Annotated[
        Path | None, typer.Option("--oecf", metavar="FILE", help="The camera's response, calibrated.")
    ] = None,
    dark: Annotated[
        Path | None, typer.Option("--dark", metavar="FILE", help="The dark frame, calibrated.")
    ] = None,
    flat: Annotated[
        Path | None, typer.Option("--flat", metavar="FILE", help="The flat field, calibrated.")
    ] = None,
    white: Annotated[
        Path | None, typer.Option("--white", metavar="FILE", help="The white reference, calibrated.")
    ] = None,
    colour: Annotated[
        Path | None, typer.Option("--colour", metavar="FILE", help="The camera's colours, calibrated.")
    ] = None,
    steadiness: Annotated[
        Path | None,
        typer.Option("--steadiness", metavar="FILE", help="Shift photographs back that moved, as measured."),
    ] = None,
    half_size: Annotated[
        bool, typer.Option("--half-size", help="Read raw files at half size, which is faster.")
    ] = False,
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Read photographs and their lights into a store."""
    with reporting("stack", json, debug) as report:
        summary = impasto.stack(
            photos,
            store,
            lights=lights,
            exclude=exclude or (),
            brackets=brackets or (),
            oecf=oecf,
            dark=dark,
            flat=flat,
            white=white,
            colour=colour,
            steadiness=steadiness,
            half_size=half_size,
            overwrite=overwrite,
        )
        report.say_all(stack_lines(summary))
        report.say(f"next: impasto fit {store}")
        report.done(summary)
