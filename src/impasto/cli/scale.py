"""The subcommand `scale`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import impasto
from impasto.cli.app import Debug, Json, app
from impasto.console import reporting
from impasto.errors import OptionError, Problem
from impasto.summaries.scale import scale_lines, scale_tables


@app.command(epilog="Example: impasto scale trials.csv --out scales/ --pool highlight=20,30")
def scale(
    trials: Annotated[
        Path, typer.Argument(metavar="TRIALS.csv", help="Answers of an experiment, one row per trial.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for figures and a table.")
    ] = None,
    model: Annotated[
        str, typer.Option("--model", metavar="NAME", help="case-v, closed-form or bradley-terry.")
    ] = "case-v",
    rule: Annotated[
        str,
        typer.Option(
            "--rule", metavar="NAME", help="Proportions of 0 and 1 in closed form: half, omit or morovic."
        ),
    ] = "half",
    limits: Annotated[
        str,
        typer.Option(
            "--limits",
            metavar="NAME",
            help="auto, observers, percentile, likelihood, montag or exact; see docs/scaling.md.",
        ),
    ] = "auto",
    level: Annotated[
        float, typer.Option("--level", metavar="P", help="Probability with which the limits cover.")
    ] = 0.95,
    draws: Annotated[
        int, typer.Option("--draws", metavar="N", help="How often the bootstrap draws the observers.")
    ] = 1000,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the bootstrap.")] = 0,
    unit: Annotated[str, typer.Option("--unit", metavar="NAME", help="z or jod.")] = "z",
    condition: Annotated[
        list[str] | None,
        typer.Option("--condition", metavar="NAME", help="Scale this one; repeat for all that are wanted."),
    ] = None,
    pool: Annotated[
        list[str] | None,
        typer.Option("--pool", metavar="NAME=ANGLE,…", help="Angles to be scaled together; may be repeated."),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option("--exclude", metavar="OBSERVER", help="Leave an observer out; may be repeated."),
    ] = None,
    errors: Annotated[
        Path | None,
        typer.Option(
            "--errors", metavar="PATH", help="The experiment's folder, or measured differences (CSV)."
        ),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Turn observers' choices into an interval scale with limits, per angle, per sample and pooled."""
    with reporting("scale", json, debug) as report:
        from impasto.psychophysics.scaling.groups import ScaleOptions

        names: dict[str, Any] = {"model": model, "rule": rule, "limits": limits, "unit": unit}
        summary = impasto.scale(
            trials,
            options=ScaleOptions(level=level, draws=draws, seed=seed, **names),
            conditions=condition or (),
            pools=dict(_pool(text) for text in pool or ()),
            exclude=exclude or (),
            errors=errors,
            out=out,
        )
        for heading, header, rows, notes in scale_tables(summary):
            report.say(heading)
            if rows:
                report.table(header, rows)
            report.say_all(f"  ! {note}" for note in notes)
            report.say()
        report.say_all(scale_lines(summary))
        report.done(summary)


def _pool(text: str) -> tuple[str, list[str]]:
    name, sign, angles = text.partition("=")
    if not sign or not name.strip() or not angles.strip():
        raise OptionError(
            Problem(f"--pool {text}", "is not a name with angles", "Write --pool highlight=20,30")
        )
    return name.strip(), [angle.strip() for angle in angles.split(",")]
