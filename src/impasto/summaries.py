"""What each stage says when it is done, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from impasto.capture.simulate import Simulation
    from impasto.evaluate import EvaluateSummary
    from impasto.evaluate.compare import CompareSummary
    from impasto.evaluate.gloss import GlossSummary
    from impasto.evaluate.gonio import GonioSummary
    from impasto.fit import FitSummary, ModelFit
    from impasto.maps import MapsSummary
    from impasto.models import ModelSpec
    from impasto.render import RenderSummary
    from impasto.stack import StackSummary

Row = Sequence[str]


def simulation_lines(summary: Simulation) -> Iterator[str]:
    """Yield what `simulate` made."""
    width, height = summary.size
    yield f"{summary.painting}: {_count(summary.photographs, 'photograph')} of {width} x {height} px"
    if summary.brackets:
        yield f"{_count(summary.brackets, 'shorter exposure')} of each, in brackets/"
    if summary.clipped_share == summary.clipped_share:
        yield f"clipped: {percent(summary.clipped_share)} of the samples"
        yield f"in cast shadow: {percent(summary.shadowed_share)} of the pixels, over all lights"
    yield f"{summary.folder} is ready, with the truth in {summary.folder / 'truth'}"


def stack_lines(summary: StackSummary) -> Iterator[str]:
    """Yield what `stack` read, assumed and wrote."""
    yield (
        f"{_count(summary.photographs, 'photograph')} of {summary.width} x {summary.height} px, "
        f"{_count(summary.channels, 'channel')}, decoded as {summary.transfer}"
    )
    if summary.already:
        yield "all of them were in the store before"
    elif summary.kept:
        yield f"{summary.kept} of them were in the store before"
    samples = summary.photographs * summary.width * summary.height * summary.channels
    clipped = sum(summary.clipped_samples.values())
    yield f"clipped: {percent(clipped / samples)} of the samples; they will not enter a fit"
    yield from (f"note: {note}" for note in summary.notes)
    yield f"{summary.store} is ready ({seconds(summary.seconds)})"


def fit_lines(summary: FitSummary) -> Iterator[str]:
    """Yield how the pixels of each model ended; `fit` has said its notes before."""
    yield f"{summary.width} x {summary.height} px under {_count(summary.photographs, 'light')}"
    for model in summary.models:
        yield f"{model.model}, procedure {model.procedure}: {_how(model)}"
        total = max(sum(model.pixels.values()), 1)
        yield from (f"    {meaning}: {percent(count / total)}" for meaning, count in model.pixels.items())
    yield f"{summary.store} is ready ({seconds(summary.seconds)})"


def _how(model: ModelFit) -> str:
    if model.already:
        return "was in the store before, with the same options"
    speed = f"{model.pixels_per_second:,.0f} pixels per second"
    return f"{seconds(model.seconds)}, {speed}{', continued from an earlier run' * model.continued}"


def render_lines(summary: RenderSummary) -> Iterator[str]:
    """Yield what `render` wrote, and what the display pictures cannot show."""
    kinds = " and ".join(sorted({path.suffix[1:].upper() for path in summary.files} - {"WEBP"}))
    yield f"{_count(len(summary.lights), 'rendering')} of {summary.model} in {summary.out} as {kinds}"
    if summary.animation:
        yield f"animated (8 bits): {summary.animation}"
    if any(path.suffix != ".exr" for path in summary.files):
        x, y = summary.white_xy
        yield (
            f"shown on {summary.display} at exposure {summary.exposure:g}, white x {x:.4f} y {y:.4f} adapted "
            f"by {summary.adaptation}; camera colour: {summary.camera_colour}"
        )
    if summary.too_bright > 0:
        rule = "cut" if summary.highlights == "clip" else "compressed by a soft shoulder"
        yield (
            f"brighter than the display's white: up to {percent(summary.too_bright)} of a picture's pixels, "
            f"{rule}; the EXR files hold them"
        )
    if summary.out_of_gamut > 0:
        yield (
            f"outside the display's gamut: up to {percent(summary.out_of_gamut)} of a picture's pixels, cut "
            "to its edge"
        )
    if summary.missing_pixels:
        yield f"{_count(summary.missing_pixels, 'pixel')} without a fit: missing in EXR, black on display"
    if summary.matte_pixels:
        yield f"{_count(summary.matte_pixels, 'pixel')} without an identified highlight: rendered matte"


def maps_lines(summary: MapsSummary) -> Iterator[str]:
    """Yield what `maps` wrote."""
    yield f"{_count(len(summary.maps), 'map')} of {summary.model} in {summary.out}"
    yield "each as float EXR, 16-bit TIFF and a picture with its legend; maps.json says what the codes mean"
    total = max(sum(summary.status.values()), 1)
    yield from (f"    {meaning}: {percent(count / total)}" for meaning, count in summary.status.items())


def evaluate_tables(summary: EvaluateSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield for each model a heading, the columns' names, and a row per held-out light and for the mean."""
    header = ("held-out light", "zenith", "PSNR dB", "SSIM", "RMS / mean")
    for model in summary.models:
        rows: list[Row] = [
            (
                entry.name,
                f"{entry.zenith_deg:.1f}°",
                f"{entry.errors.psnr_db:.2f}",
                f"{entry.errors.ssim:.4f}",
                f"{entry.errors.rms_relative:#.4g}",
            )
            for entry in model.lights
        ]
        mean = model.mean
        rows.append(("mean", "", f"{mean.psnr_db:.2f}", f"{mean.ssim:.4f}", f"{mean.rms_relative:#.4g}"))
        how = "fitted again without them" if model.refitted else "the fit in the store has not seen them"
        yield f"{model.model} ({model.procedure}; {how})", header, rows


