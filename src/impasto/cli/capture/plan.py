"""The subcommand `capture plan`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impasto import stand
from impasto.cli.app import Debug, Json, Overwrite, numbers
from impasto.cli.capture import commands
from impasto.console import reporting
from impasto.errors import OptionError, Problem


@commands.command(epilog="Example: impasto capture plan plan.toml --arm -72,72,4 --meter shot.tif")
def plan(
    out: Annotated[Path, typer.Argument(metavar="PLAN", help="TOML file to write.")],
    arm: Annotated[
        str | None,
        typer.Option("--arm", metavar="FROM,TO,STEP", help="Angles of an arm, degrees; ends included."),
    ] = None,
    dome: Annotated[
        int | None, typer.Option("--dome", metavar="N", help="N places spread evenly over a dome.")
    ] = None,
    lights: Annotated[
        Path | None,
        typer.Option("--lights", metavar="FILE", help="Light file, such as impasto angles --plan writes."),
    ] = None,
    camera: Annotated[
        str, typer.Option("--camera", metavar="DRIVER", help="gphoto2, folder or simulated.")
    ] = "folder",
    light: Annotated[
        str, typer.Option("--light", metavar="DRIVER", help="hand, gcode, dmx, command or simulated.")
    ] = "hand",
    times: Annotated[
        str | None, typer.Option("--times", metavar="S,S,…", help="Exposure times of each light, seconds.")
    ] = None,
    meter: Annotated[
        Path | None, typer.Option("--meter", metavar="PHOTO", help="A metering shot, for exposure times.")
    ] = None,
    meter_exposure_s: Annotated[
        float | None,
        typer.Option("--meter-exposure-s", metavar="S", help="Its exposure time, if not in the file."),
    ] = None,
    meter_place: Annotated[
        str | None,
        typer.Option("--meter-place", metavar="NAME", help="Its lamp's place; the most frontal by default."),
    ] = None,
    calibration: Annotated[
        list[str] | None,
        typer.Option(
            "--calibration",
            metavar="KIND",
            help="dark, white, ambient, grey-scale, colour, scale-bar or spheres; repeated.",
        ),
    ] = None,
    title: Annotated[str, typer.Option("--title", metavar="TEXT", help="What is photographed.")] = "",
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Write a plan: places of the lamps, exposures, calibration shots, time and room needed."""
    with reporting("capture plan", json, debug) as report:
        from impasto.summaries.capture import plan_lines

        summary = stand.plan(
            out,
            arm_deg=() if arm is None else _angles(arm),
            dome=dome,
            lights=lights,
            camera=camera,
            light=light,
            times_s=() if times is None else _times(times),
            meter_photograph=meter,
            meter_exposure_s=meter_exposure_s,
            meter_place=meter_place,
            **({} if calibration is None else {"calibration": calibration}),
            title=title,
            overwrite=overwrite,
        )
        report.say_all(plan_lines(summary))
        report.say(f"next: look at {out}, then: impasto capture run {out} photos/")
        report.done(summary)


def _angles(text: str) -> list[float]:
    first, last, step = numbers(text, 3, "--arm")
    count = (last - first) / step if step else -1.0
    if count < 0:
        do = "Write for example --arm -72,72,4"
        raise OptionError(Problem(f"--arm {text}", "leads from its start to nowhere", do))
    return [first + step * number for number in range(round(count - 0.499) + 1)]


def _times(text: str) -> list[float]:
    times = numbers(text, text.count(",") + 1, "--times")
    if min(times) <= 0:
        do = "Give seconds: --times 0.5,0.06,0.008"
        raise OptionError(Problem(f"--times {text}", "has a time that is not above 0", do))
    return sorted(times, reverse=True)
