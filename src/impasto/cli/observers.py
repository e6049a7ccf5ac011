"""The subcommand `observers`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, app
from impasto.console import reporting
from impasto.summaries.observers import observers_lines


@app.command(epilog="Example: impasto observers --difference 0.5 --conditions 5 --power 0.8")
def observers(
    difference: Annotated[
        float | None,
        typer.Option("--difference", metavar="Z", help="Distance of neighbours on the scale to be found."),
    ] = None,
    conditions: Annotated[
        int, typer.Option("--conditions", metavar="N", help="How many are compared, each with each.")
    ] = 2,
    power: Annotated[
        float, typer.Option("--power", metavar="P", help="Probability with which it is to be found.")
    ] = 0.8,
    level: Annotated[
        float, typer.Option("--level", metavar="P", help="Probability with which the limits cover.")
    ] = 0.95,
    answers: Annotated[
        int, typer.Option("--answers", metavar="N", help="Answers of each observer to each pair, pooled.")
    ] = 1,
    variety: Annotated[
        float, typer.Option("--variety", metavar="Z", help="How much tastes differ (standard deviation).")
    ] = 0.0,
    trials: Annotated[
        Path | None,
        typer.Option("--trials", metavar="FILE", help="Answers so far: whether to stop, and what to ask."),
    ] = None,
    within: Annotated[
        float, typer.Option("--within", metavar="Z", help="Stop when all differences are known to this.")
    ] = 0.3,
    least: Annotated[int, typer.Option("--least", metavar="N", help="Never stop with fewer observers.")] = 18,
    most: Annotated[int, typer.Option("--most", metavar="N", help="Always stop with so many.")] = 100,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Tell how many observers an experiment needs, when to stop it, and which pairs to ask next."""
    with reporting("observers", json, debug) as report:
        summary = impasto.observers(
            difference,
            conditions=conditions,
            power=power,
            level=level,
            answers=answers,
            variety=variety,
            trials=trials,
            within=within,
            least=least,
            most=most,
        )
        report.say_all(observers_lines(summary))
        report.done(summary)
