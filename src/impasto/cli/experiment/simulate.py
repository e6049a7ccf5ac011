"""The subcommand `experiment simulate`."""

from __future__ import annotations

from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import Database, Experiment
from impasto.console import reporting


@commands.command(epilog="Example: impasto experiment simulate experiment/ --observers 18")
def simulate(
    experiment: Experiment,
    observers: Annotated[int, typer.Option("--observers", metavar="N", help="How many.")] = 18,
    by: Annotated[
        str, typer.Option("--by", metavar="NAME", help="What they go by: RMS, CIEDE2000 or FLIP.")
    ] = "CIEDE2000",
    gain: Annotated[
        float,
        typer.Option("--gain", metavar="Z", help="Distance on the scale that a difference of 1 makes."),
    ] = 1.0,
    variety: Annotated[
        float, typer.Option("--variety", metavar="Z", help="How much tastes differ (standard deviation).")
    ] = 0.0,
    lapse: Annotated[
        float, typer.Option("--lapse", metavar="P", help="Share of answers that are given blindly.")
    ] = 0.02,
    left: Annotated[float, typer.Option("--left", metavar="Z", help="Advantage of the left.")] = 0.0,
    indifference: Annotated[
        float,
        typer.Option("--indifference", metavar="Z", help="Distance below which they see no difference."),
    ] = 0.0,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of their noise.")] = 0,
    database: Database = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Try the experiment out with simulated observers, whose names say that they are no persons."""
    with reporting("experiment simulate", json, debug) as report:
        from impasto.psychophysics import ObserverModel
        from impasto.summaries.experiment import simulate_lines

        summary = impasto.experiment.simulate(
            experiment,
            observers=observers,
            by=by,
            model=ObserverModel(gain, variety, lapse, left, indifference),
            seed=seed,
            database=database,
        )
        report.say_all(simulate_lines(summary))
        report.done(summary)
