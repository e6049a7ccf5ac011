"""The subcommand `evaluate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Store, app
from impasto.console import reporting
from impasto.summaries.evaluate import evaluate_tables


@app.command(epilog="Example: impasto evaluate painting.zarr --held-out 5")
def evaluate(
    store: Store,
    held_out: Annotated[
        int | None,
        typer.Option("--held-out", metavar="K", help="How many photographs to hold out; 5 by default."),
    ] = None,
    held_out_lights: Annotated[
        Path | None,
        typer.Option("--held-out-lights", metavar="FILE", help="Names of photographs, or a light file."),
    ] = None,
    folds: Annotated[
        int | None,
        typer.Option("--folds", metavar="K", help="Hold out every photograph once, in K rounds of fits."),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    baselines: Annotated[
        bool,
        typer.Option("--baselines/--no-baselines", help="Judge PTM, HSH and other relighting methods too."),
    ] = True,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Compare renderings with photographs that the fit has not seen."""
    with reporting("evaluate", json, debug) as report:
        summary = impasto.evaluate(
            store,
            models=model or (),
            held_out=held_out,
            held_out_lights=held_out_lights,
            folds=folds,
            baselines=baselines,
        )
        how = "held out" if folds is None else f"held out once each, in {folds} rounds"
        report.say(f"{len(summary.held_out)} photographs {how}, {summary.fitted} fitted")
        for heading, header, rows in evaluate_tables(summary):
            report.say()
            report.say(heading)
            report.table(header, rows)
        if summary.not_recorded:
            report.say(f"not kept for impasto report: {summary.not_recorded}")
        report.done(summary)