def compare_tables(summary: CompareSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield for each region a heading, the columns' names, and a row per model."""
    header = ("model", "unknowns", "RMS / mean", "at highlights", "elsewhere", "As/Ad", "chosen")
    for region in summary.regions:
        rows: list[Row] = []
        for model in region.models:
            ratio = model.ratio
            told = "" if ratio is None else f"{ratio.mean:.4g} ({ratio.low:.3g} – {ratio.high:.3g})"
            errors = (model.rms, model.rms_highlight, model.rms_elsewhere)
            rows.append(
                (
                    model.model,
                    str(model.unknowns),
                    *("no light" if math.isnan(error) else f"{error:.4f}" for error in errors),
                    told,
                    percent(model.chosen),
                )
            )
        yield f"{region.name}: {_count(region.pixels, 'pixel')}", header, rows


def compare_lines(summary: CompareSummary) -> Iterator[str]:
    """Yield what the columns mean."""
    first = summary.regions[0]
    yield (
        f"highlights: where that of {first.models[0].model} makes more than a tenth of the radiance; "
        "As/Ad: mean of the pixels, Ad in luminance, with 5th and 95th percentile"
    )
    yield "chosen: share of the pixels whose Bayesian information criterion is least with the model"
    if first.unknown_pixels:
        yield f"{_count(first.unknown_pixels, 'pixel')} left out: some model has no full fit there"
    if summary.files:
        yield f"map of the choice in {summary.files[0].parent}"


def gonio_table(summary: GonioSummary) -> tuple[Row, list[Row]]:
    """Return the columns' names, and a row per place and model: its signed errors by band."""
    rows: list[Row] = []
    for curve in summary.curves:
        for name, model in curve.models.items():
            errors = ["no light" if e is None else f"{100 * e:+.2f} %" for e in model.signed_error.values()]
            width = "none" if math.isnan(curve.half_width_deg) else f"{curve.half_width_deg:.1f}°"
            rows.append((curve.name, name, width, *errors))
    return ("model − measured", "model", "half-width", "peak", "shoulder", "rest"), rows


def gonio_lines(summary: GonioSummary) -> Iterator[str]:
    """Yield what the bands are, and where the plots lie."""
    yield (
        "in luminance, as share of the measured mean of the band: peak within one half-width of the "
        "highlight from the mirror direction, shoulder one to three, rest beyond"
    )
    yield f"{_count(len(summary.curves), 'curve')} in {summary.out}, each as a plot and as a table"


def gloss_table(summary: GlossSummary) -> tuple[Row, list[Row]]:
    """Return the columns' names, and a row per region: its readings, and its pixels' in brackets."""
    angles = [reading.angle_deg for reading in summary.regions[0].readings]
    rows: list[Row] = []
    for region in summary.regions:
        cells = [
            f"{reading.gloss:.4g}"
            + (f" ({reading.low:.3g} – {reading.high:.3g})" if region.pixels > 1 else "")
            for reading in region.readings
        ]
        rows.append((region.name, *cells, f"{region.haze:.3g}"))
    return ("gloss", *(f"{angle:.0f}°" for angle in angles), "haze (60° − 20°)"), rows


def gloss_lines(summary: GlossSummary) -> Iterator[str]:
    """Yield how the readings are to be taken."""
    yield "in brackets: 5th to 95th percentile of the pixels, each as a flat sample"
    if not summary.absolute:
        yield (
            "relative gloss: nothing says what a white diffuser reads in this stack, so numbers compare "
            "within it only"
        )
    if summary.extrapolated_deg:
        angles = ", ".join(f"{angle:.0f}°" for angle in summary.extrapolated_deg)
        low, high = summary.facet_angle_deg
        yield (
            f"{angles}: beyond the lights, which met mirroring facets at {low:.0f} to {high:.0f}°; "
            "the reading rests on the model there"
        )
    unknown = summary.regions[0].unknown_pixels
    if unknown:
        yield f"{_count(unknown, 'pixel')} left out: their highlight is not known"
    if summary.files:
        yield f"maps in {summary.files[0].parent}"


def model_lines(spec: ModelSpec) -> Iterator[str]:
    """Yield a model's name, what it is, its shape parameters and its sources."""
    yield spec.name
    yield f"    {spec.title} [{', '.join(spec.citations)}]"
    for parameter in spec.shape:
        yield f"    {parameter.name}: {parameter.meaning}, {parameter.lower:g} to {parameter.upper:g}"


def seconds(value: float) -> str:
    """Return a duration as a person would say it."""
    if value < 90:
        return f"{value:.1f} s"
    return f"{value / 60:.0f} min" if value < 5400 else f"{value / 3600:.1f} h"


def percent(share: float) -> str:
    """Return a share in per cent, never rounding something to nothing."""
    if share == 0:
        return "0 %"
    return f"{100 * share:.2f} %" if share >= 0.0001 else "under 0.01 %"


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}" + ("" if number == 1 else "s")
