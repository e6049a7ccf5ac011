"""The subcommand `reproduce`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, app, pair
from impasto.console import reporting
from impasto.summaries.words import seconds


@app.command(epilog="Example: impasto reproduce reenacted/ --measured measured_brdf.npz")
def reproduce(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")],
    measured: Annotated[
        Path, typer.Option("--measured", metavar="FILE", help="File of measured materials (.npz).")
    ],
    sample: Annotated[
        list[str] | None,
        typer.Option("--sample", metavar="a..h", help="May be repeated; all eight by default."),
    ] = None,
    size: Annotated[
        str, typer.Option("--size", metavar="W,H", help="Size of the photographs, pixels.")
    ] = "64,64",
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Another set of samples.")] = 0,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Re-enact the paper's experiment, with its printed values beside what comes out."""
    with reporting("reproduce", json, debug) as report:
        summary = impasto.reproduce(
            out,
            measured=measured,
            samples=sample or (),
            size=pair(size, "--size", "Write width and height: --size 64,64"),
            seed=seed,
            say=report.say,
        )
        report.say_all(summary.findings)
        report.say(f"{summary.page} is ready ({seconds(summary.seconds)})")
        report.done(summary)
