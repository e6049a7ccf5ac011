"""What `maps` and `height` say when they are done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent

if TYPE_CHECKING:
    from impasto.maps import MapsSummary
    from impasto.maps.height import HeightSummary


def maps_lines(summary: MapsSummary) -> Iterator[str]:
    """Yield what `maps` wrote."""
    yield f"{count(len(summary.maps), 'map')} of {summary.model} in {summary.out}"
    yield "each as float EXR, 16-bit TIFF and a picture with its legend; maps.json says what the codes mean"
    total = max(sum(summary.status.values()), 1)
    yield from (f"    {meaning}: {percent(count / total)}" for meaning, count in summary.status.items())


def height_lines(summary: HeightSummary) -> Iterator[str]:
    """Yield what `height` wrote."""
    yield (
        f"{summary.columns} x {summary.rows} heights every {summary.pitch:.4g} {summary.unit}, "
        f"from {summary.low:.4g} to {summary.high:.4g} {summary.unit}, in {summary.out}"
    )
    if summary.unit == "px":
        yield "note: the stack does not know its scale; mm_per_px in a TOML light file gives it in mm"
