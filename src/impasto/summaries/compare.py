"""What `compare` says when it is done."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import Row, count, percent

if TYPE_CHECKING:
    from impasto.evaluate.compare import CompareSummary
    from impasto.evaluate.tally import RegionComparison


def compare_tables(summary: CompareSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield for each region a heading, the columns' names, and a row per model."""
    for region in summary.regions:
        yield f"{region.name}: {count(region.pixels, 'pixel')}", *comparison_rows(region)


def comparison_rows(region: RegionComparison) -> tuple[Row, list[Row]]:
    """Return the columns' names, and a row per model."""
    header = ("model", "unknowns", "RMS / mean", "at highlights", "elsewhere", "As/Ad", "chosen")
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
    return header, rows


def compare_lines(summary: CompareSummary) -> Iterator[str]:
    """Yield what the columns mean."""
    first = summary.regions[0]
    yield (
        f"highlights: where that of {first.models[0].model} makes more than a tenth of the radiance; "
        "As/Ad: mean of the pixels, Ad in luminance, with 5th and 95th percentile"
    )
    yield "chosen: share of the pixels whose Bayesian information criterion is least with the model"
    if first.unknown_pixels:
        yield f"{count(first.unknown_pixels, 'pixel')} left out: some model has no full fit there"
    for spread in summary.spread:
        yield (
            f"As/Ad of {spread.model} over {spread.regions} regions: {spread.mean:.4g} ± {spread.sd:.2g}, "
            f"{spread.low:.3g} to {spread.high:.3g}"
        )
    if summary.files:
        yield f"maps in {summary.files[0].parent}"
