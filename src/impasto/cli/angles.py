"""The subcommand `angles`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from impasto.cli.app import Debug, Json, app, numbers
from impasto.console import reporting
from impasto.errors import OptionError, Problem
from impasto.summaries.angles import angles_lines, angles_tables, check_lines, check_tables, plan_lines

if TYPE_CHECKING:
    from impasto.angles import AnglesSummary
    from impasto.angles.plan import CheckSummary, PlanSummary

T = TypeVar("T")


@app.command(epilog="Example: impasto angles painting.zarr --held-out 5 --out angles/")
def angles(
    store: Annotated[
        Path | None,
        typer.Argument(
            metavar="[STORE]", help="The folder that impasto stack made; for --check also a light file."
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Say what the lights tell, and what they do not.")
    ] = False,
    plan: Annotated[
        str | None,
        typer.Option("--plan", metavar="KIND", help="Say where to put lights: on an arm or in a dome."),
    ] = None,
    lights: Annotated[
        int | None, typer.Option("--lights", metavar="N", help="How many lights to plan.")
    ] = None,
    gloss: Annotated[
        str | None,
        typer.Option("--gloss", metavar="LOW,HIGH", help="Surface to plan for: gloss units at 60°."),
    ] = None,
    relief: Annotated[
        float | None,
        typer.Option("--relief", metavar="DEG", help="Surface to plan for: tilt of its steepest normals."),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; torrance-sparrow by default."),
    ] = None,
    held_out: Annotated[
        int | None,
        typer.Option("--held-out", metavar="K", help="Judge by K photographs that no fit sees; by all if 0."),
    ] = None,
    held_out_lights: Annotated[
        Path | None,
        typer.Option("--held-out-lights", metavar="FILE", help="Names of photographs, or a light file."),
    ] = None,
    measure: Annotated[
        str, typer.Option("--measure", metavar="NAME", help="What must stay: rms, ciede2000 or psnr.")
    ] = "rms",
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", metavar="N", help="By how much: 5 %, CIEDE2000 1 or 0.5 dB by default."),
    ] = None,
    sizes: Annotated[
        str | None,
        typer.Option("--sizes", metavar="N,N,…", help="Numbers of photographs to try; ten by default."),
    ] = None,
    pixels: Annotated[
        int, typer.Option("--pixels", metavar="N", help="How many pixels to fit again.")
    ] = 20_000,
    draws: Annotated[
        int, typer.Option("--draws", metavar="N", help="How many random sets of each size.")
    ] = 40,
    regions: Annotated[
        Path | None,
        typer.Option("--regions", metavar="FILE", help="Picture with a colour per region, black outside."),
    ] = None,
    image: Annotated[bool, typer.Option("--image", help="Fit every pixel of the image again too.")] = False,
    groups: Annotated[
        Path | None,
        typer.Option("--groups", metavar="FILE", help="Write groups of photographs for impasto experiment."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for plots, tables and light files.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Find how few photographs would have served, check lights, or plan where to put them."""
    # Here, not above: they take long to import, and every command imports this module.
    from impasto.angles import angles as find_angles
    from impasto.angles.plan import check as check_lights
    from impasto.angles.plan import plan as plan_lights

    with reporting("angles", json, debug) as report:
        if check and plan is not None:
            raise OptionError(
                Problem("--check and --plan", "were both given, expected one of them", "Leave one out")
            )
        gloss_range = None if gloss is None else _range(gloss)
        first = (model or ["torrance-sparrow"])[0]
        result: PlanSummary | CheckSummary | AnglesSummary
        if plan is not None:
            result = plan_lights(
                plan,
                _needed(lights, "--lights", "Say how many: --lights 11"),
                store=store,
                model=first,
                gloss=gloss_range,
                relief_deg=relief,
                out=_needed(out, "--out", "Name a folder for the plan: --out plan/"),
            )
            report.say_all(plan_lines(result))
            tables = check_tables(result.identifiability)
        elif check:
            source = _needed(store, "STORE", "Name a store or a light file")
            result = check_lights(source, model=first, gloss=gloss_range, relief_deg=relief)
            report.say_all(check_lines(result))
            tables = check_tables(result.identifiability)
        else:
            result = find_angles(
                _needed(store, "STORE", "Name the folder that impasto stack made"),
                models=model or ("torrance-sparrow",),
                held_out=held_out or None,
                held_out_lights=held_out_lights,
                measure=measure,
                limit=tolerance,
                sizes=_sizes(sizes),
                pixels=pixels,
                draws=draws,
                regions=regions,
                image=image,
                groups=groups,
                out=out,
            )
            report.say_all(angles_lines(result))
            tables = angles_tables(result)
        for heading, header, rows in tables:
            report.say()
            report.say(heading)
            report.table(header, rows)
        report.done(result)


def _needed(value: T | None, where: str, do: str) -> T:
    if value is None:
        raise OptionError(Problem(where, "is missing, and is needed here", do))
    return value


def _range(text: str) -> tuple[float, float]:
    low, high = numbers(text, 2, "--gloss")
    return low, high


def _sizes(text: str | None) -> list[int]:
    if text is None:
        return []
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise OptionError(
            Problem(f"--sizes {text}", "is not whole numbers with commas", "Write for example --sizes 5,7,9")
        ) from None
