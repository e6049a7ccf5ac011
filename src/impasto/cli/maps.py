"""The subcommand `maps`."""

from __future__ import annotations

import impasto
from impasto.cli.app import Debug, Json, Model, Out, Store, app
from impasto.console import reporting
from impasto.summaries.maps import maps_lines


@app.command(epilog="Example: impasto maps painting.zarr --model torrance-sparrow --out maps/")
def maps(store: Store, model: Model, out: Out, json: Json = None, debug: Debug = False) -> None:
    """Write the measured maps as pictures and as numbers."""
    with reporting("maps", json, debug) as report:
        summary = impasto.maps(store, model=model, out=out)
        report.say_all(maps_lines(summary))
        report.done(summary)
