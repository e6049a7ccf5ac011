"""The subcommands of `calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impasto import calibrate
from impasto.cli.app import Debug, Json, Out, corners, group, numbers
from impasto.console import reporting
from impasto.summaries.calibrate import (
    colour_lines,
    colour_table,
    dark_lines,
    display_lines,
    flat_lines,
    glare_lines,
    lights_lines,
    lights_table,
    oecf_lines,
    steadiness_lines,
    target_lines,
    white_lines,
)

commands = group("calibrate", "Calibrate camera, lights and display from photographs of what is known.")

Exclude = Annotated[
    list[str] | None, typer.Option("--exclude", metavar="NAME", help="Leave it out; may be repeated.")
]
Dark = Annotated[
    Path | None, typer.Option("--dark", metavar="PHOTO", help="Photograph with the cap on the lens.")
]
OecfFile = Annotated[
    Path | None, typer.Option("--oecf", metavar="FILE", help="The camera's response, calibrated.")
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
            card=None if card is None else corners(card, "--card"),
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


@commands.command(epilog="Example: impasto calibrate dark cap.tif dark.json")
def dark(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="Photograph with the cap on.")],
    out: CalibrationFile,
    oecf: OecfFile = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Measure what the camera reads without light."""
    with reporting("calibrate dark", json, debug) as report:
        found = calibrate.dark(photo, out, oecf=oecf)
        report.say_all(dark_lines(found))
        report.done(found)


@commands.command(epilog="Example: impasto calibrate flat cards/ flat.json --lights lights.toml")
def flat(
    photos: Annotated[
        Path, typer.Argument(metavar="PHOTOS", help="An even card: one photograph, or one per light.")
    ],
    out: CalibrationFile,
    lights: Annotated[
        Path | None,
        typer.Option("--lights", metavar="FILE", help="Light file with positions, whose fall-off is left."),
    ] = None,
    dark: Dark = None,
    oecf: OecfFile = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Measure how uneven light and lens are, from photographs of an even card."""
    with reporting("calibrate flat", json, debug) as report:
        found = calibrate.flat(photos, out, lights=lights, dark=dark, oecf=oecf)
        report.say_all(flat_lines(found))
        report.done(found)


@commands.command(
    epilog="Example: impasto calibrate white photos/ white.json --box 20,20,80,80 --lights lights.toml"
)
def white(
    photos: Annotated[
        Path, typer.Argument(metavar="PHOTOS", help="Photographs in which the white reference lies.")
    ],
    out: CalibrationFile,
    box: Annotated[
        str, typer.Option("--box", metavar="C0,R0,C1,R1", help="Corners of the reference in pixels.")
    ],
    lights: Annotated[Path, typer.Option("--lights", metavar="FILE", help="Light file of the photographs.")],
    light: Annotated[
        str | None,
        typer.Option("--light", metavar="NAME", help="Light of a single photograph of another name."),
    ] = None,
    reflectance: Annotated[
        float, typer.Option("--reflectance", metavar="SHARE", help="Of the reference.")
    ] = 0.99,
    normal: Annotated[
        str, typer.Option("--normal", metavar="X,Y,Z", help="Of the reference, if it is tilted.")
    ] = "0,0,1",
    height_mm: Annotated[
        float, typer.Option("--height-mm", metavar="MM", help="Of the reference above the painting.")
    ] = 0.0,
    oecf: OecfFile = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find the absolute scale and the light's colour from a white reference."""
    with reporting("calibrate white", json, debug) as report:
        found = calibrate.white(
            photos,
            out,
            box=corners(box, "--box"),
            lights=lights,
            light=light,
            reflectance=reflectance,
            normal=numbers(normal, 3, "--normal"),
            height_mm=height_mm,
            oecf=oecf,
        )
        report.say_all(white_lines(found))
        report.done(found)


@commands.command(epilog="Example: impasto calibrate target chart.tif chart.csv")
def target(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="Photograph of a colour target.")],
    out: Annotated[Path, typer.Argument(metavar="CSV", help="Table of its patches to write.")],
    target: Annotated[
        str, typer.Option("--target", metavar="NAME", help="classic (24 patches) or sg (140).")
    ] = "classic",
    grey: Annotated[
        bool, typer.Option("--grey", help="Only the neutral patches, for `calibrate oecf`.")
    ] = False,
    wedge: Annotated[
        int | None,
        typer.Option("--wedge", metavar="N", help="Find a row of N grey patches instead."),
    ] = None,
    density: Annotated[
        str | None,
        typer.Option("--density", metavar="FIRST,STEP", help="Of the wedge's lightest patch, and the rise."),
    ] = None,
    oecf: OecfFile = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find a colour target or a grey wedge in a photograph, and write the table of its patches."""
    with reporting("calibrate target", json, debug) as report:
        found = calibrate.target(
            photo,
            out,
            target=target,
            grey=grey,
            wedge=wedge,
            density=None if density is None else numbers(density, 2, "--density"),
            oecf=oecf,
        )
        report.say_all(target_lines(found))
        report.done(found)


@commands.command(epilog="Example: impasto calibrate colour chart.tif chart.csv colour.json --card card.tif")
def colour(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="Photograph of a colour target.")],
    patches: Patches,
    out: CalibrationFile,
    target: Annotated[
        str | None, typer.Option("--target", metavar="NAME", help="A target whose data are known by name.")
    ] = None,
    card: Annotated[
        Path | None, typer.Option("--card", metavar="PHOTO", help="A white card in the target's place.")
    ] = None,
    white: Annotated[
        str | None, typer.Option("--white", metavar="PATCH", help="The white patch, if there is no card.")
    ] = None,
    dark: Dark = None,
    oecf: OecfFile = None,
    method: Annotated[
        str | None, typer.Option("--method", metavar="NAME", help="matrix or root-polynomial.")
    ] = None,
    without: Without = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find what the camera's colours are in XYZ, from a photograph of a colour target."""
    with reporting("calibrate colour", json, debug) as report:
        found = calibrate.colour(
            photo,
            patches,
            out,
            target=target,
            card=card,
            white=white,
            dark=dark,
            oecf=oecf,
            method=method,
            without=without or (),
        )
        report.table(*colour_table(found))
        report.say_all(colour_lines(found))
        report.done(found)


