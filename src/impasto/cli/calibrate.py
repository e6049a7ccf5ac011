"""The subcommands of `calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impasto import calibrate
from impasto.cli.app import Debug, Json, Out, group, numbers
from impasto.console import reporting
from impasto.summaries.calibrate import lights_lines, lights_table, oecf_lines

commands = group("calibrate", "Calibrate camera, lights and display from photographs of what is known.")

Exclude = Annotated[
    list[str] | None, typer.Option("--exclude", metavar="NAME", help="Leave it out; may be repeated.")
]
Dark = Annotated[
    Path | None, typer.Option("--dark", metavar="PHOTO", help="Photograph with the cap on the lens.")
]
Patches = Annotated[Path, typer.Argument(metavar="CSV", help="Where its patches are, and what is known.")]
CalibrationFile = Annotated[Path, typer.Argument(metavar="OUT", help="Calibration file to write.")]
Without = Annotated[
    list[str] | None, typer.Option("--without", metavar="PATCH", help="Patch to leave out; may be repeated.")
]


@commands.command(epilog="Example: impasto calibrate lights photos/ --out lights/ --radius-mm 12.7")
def lights(
    photos: Annotated[Path, typer.Argument(metavar="PHOTOS", help="Photographs, one per light.")],
    out: Out,
    sphere: Annotated[
        list[str] | None,
        typer.Option(
            "--sphere", metavar="COLUMN,ROW,RADIUS", help="Outline of a sphere in pixels; repeated."
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option("--count", metavar="N", help="How many spheres to find.")
    ] = None,
    camera: Annotated[
        Path | None, typer.Option("--camera", metavar="FILE", help="TOML file with a table [camera].")
    ] = None,
    mm_per_px: Annotated[
        float | None, typer.Option("--mm-per-px", metavar="MM", help="Size of a pixel on the painting.")
    ] = None,
    radius_mm: Annotated[
        float | None, typer.Option("--radius-mm", metavar="MM", help="Radius of the spheres.")
    ] = None,
    drop: Annotated[
        list[str] | None, typer.Option("--drop", metavar="NAME", help="Light to leave out; may be repeated.")
    ] = None,
    exclude: Exclude = None,
    intensity: Annotated[
        str, typer.Option("--intensity", metavar="FROM", help="Intensities from: equal, spheres or card.")
    ] = "equal",
    card: Annotated[
        str | None,
        typer.Option("--card", metavar="C0,R0,C1,R1", help="Corners of a card of even colour, pixels."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find where the lights stand from mirror spheres in the photographs."""
    with reporting("calibrate lights", json, debug) as report:
        found = calibrate.lights(
            photos,
            out,
            spheres=[numbers(text, 3, "--sphere") for text in sphere or ()],
            count=count,
            camera=camera,
            mm_per_px=mm_per_px,
            radius_mm=radius_mm,
            drop=drop or (),
            exclude=exclude or (),
            intensity=intensity,
            card=None if card is None else [round(number) for number in numbers(card, 4, "--card")],
        )
        report.table(*lights_table(found))
        report.say_all(lights_lines(found))
        report.done(found)


@commands.command(
    epilog="Example: impasto calibrate oecf scale.tif scale.csv oecf.json --card card.tif --dark dark.tif"
)
def oecf(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="Photograph of a grey scale.")],
    patches: Patches,
    out: CalibrationFile,
    more: Annotated[
        list[Path] | None,
        typer.Option("--photo", metavar="PHOTO", help="The same with another exposure; may be repeated."),
    ] = None,
    card: Annotated[
        Path | None, typer.Option("--card", metavar="PHOTO", help="An even card in the scale's place.")
    ] = None,
    dark: Dark = None,
    exposure_s: Annotated[
        list[float] | None,
        typer.Option("--exposure-s", metavar="S", help="Exposure time of each photograph, if not in it."),
    ] = None,
    without: Without = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Measure the camera's response from a photograph of a grey scale."""
    with reporting("calibrate oecf", json, debug) as report:
        found = calibrate.oecf(
            [photo, *(more or ())],
            patches,
            out,
            card=card,
            dark=dark,
            exposures_s=exposure_s or (),
            without=without or (),
        )
        report.say_all(oecf_lines(found))
        report.done(found)
