"""The command line: one subcommand per stage, in the order of the pipeline."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

import impasto
from impasto.console import reporting
from impasto.errors import OptionError, Problem
from impasto.fit import PROCEDURES, FitOptions
from impasto.summaries import (
    compare_lines,
    compare_tables,
    evaluate_tables,
    fit_lines,
    gloss_lines,
    gloss_table,
    gonio_lines,
    gonio_table,
    maps_lines,
    model_lines,
    render_lines,
    seconds,
    simulation_lines,
    stack_lines,
)

# Parameters of glibc's mallopt.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3

app = typer.Typer(
    name="impasto",
    help="Measure how a painted surface reflects light, from photographs under a moving light, and show it "
    "under any light.\n\nPHOTOS is a folder of photographs with their light directions; STORE is the folder "
    "that holds everything measured from them, by custom named after the painting: painting.zarr.",
    epilog="Start with: impasto stack photos/ painting.zarr && impasto fit painting.zarr",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Json = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write what is printed to FILE, as data.")
]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an unexpected error.")]
Store = Annotated[Path, typer.Argument(metavar="STORE", help="The folder that impasto stack made.")]
Model = Annotated[str, typer.Option("--model", metavar="NAME", help="Reflectance model; see impasto models.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; made if needed.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")]


def _tell_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"impasto {impasto.__version__}")
        raise typer.Exit


@app.callback()
def _impasto(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", is_eager=True, callback=_tell_version),
    ] = False,
) -> None:
    pass


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
            format=format,
            bits=bits,
            noise=noise,
            cast_shadows=shadows,
        )
        report.say_all(simulation_lines(summary))
        report.done(summary)


@app.command(epilog="Example: impasto stack photos/ painting.zarr --lights dirs.lp --exclude blurred07")
def stack(
    photos: Annotated[Path, typer.Argument(metavar="PHOTOS", help="Folder with the photographs.")],
    store: Annotated[Path, typer.Argument(metavar="STORE", help="Folder to make, such as painting.zarr.")],
    lights: Annotated[
        Path | None,
        typer.Option("--lights", metavar="FILE", help="Light file; by default the one in PHOTOS."),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option("--exclude", metavar="NAME", help="Photograph to leave out; may be repeated."),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Read photographs and their lights into a store."""
    with reporting("stack", json, debug) as report:
        summary = impasto.stack(photos, store, lights=lights, exclude=exclude or (), overwrite=overwrite)
        report.say_all(stack_lines(summary))
        report.say(f"next: impasto fit {store}")
        report.done(summary)


