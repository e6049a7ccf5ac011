"""The subcommand `publish`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Overwrite, Store, app
from impasto.console import reporting
from impasto.summaries.publish import publish_lines


@app.command(epilog="Example: impasto publish painting.zarr site/ --photographs 8")
def publish(
    store: Store,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make, for any web server.")],
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="Which fit; may be repeated. All by default."),
    ] = None,
    photographs: Annotated[
        int, typer.Option("--photographs", metavar="N", min=0, help="Keep N photographs for comparison.")
    ] = 0,
    title: Annotated[
        str | None, typer.Option("--title", metavar="TEXT", help="Title; the store's name by default.")
    ] = None,
    shards: Annotated[
        bool, typer.Option("--shards", help="Few large files; the server must answer range requests.")
    ] = False,
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Write a folder with a page that relights the painting."""
    with reporting("publish", json, debug) as report:
        summary = impasto.publish(
            store,
            out,
            models=model or (),
            photographs=photographs,
            title=title,
            shards=shards,
            overwrite=overwrite,
        )
        report.say_all(publish_lines(summary))
        report.done(summary)
