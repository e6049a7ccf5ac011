"""The subcommand `fit`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

import impasto
from impasto.cli.app import Debug, Json, Overwrite, Store, app
from impasto.console import reporting
from impasto.errors import OptionError, Problem
from impasto.fit import PROCEDURES, FitOptions
from impasto.summaries.fit import fit_lines


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
    shadows: Annotated[
        bool,
        typer.Option("--shadows", help="Find samples in cast shadows, pixel by pixel, and leave them out."),
    ] = FitOptions.shadows,
    share_reflectance: Annotated[
        bool,
        typer.Option(
            "--share-reflectance",
            help="Where no light shows a pixel's highlight, lean on neighbours of the same colour.",
        ),
    ] = FitOptions.share_reflectance,
    highlight_colour: Annotated[
        str,
        typer.Option(
            "--highlight-colour",
            metavar="KIND",
            help="white; own, as gilding's; auto lets lights left out choose, with --residual.",
        ),
    ] = FitOptions.highlight_colour,
    residual: Annotated[
        bool,
        typer.Option("--residual", help="Describe what the model leaves over, over light direction."),
    ] = FitOptions.residual,
    residual_components: Annotated[
        int,
        typer.Option(
            "--residual-components", metavar="K", help="Coefficients per pixel of that description."
        ),
    ] = FitOptions.residual_components,
    self_calibrate: Annotated[
        bool | None,
        typer.Option(
            "--self-calibrate/--no-self-calibrate",
            help="Find the strength of each light from the photographs; by default with --residual.",
            show_default=False,
        ),
    ] = FitOptions.self_calibrate,
    calibrate_directions: Annotated[
        bool,
        typer.Option(
            "--calibrate-directions/--keep-directions",
            help="Whether self-calibration may correct the lights' directions.",
        ),
    ] = FitOptions.calibrate_directions,
    calibrate_distances: Annotated[
        bool,
        typer.Option(
            "--calibrate-distances/--keep-distances",
            help="Whether self-calibration may find that distant lights were near.",
        ),
    ] = FitOptions.calibrate_distances,
    choose_ambient: Annotated[
        bool,
        typer.Option(
            "--choose-ambient",
            help="Fit each model with or without its ambient term, whichever meets lights left out closer.",
        ),
    ] = False,
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
            shadows=shadows,
            share_reflectance=share_reflectance,
            exclude=tuple(exclude or ()),
            refined=refined,
            threshold_deg=_threshold(threshold),
            highlight=highlight,
            highlight_colour=highlight_colour,
            residual=residual,
            residual_components=residual_components,
            self_calibrate=self_calibrate,
            calibrate_directions=calibrate_directions,
            calibrate_distances=calibrate_distances,
        )
        more: dict[str, Any] = {"models": tuple(model)} if model else {}
        summary = impasto.fit(
            store,
            procedure=procedure,
            options=options,
            choose_ambient=choose_ambient,
            overwrite=overwrite,
            say=lambda note: report.say(f"note: {note}"),
            **more,
        )
        report.say_all(fit_lines(summary))
        report.say(f"next: impasto maps {store} --model {summary.models[0].model} --out maps/")
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
