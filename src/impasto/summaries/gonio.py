"""What `gonio` says when it is done."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from impasto.summaries.words import Row, count

if TYPE_CHECKING:
    from impasto.evaluate.curves import Curve
    from impasto.evaluate.gonio import GonioSummary


def gonio_table(summary: GonioSummary) -> tuple[Row, list[Row]]:
    """Return the columns' names, and a row per place and model: its signed errors by band."""
    return curve_rows(summary.curves)


def curve_rows(curves: Sequence[Curve]) -> tuple[Row, list[Row]]:
    """Return the same for some curves."""
    rows: list[Row] = []
    for curve in curves:
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
    yield f"{count(len(summary.curves), 'curve')} in {summary.out}, each as a plot and as a table"
