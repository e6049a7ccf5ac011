"""The subcommand `view`."""

from __future__ import annotations

from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Store, app
from impasto.console import reporting


@app.command(epilog="Example: impasto view painting.zarr")
def view(
    store: Store,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="Which fit; may be repeated. All by default."),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port; a free one by default.")
    ] = 0,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in a browser.")
    ] = True,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Relight the painting in a browser, on this machine."""
    with reporting("view", json, debug) as report:
        summary = impasto.view(
            store, models=model or (), port=port, open_browser=open_browser, say=report.say
        )
        report.done(summary)
