"""What `gloss` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import Row, count

if TYPE_CHECKING:
    from impasto.evaluate.gloss import GlossSummary


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
        yield f"{count(unknown, 'pixel')} left out: their highlight is not known"
    if summary.files:
        yield f"maps in {summary.files[0].parent}"
