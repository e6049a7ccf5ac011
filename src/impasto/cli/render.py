"""The subcommand `render`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impasto
from impasto.cli.app import Debug, Json, Model, Out, Store, app
from impasto.console import reporting
from impasto.summaries.render import render_lines


@app.command(epilog="Example: impasto render painting.zarr --model phong --arm -60:60:5 --out film/")
def render(
    store: Store,
    model: Model,
    out: Out,
    lights: Annotated[
        Path | None, typer.Option("--lights", metavar="FILE", help="Light file (.lp, .csv, .toml).")
    ] = None,
    light: Annotated[
        list[str] | None,
        typer.Option("--light", metavar="ZENITH,AZIMUTH", help="One light, degrees; may be repeated."),
    ] = None,
    arm: Annotated[
        list[str] | None,
        typer.Option(
            "--arm",
            metavar="DEG",
            help="Light on the arm, degrees, or a sweep START:STOP:STEP; may be repeated.",
        ),
    ] = None,
    as_photographed: Annotated[
        bool,
        typer.Option(
            "--as-photographed",
            help="Lights as strong as the photographs' lamp was around them, to compare with photographs.",
        ),
    ] = False,
    distant_light: Annotated[
        bool,
        typer.Option("--distant-light", help="Light from far away where the photographs' lamps stood near."),
    ] = False,
    display: Annotated[
        str, typer.Option("--display", metavar="NAME|FILE", help="srgb, display-p3 or an ICC profile.")
    ] = "srgb",
    exposure: Annotated[
        float, typer.Option("--exposure", metavar="N", help="Brighten the display pictures N times.")
    ] = 1.0,
    white_point: Annotated[
        str | None,
        typer.Option(
            "--white-point",
            metavar="WHITE",
            help="Shown as the display's white: D50 or another illuminant, x,y, or light.",
        ),
    ] = None,
    adaptation: Annotated[
        str, typer.Option("--adaptation", metavar="HOW", help="To that white: cat16 or bradford.")
    ] = "cat16",
    highlights: Annotated[
        str, typer.Option("--highlights", metavar="RULE", help="Above the display's white: clip or shoulder.")
    ] = "clip",
    gamut_mask: Annotated[
        bool, typer.Option("--gamut-mask", help="Write where the display cannot show the colour.")
    ] = False,
    tiff: Annotated[bool, typer.Option("--tiff", help="16-bit TIFF files instead of PNG.")] = False,
    raw: Annotated[bool, typer.Option("--raw", help="Write the linear EXR files only.")] = False,
    animate: Annotated[
        bool | None,
        typer.Option("--animate/--no-animate", help="Write an animated picture; by default for sweeps."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Render the painting under any light."""
    with reporting("render", json, debug) as report:
        from impasto.render.lights import parse_angles, parse_light

        summary = impasto.render(
            store,
            model=model,
            lights=lights,
            light=[parse_light(text) for text in light or ()],
            arm=parse_angles(arm or ()),
            as_photographed=as_photographed,
            distant_light=distant_light,
            out=out,
            display=display,
            exposure=exposure,
            white_point=white_point,
            adaptation=adaptation,
            highlights=highlights,
            gamut_mask=gamut_mask,
            tiff=tiff,
            raw=raw,
            animate=animate,
        )
        report.say_all(render_lines(summary))
        report.done(summary)
