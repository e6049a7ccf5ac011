"""The page of the demo: pictures, errors on photographs that were held out, and how far from the truth."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.steadiness import Steadiness
from impasto.colour import encode_srgb, quantise
from impasto.console import versions
from impasto.demo.calibration import CalibrationSummary
from impasto.demo.observers import ObserversSummary
from impasto.evaluate import EvaluateSummary
from impasto.fit import FitSummary
from impasto.maps import MapsSummary
from impasto.page import Page, Picture, Section
from impasto.render import RenderSummary
from impasto.stack import StackSummary
from impasto.store import open_fit, open_stack
from impasto.summaries.evaluate import evaluate_tables
from impasto.summaries.scale import scale_tables
from impasto.summaries.words import count, percent, seconds

_TITLES = {"torrance-sparrow": "Torrance-Sparrow", "phong": "Phong"}
_SHOWN_MAPS = ("normal", "diffuse", "specular", "c", "c_sd", "normal_sd", "status", "residual_rms")
_SHOWN_LIGHTS = 3


@dataclass(frozen=True)
class DemoSummary:
    """What `demo` did.

    Parameters
    ----------
    page : Path
        The page to open in a browser.
    store : Path
        The painting's store.
    calibrated : CalibrationSummary
    stacked : StackSummary
    fitted : FitSummary
    evaluated : EvaluateSummary
    rendered : tuple of RenderSummary
        The held-out lights under each model, and the sweep.
    mapped : tuple of MapsSummary
        One entry per model.
    compared : ObserversSummary
        What simulated observers chose.
    steps : dict of str to float
        Seconds that each step took.
    seconds : float
    """

    page: Path
    store: Path
    calibrated: CalibrationSummary
    stacked: StackSummary
    fitted: FitSummary
    evaluated: EvaluateSummary
    rendered: tuple[RenderSummary, ...]
    mapped: tuple[MapsSummary, ...]
    compared: ObserversSummary
    steps: dict[str, float]
    seconds: float


def write_page(summary: DemoSummary, truth: Path) -> None:
    """Write the page of a demo.

    Parameters
    ----------
    summary : DemoSummary
        What the demo did.
    truth : Path
        Folder of the simulation's truth.

    Raises
    ------
    OutputError
        If the page cannot be written.
    """
    stacked, evaluated = summary.stacked, summary.evaluated
    page = Page(
        "A painting under any light",
        f"{stacked.photographs} simulated photographs of {stacked.width} x {stacked.height} pixels, "
        f"measured by two reflectance models, and rendered under {len(evaluated.held_out)} lights that the "
        "fits have not seen.",
    )
    sweep = summary.rendered[-1]
    truth_picture = Picture((truth / "preview.png").read_bytes(), "The simulated painting by daylight")
    shown = [truth_picture]
    if sweep.animation:
        caption = "Rendered from the fit under a light that moves along the arm, from -66° to 66°"
        shown.append(Picture(sweep.animation.read_bytes(), caption, "image/webp"))
    page.section("The painting").pictures(shown, columns=2)

    _write_calibration(page.section("How camera and lights were calibrated"), summary.calibrated)
    part = page.section("Lights that the fit has not seen")
    part.text(
        "These photographs were kept out of the fit, and rendered from it. Relative radiance 1, which a "
        "white surface facing the light has by the white reference, is shown as white."
    )
    for pictures in _held_out_pictures(summary):
        part.pictures(pictures)
    part.table(*_errors(evaluated), caption="Photographs kept out of the fit", total=True)
    part.text(
        "PSNR and SSIM compare the pictures in sRGB, as shown here. RMS / mean compares "
        "relative radiance over all samples that are not clipped."
    )

    part = page.section("What was measured")
    chosen = summary.mapped[0]
    part.text(f"Maps of the {_title(chosen.model)} model, with their uncertainty.")
    previews = {entry.name: entry.preview for entry in chosen.maps}
    part.pictures(
        [Picture(previews[name].read_bytes(), _caption(name)) for name in _SHOWN_MAPS if name in previews],
        columns=2,
    )
    statuses = dict.fromkeys(status for model in summary.fitted.models for status in model.pixels)
    part.table(
        ("model", *statuses, "pixels per second"),
        [
            (
                _title(model.model),
                *(percent(model.pixels.get(name, 0) / sum(model.pixels.values())) for name in statuses),
                f"{model.pixels_per_second:,.0f}",
            )
            for model in summary.fitted.models
        ],
        caption="How the fit of each pixel ended",
    )

    part = page.section("How far from the truth")
    part.text(
        "The painting is simulated, so its true normals and highlights are known. The photographs have "
        "noise, cast shadows and clipping, but their highlights follow one of the two models fitted here. "
        "Real paint does not, and errors on real photographs are larger."
    )
    part.table(
        ("model", "normal, median", "normal, 95th percentile", "c / true c, median"),
        list(_truth_rows(summary, truth)),
        caption="Angle between fitted and true normal; fitted over true width of the highlight",
    )

    part.notes("Assumed or left out", [*stacked.notes, *summary.fitted.notes])
    _write_observers(page.section("To the eyes of simulated observers"), summary.compared)
    part = page.section("The same by hand")
    part.commands(
        (
            "impasto simulate photos/ --dome",
            "impasto calibrate lights photos/calibration/spheres --camera photos/capture.toml --out lights/",
            "impasto stack photos/ painting.zarr --lights lights/lights.toml",
            "impasto fit painting.zarr",
            "impasto evaluate painting.zarr --held-out 5",
            "impasto render painting.zarr --model torrance-sparrow --arm -66:66:6 --out film/",
            "impasto maps painting.zarr --model torrance-sparrow --out maps/",
            "impasto experiment create painting.zarr --out experiment/",
            "impasto experiment simulate experiment/",
            "impasto experiment export experiment/ trials.csv",
            "impasto scale trials.csv --errors experiment/ --out scales/",
        )
    )
    part = page.section("How it was made")
    part.table(
        ("step", "time"),
        [(name, seconds(duration)) for name, duration in summary.steps.items()],
        caption=f"On {os.cpu_count()} processor cores, {platform.machine()}",
    )
    part.text(versions())
    page.write(summary.page)


def _write_calibration(part: Section, calibrated: CalibrationSummary) -> None:
    """Write what the simulated calibration shots told."""
    lights, response, colour = calibrated.lights, calibrated.response, calibrated.colour
    left_out = np.mean(colour.fits[colour.chosen].left_out)
    glare = float(calibrated.glare.share.mean())
    use = "needs no function of its own" if response.linear else "got a function of its own"
    part.table(
        ("shot", "what it told"),
        [
            (
                f"{count(len(lights.spheres), 'mirror sphere')}",
                f"directions of {count(len(lights.names), 'light')}, {calibrated.off_deg:.2f}° off the "
                "simulated lamps in the median",
            ),
            ("grey scale", f"the camera is linear within {percent(response.nonlinearity)} and {use}"),
            ("cap on", f"{count(calibrated.dark.hot, 'hot pixel')}; the level is taken off each photograph"),
            (
                "white card",
                f"lens and light depart by up to {percent(calibrated.flat.before)} from the middle of the "
                f"frame, {percent(calibrated.flat.after)} after correction; a perfect white diffuser reads "
                f"{calibrated.white.radiance.mean():.4f} of full scale",
            ),
            ("colour chart", f"CIEDE2000 {left_out:.2f} for patches left out of the fit"),
            (
                "black trap in a white card",
                f"the lens adds {percent(glare)} of the card's light to what is black beside it",
            ),
            (
                "the photographs themselves",
                _steady(calibrated.steadiness),
            ),
        ],
        caption="Simulated shots for calibration, with which the photographs were read",
        words=True,
    )


def _steady(found: Steadiness) -> str:
    """Say whether the photographs lie on each other."""
    off = np.hypot(*found.shift_px.T)
    if not np.isfinite(off).any():
        return "show too little to tell whether the camera moved"
    back = count(len(found.corrected), "photograph")
    return f"lie within {np.nanmax(off):.2f} px of each other; {back} had to be shifted back"


def _write_observers(part: Section, compared: ObserversSummary) -> None:
    """Write what simulated observers chose, and that they are no persons."""
    simulated, scaled = compared.simulated, compared.scaled
    part.text(
        f"SIMULATED: {count(len(simulated.observers), 'observer')} who are a program, not people, compared "
        "the two renderings with the photograph under each of the lights that the fits have not seen, and "
        f"chose the one with the smaller {simulated.by} difference as they saw it through noise. Their "
        "answers went the way of real ones, from the stimuli to the scale; they say nothing about what "
        "people see."
    )
    figures = {file.stem: file.read_bytes() for file in scaled.files if file.suffix == ".png"}
    whose = "of simulated observers"
    part.pictures(
        [
            Picture(figures["scale-by-angle"], f"Choices {whose} as an interval scale, by light and pooled"),
            Picture(figures["proportions-pooled"], f"Shares of the choices {whose}, over all lights"),
        ],
        columns=2,
    )
    caption = f"Does a measured difference predict the choices {whose}?"
    part.pictures([Picture(figures["physical-errors"], caption)], columns=1)
    heading, header, rows, _ = next(scale_tables(scaled))
    part.table(header, rows, caption=f"Simulated observers, {heading}")


def _held_out_pictures(summary: DemoSummary) -> Iterator[list[Picture]]:
    """Yield for a few lights the photograph and its renderings."""
    stack = open_stack(summary.store)
    lights = summary.evaluated.models[0].lights
    order = np.argsort([entry.zenith_deg for entry in lights])
    for index in order[np.linspace(0, len(order) - 1, _SHOWN_LIGHTS).round().astype(int)]:
        entry = lights[index]
        light = stack.lights.names.index(entry.name)
        photograph = stack.radiance(slice(0, stack.shape[1]), slice(0, stack.shape[2]), [light])[0]
        where = f"light {entry.zenith_deg:.0f}° from the normal"
        pictures = [Picture(_png(photograph), f"Photograph, {where}")]
        for rendered in summary.rendered[:-1]:
            data = (rendered.out / f"{entry.name}.png").read_bytes()
            pictures.append(Picture(data, f"{_title(rendered.model)}, {where}"))
        yield pictures


def _errors(evaluated: EvaluateSummary) -> tuple[list[str], list[list[str]]]:
    """Return the models' errors side by side: the columns' names, and a row per light and for the mean."""
    # Further tables tell other things than the errors of a model.
    tables = list(evaluate_tables(evaluated))[: len(evaluated.models)]
    _, names, rows = tables[0]
    columns = range(2, len(names))
    header = [*names[:2]] + [
        f"{names[column]}\n{_title(model.model)}" for column in columns for model in evaluated.models
    ]
    cells = [
        [*row[:2]] + [table[2][index][column] for column in columns for table in tables]
        for index, row in enumerate(rows)
    ]
    return header, cells


def _truth_rows(summary: DemoSummary, truth: Path) -> Iterator[tuple[str, ...]]:
    true_normal, true_c = _read(truth / "normal.exr"), _read(truth / "c.exr")[..., 0]
    for model in summary.fitted.models:
        fitted = open_fit(summary.store, model.model)
        names = [name for name in ("normal", "c") if name in fitted.names]
        height, width = fitted.shape
        maps = fitted.read(slice(0, height), slice(0, width), names)
        cosine = np.clip(np.sum(maps["normal"] * true_normal, axis=-1), -1, 1)
        angle = np.degrees(np.arccos(cosine))
        seen = true_c > 0
        ratio = f"{np.nanmedian(maps['c'][seen] / true_c[seen]):.3f}" if "c" in maps else "has no c"
        yield (
            _title(model.model),
            f"{np.nanmedian(angle):.2f}°",
            f"{np.nanpercentile(angle, 95):.2f}°",
            ratio,
        )


def _read(path: Path) -> NDArray[np.float32]:
    import OpenImageIO as oiio

    image: Any = oiio.ImageInput.open(str(path))
    pixels: NDArray[np.float32] = image.read_image("float")
    image.close()
    return pixels


def _png(image_linear: NDArray[np.float32]) -> bytes:
    import imagecodecs

    return bytes(imagecodecs.png_encode(quantise(encode_srgb(image_linear))))


def _title(model: str) -> str:
    return _TITLES.get(model, model)


def _caption(name: str) -> str:
    captions = {
        "normal": "Normals: the relief of the brush strokes",
        "diffuse": "Diffuse colour, free of highlights and shading",
        "specular": "Strength of the highlight",
        "c": "Width of the highlight: small is glossy",
        "c_sd": "Its uncertainty",
        "normal_sd": "Uncertainty of the normal",
        "status": "How the fit of each pixel ended",
        "residual_rms": "What the model leaves unexplained",
    }
    return captions[name]
