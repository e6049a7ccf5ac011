"""The subcommand `experiment create`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import impasto
from impasto.cli.app import Debug, Json, numbers
from impasto.cli.experiment import commands
from impasto.cli.experiment.options import ViewingFile, read_text, read_viewing
from impasto.console import reporting
from impasto.errors import OptionError, Problem


@commands.command(epilog="Example: impasto experiment create a.zarr b.zarr --out experiment/ --angles 7")
def create(
    stores: Annotated[list[Path], typer.Argument(metavar="STORE...", help="One fitted store per sample.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the experiment.")],
    design: Annotated[
        str, typer.Option("--design", metavar="NAME", help="What competes: models or angle-groups.")
    ] = "models",
    model: Annotated[
        list[str] | None,
        typer.Option(
            "--model", metavar="NAME", help="Repeat for several; torrance-sparrow and phong by default."
        ),
    ] = None,
    groups: Annotated[
        list[Path] | None,
        typer.Option(
            "--groups",
            metavar="FILE",
            help="For angle-groups: what impasto angles --groups wrote; one for all stores or one for each.",
        ),
    ] = None,
    sample: Annotated[
        list[str] | None,
        typer.Option("--sample", metavar="NAME", help="Names of the samples, in the order of the stores."),
    ] = None,
    angle: Annotated[
        list[str] | None,
        typer.Option("--angle", metavar="ANGLE", help="Degrees on the arm, or a photograph; repeated."),
    ] = None,
    angles: Annotated[
        int | None,
        typer.Option("--angles", metavar="N", help="How many to choose, half with highlight; 7 by default."),
    ] = None,
    crop: Annotated[
        str | None,
        typer.Option("--crop", metavar="X,Y,W,H", help="What to show, in pixels of the photographs."),
    ] = None,
    longest: Annotated[
        int, typer.Option("--longest", metavar="PX", help="Longer side of the pictures; larger are reduced.")
    ] = 400,
    exposure: Annotated[
        float | None,
        typer.Option("--exposure", metavar="N", help="Of all pictures; by default chosen for each sample."),
    ] = None,
    display: Annotated[
        str, typer.Option("--display", metavar="NAME|FILE", help="srgb, display-p3 or an ICC profile.")
    ] = "srgb",
    white_point: Annotated[
        str | None, typer.Option("--white-point", metavar="WHITE", help="As for impasto render.")
    ] = None,
    adaptation: Annotated[
        str, typer.Option("--adaptation", metavar="HOW", help="To that white: cat16 or bradford.")
    ] = "cat16",
    highlights: Annotated[
        str, typer.Option("--highlights", metavar="RULE", help="Above the display's white: clip or shoulder.")
    ] = "clip",
    layout: Annotated[
        str,
        typer.Option(
            "--layout", metavar="NAME", help="beside: all at once; alternating: one at a time at one place."
        ),
    ] = "beside",
    ties: Annotated[bool, typer.Option("--ties", help="Observers may see no difference.")] = False,
    repeats: Annotated[
        int, typer.Option("--repeats", metavar="N", help="Pairs that each observer sees twice.")
    ] = 5,
    catch_every: Annotated[
        int,
        typer.Option("--catch-every", metavar="N", help="One trial with an obvious answer among N; or 0."),
    ] = 20,
    practice: Annotated[
        int, typer.Option("--practice", metavar="N", help="Trials before the first that counts.")
    ] = 3,
    break_every: Annotated[
        int, typer.Option("--break-every", metavar="N", help="Offer a pause after N trials; 0 for none.")
    ] = 40,
    minimum_view: Annotated[
        float, typer.Option("--minimum-view", metavar="S", help="Seconds before an answer is taken.")
    ] = 1.0,
    adaptation_time: Annotated[
        float, typer.Option("--adaptation-time", metavar="S", help="Seconds of neutral field at the start.")
    ] = 60.0,
    vision_checks: Annotated[
        bool, typer.Option("--vision-checks", help="Check colour vision and acuity before the start.")
    ] = False,
    display_check: Annotated[
        bool, typer.Option("--display-check/--no-display-check", help="Check the display by eye first.")
    ] = True,
    viewing: ViewingFile = None,
    title: Annotated[
        str, typer.Option("--title", metavar="TEXT", help="What observers read first.")
    ] = "Which reproduction is closer?",
    consent: Annotated[
        Path | None,
        typer.Option("--consent", metavar="FILE", help="Text that observers agree to, instead of the usual."),
    ] = None,
    instructions: Annotated[
        Path | None,
        typer.Option("--instructions", metavar="FILE", help="Text of the instructions instead of the usual."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the random order.")] = 0,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Make a paired-comparison experiment from fitted paintings."""
    with reporting("experiment create", json, debug) as report:
        from impasto.summaries.experiment import create_lines

        if angle and angles is not None:
            what = "both choose angles, and one of them is expected"
            raise OptionError(Problem("--angle and --angles", what, "Leave one of them out"))
        summary = impasto.experiment.create(
            stores,
            out=out,
            design=design,
            models=model or (),
            groups=groups or (),
            samples=sample or (),
            angles=angle or angles,
            crop=_four(crop),
            longest=longest,
            exposure=exposure,
            display=display,
            white_point=white_point,
            adaptation=adaptation,
            highlights=highlights,
            title=title,
            consent=read_text(consent, "--consent"),
            instructions=read_text(instructions, "--instructions"),
            presentation=_presentation(
                layout=layout,
                ties=ties,
                repeats=repeats,
                catch_every=catch_every,
                practice=practice,
                break_every=break_every,
                minimum_view_s=minimum_view,
                adaptation_s=adaptation_time,
                vision_checks=vision_checks,
                display_check=display_check,
            ),
            viewing=read_viewing(viewing),
            seed=seed,
        )
        report.say_all(create_lines(summary))
        report.say(f"next: impasto experiment invite {out} --observers 18 && impasto experiment serve {out}")
        report.done(summary)


def _presentation(**options: Any) -> Any:
    from pydantic import ValidationError

    from impasto.psychophysics.experiment.manifest import Presentation, validation_problems

    try:
        return Presentation(**options)
    except ValidationError as error:
        do = "impasto experiment create --help has the meaning of each option"
        raise OptionError(validation_problems("how trials run", error, do)) from error


def _four(text: str | None) -> tuple[int, int, int, int] | None:
    if text is None:
        return None
    left, top, width, height = (int(value) for value in numbers(text, 4, "--crop"))
    return left, top, width, height