@commands.command(epilog="Example: impasto calibrate display measured.csv display.json --model tables")
def display(
    measured: Annotated[
        Path, typer.Argument(metavar="CSV", help="Colours sent to the display, and what was measured.")
    ],
    out: CalibrationFile,
    model: Annotated[
        str, typer.Option("--model", metavar="NAME", help="tables or gain-offset-gamma.")
    ] = "tables",
    name: Annotated[
        str | None, typer.Option("--name", metavar="TEXT", help="What summaries call the display.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Fit a model of a display to measured colours."""
    with reporting("calibrate display", json, debug) as report:
        found = calibrate.display(measured, out, model=model, name=name)
        report.say_all(display_lines(found))
        report.done({"file": found.file, "model": found.model, "ciede2000": found.difference})


@commands.command(epilog="Example: impasto calibrate steadiness photos/ steadiness.json")
def steadiness(
    photos: Annotated[Path, typer.Argument(metavar="PHOTOS", help="Photographs in the order taken.")],
    out: CalibrationFile,
    exclude: Exclude = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find out whether the camera moved between the photographs."""
    with reporting("calibrate steadiness", json, debug) as report:
        found = calibrate.steadiness(photos, out, exclude=exclude or ())
        report.say_all(steadiness_lines(found))
        report.done(found)


@commands.command(
    epilog="Example: impasto calibrate glare trap.tif --trap 90,90,110,110 --bright 10,10,60,60"
)
def glare(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="A black trap beside a bright card.")],
    trap: Annotated[str, typer.Option("--trap", metavar="C0,R0,C1,R1", help="Corners of the trap.")],
    bright: Annotated[str, typer.Option("--bright", metavar="C0,R0,C1,R1", help="Corners of the card.")],
    trap_reflectance: Annotated[
        float, typer.Option("--trap-reflectance", metavar="SHARE", help="0 for a black trap.")
    ] = 0.0,
    bright_reflectance: Annotated[
        float, typer.Option("--bright-reflectance", metavar="SHARE", help="Of the bright card.")
    ] = 0.98,
    dark: Dark = None,
    oecf: OecfFile = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Measure how much stray light lens and camera add."""
    with reporting("calibrate glare", json, debug) as report:
        found = calibrate.glare(
            photo,
            trap=corners(trap, "--trap"),
            bright=corners(bright, "--bright"),
            trap_reflectance=trap_reflectance,
            bright_reflectance=bright_reflectance,
            dark=dark,
            oecf=oecf,
        )
        report.say_all(glare_lines(found))
        report.done(found)