@app.command(epilog="Example: impasto fit painting.zarr --model torrance-sparrow --loss cauchy")
def fit(
    store: Store,
    model: Annotated[
        list[str] | None,
        typer.Option(
            "--model", metavar="NAME", help="May be repeated; torrance-sparrow and phong by default."
        ),
    ] = None,
    procedure: Annotated[
        str | None,
        typer.Option(
            "--procedure",
            metavar="NAME",
            help=f"{' or '.join(PROCEDURES)}; joint by default, for lights in one plane paper --refined.",
        ),
    ] = None,
    refined: Annotated[
        bool, typer.Option("--refined", help="The paper's procedure with the calibrated view.")
    ] = FitOptions.refined,
    threshold: Annotated[
        str,
        typer.Option(
            "--threshold",
            metavar="DEG|auto",
            help="The paper's procedure: how far from its peak a highlight is seen.",
        ),
    ] = f"{FitOptions.threshold_deg:g}",
    highlight: Annotated[
        str,
        typer.Option(
            "--highlight",
            metavar="WHOSE",
            help="The paper's procedure: peak that --threshold counts from, pixel or sample.",
        ),
    ] = FitOptions.highlight,
    index: Annotated[
        float, typer.Option("--index", metavar="N", help="Index of refraction of the surface.")
    ] = FitOptions.index,
    fresnel: Annotated[
        str, typer.Option("--fresnel", metavar="WHICH", help="Angle of incidence: facet or element.")
    ] = FitOptions.fresnel,
    loss: Annotated[
        str, typer.Option("--loss", metavar="KIND", help="linear, or robust: cauchy or huber.")
    ] = FitOptions.loss,
    loss_scale: Annotated[
        float, typer.Option("--loss-scale", metavar="N", help="Where a robust loss sets in, in sigmas.")
    ] = FitOptions.loss_scale,
    shadow_level: Annotated[
        float | None,
        typer.Option("--shadow-level", metavar="Y", help="Leave out samples darker than this radiance."),
    ] = FitOptions.shadow_level,
    exclude: Annotated[
        list[str] | None,
        typer.Option("--exclude", metavar="NAME", help="Photograph to leave out; may be repeated."),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Fit reflectance models to every pixel of a stack."""
    with reporting("fit", json, debug) as report:
        options = FitOptions(
            index=index,
            fresnel=fresnel,
            loss=loss,
            loss_scale=loss_scale,
            shadow_level=shadow_level,
            exclude=tuple(exclude or ()),
            refined=refined,
            threshold_deg=_threshold(threshold),
            highlight=highlight,
        )
        more: dict[str, Any] = {"models": tuple(model)} if model else {}
        summary = impasto.fit(
            store,
            procedure=procedure,
            options=options,
            overwrite=overwrite,
            say=lambda note: report.say(f"note: {note}"),
            **more,
        )
        report.say_all(fit_lines(summary))
        report.say(f"next: impasto maps {store} --model {summary.models[0].model} --out maps/")
        report.done(summary)


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
        from impasto.render_lights import parse_angles, parse_light

        summary = impasto.render(
            store,
            model=model,
            lights=lights,
            light=[parse_light(text) for text in light or ()],
            arm=parse_angles(arm or ()),
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


@app.command(epilog="Example: impasto maps painting.zarr --model torrance-sparrow --out maps/")
def maps(store: Store, model: Model, out: Out, json: Json = None, debug: Debug = False) -> None:
    """Write the measured maps as pictures and as numbers."""
    with reporting("maps", json, debug) as report:
        summary = impasto.maps(store, model=model, out=out)
        report.say_all(maps_lines(summary))
        report.done(summary)


@app.command(epilog="Example: impasto evaluate painting.zarr --held-out 5")
def evaluate(
    store: Store,
    held_out: Annotated[
        int | None,
        typer.Option("--held-out", metavar="K", help="How many photographs to hold out; 5 by default."),
    ] = None,
    held_out_lights: Annotated[
        Path | None,
        typer.Option("--held-out-lights", metavar="FILE", help="Names of photographs, or a light file."),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Compare renderings with photographs that the fit has not seen."""
    with reporting("evaluate", json, debug) as report:
        summary = impasto.evaluate(
            store, models=model or (), held_out=held_out, held_out_lights=held_out_lights
        )
        report.say(f"{len(summary.held_out)} photographs held out, {summary.fitted} fitted")
        for heading, header, rows in evaluate_tables(summary):
            report.say()
            report.say(heading)
            report.table(header, rows)
        report.done(summary)


@app.command(epilog="Example: impasto compare painting.zarr --regions drawn.png --out comparison/")
def compare(
    store: Store,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    regions: Annotated[
        Path | None,
        typer.Option("--regions", metavar="FILE", help="Picture with a colour per region, black outside."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for a map of the models chosen.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Compare the fitted models: As/Ad, errors at highlights and elsewhere, and the choice per pixel."""
    with reporting("compare", json, debug) as report:
        summary = impasto.compare(store, models=model or (), regions=regions, out=out)
        for heading, header, rows in compare_tables(summary):
            report.say(heading)
            report.table(header, rows)
            report.say()
        report.say_all(compare_lines(summary))
        report.done(summary)


@app.command(epilog="Example: impasto gonio painting.zarr --pixel 120,80 --out curves/")
def gonio(
    store: Store,
    out: Out,
    model: Annotated[
        list[str] | None,
        typer.Option("--model", metavar="NAME", help="May be repeated; those in the store by default."),
    ] = None,
    pixel: Annotated[
        list[str] | None,
        typer.Option("--pixel", metavar="COLUMN,ROW", help="A single pixel; may be repeated."),
    ] = None,
    regions: Annotated[
        Path | None,
        typer.Option("--regions", metavar="FILE", help="Picture with a colour per region, black outside."),
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Plot measured and modelled radiance against the angle of the light."""
    with reporting("gonio", json, debug) as report:
        summary = impasto.gonio(store, out=out, models=model or (), pixels=_pixels(pixel), regions=regions)
        report.table(*gonio_table(summary))
        report.say_all(gonio_lines(summary))
        report.done(summary)


@app.command(epilog="Example: impasto gloss painting.zarr --model torrance-sparrow --regions drawn.png")
def gloss(
    store: Store,
    model: Model,
    regions: Annotated[
        Path | None,
        typer.Option("--regions", metavar="FILE", help="Picture with a colour per region, black outside."),
    ] = None,
    pixel: Annotated[
        list[str] | None,
        typer.Option("--pixel", metavar="COLUMN,ROW", help="A single pixel; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for a map of each angle.")
    ] = None,
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Predict what a glossmeter would read at 20, 60 and 85°."""
    with reporting("gloss", json, debug) as report:
        summary = impasto.gloss(store, model=model, regions=regions, pixels=_pixels(pixel), out=out)
        report.table(*gloss_table(summary))
        report.say_all(gloss_lines(summary))
        report.done(summary)


@app.command(epilog="Example: impasto models")
def models(json: Json = None, debug: Debug = False) -> None:
    """List the reflectance models."""
    with reporting("models", json, debug) as report:
        for spec in impasto.models.MODELS.values():
            report.say_all(model_lines(spec))
        report.say()
        report.say("The papers behind them are listed in docs/references.md.")
        report.done({"models": list(impasto.models.MODELS.values())})


@app.command(epilog="Example: impasto demo demo/")
def demo(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")] = Path("demo"),
    json: Json = None,
    debug: Debug = False,
) -> None:
    """Run everything on a small simulated painting, and write a page about it."""
    with reporting("demo", json, debug) as report:
        summary = impasto.demo(out, say=report.say)
        report.say()
        report.say(f"everything took {seconds(summary.seconds)}; open this page in a browser:")
        report.say(f"    {summary.page.resolve()}")
        report.done(summary)


def _threshold(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise OptionError(
            Problem(f"--threshold {text}", "is neither a number of degrees nor auto", "Try 35, or auto")
        ) from None


def _size(text: str) -> tuple[int, int]:
    return _pair(text.replace("x", ","), "--size", "Write width and height: --size 768,512")


def _pixels(texts: list[str] | None) -> list[tuple[int, int]]:
    return [_pair(text, "--pixel", "Write column and row: --pixel 120,80") for text in texts or ()]


def _pair(text: str, option: str, do: str) -> tuple[int, int]:
    try:
        first, second = (int(part) for part in text.split(","))
    except ValueError:
        raise OptionError(Problem(f"{option} {text}", "is not two whole numbers", do)) from None
    return first, second


def main() -> None:
    """Run the command line."""
    _keep_freed_memory()
    app()


def _keep_freed_memory() -> None:
    """Let large buffers be used again instead of going back to the system, which clears each page anew."""
    with suppress(OSError, AttributeError):  # where the C library is not glibc
        library = ctypes.CDLL(None)
        for parameter in (_TRIM_THRESHOLD, _MMAP_THRESHOLD):
            library.mallopt(parameter, 1 << 30)
