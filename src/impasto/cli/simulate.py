"""The subcommand `simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, app, pair
from impasto.console import reporting
from impasto.summaries.simulate import simulation_lines


@app.command(epilog="Example: impasto simulate photos/ --preset still-life --dome --size 768,512")
def simulate(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")],
    sample: Annotated[
        str | None, typer.Option("--sample", metavar="a..h", help="One of the paper's eight samples.")
    ] = None,
    preset: Annotated[
        str | None, typer.Option("--preset", metavar="NAME", help="still-life (default) or swatches.")
    ] = None,
    arm: Annotated[bool, typer.Option("--arm", help="Lights on an arm in one plane.")] = False,
    dome: Annotated[bool, typer.Option("--dome", help="Lights all around.")] = False,
    lights: Annotated[
        int | None, typer.Option("--lights", metavar="N", help="How many lights; 37 or 48 by default.")
    ] = None,
    size: Annotated[str, typer.Option("--size", metavar="W,H", help="Width and height, pixels.")] = "512,512",
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Another painting of the kind.")] = 0,
    brackets: Annotated[
        int, typer.Option("--brackets", metavar="N", help="Shorter exposures of each photograph.")
    ] = 0,
    model: Annotated[
        str | None, typer.Option("--model", metavar="NAME", help="Model of the painting's highlights.")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option("--measured", metavar="FILE", help="Use measured materials (.npz).")
    ] = None,
    exposure: Annotated[
        float, typer.Option("--exposure", metavar="SHARE", help="Value of white, as share of full scale.")
    ] = 0.25,
    vignetting: Annotated[
        float, typer.Option("--vignetting", metavar="SHARE", help="Light lost in the corners.")
    ] = 0.0,
    format: Annotated[
        str, typer.Option("--format", metavar="KIND", help="tiff, png, jpeg, exr or dng.")
    ] = "tiff",
    bits: Annotated[int | None, typer.Option("--bits", metavar="N", help="8 or 16.")] = None,
    noise: Annotated[bool, typer.Option("--noise/--no-noise", help="Whether the sensor is noisy.")] = True,
    shadows: Annotated[
        bool, typer.Option("--shadows/--no-shadows", help="Whether the relief casts shadows.")
    ] = True,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Simulate photographs of a painting of which the truth is known."""
    with reporting("simulate", json, debug) as report:
        summary = impasto.simulate(
            out,
            sample=sample,
            preset=preset,
            arm=arm,
            dome=dome,
            lights=lights,
            size=_size(size),
            seed=seed,
            brackets=brackets,
            model=model,
            measured=measured,
            exposure=exposure,
            vignetting=vignetting,
            format=format,
            bits=bits,
            noise=noise,
            cast_shadows=shadows,
        )
        report.say_all(simulation_lines(summary))
        report.done(summary)


def _size(text: str) -> tuple[int, int]:
    return pair(text.replace("x", ","), "--size", "Write width and height: --size 768,512")
