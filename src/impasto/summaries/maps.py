"""What `maps` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent

if TYPE_CHECKING:
    from impasto.maps import MapsSummary


def maps_lines(summary: MapsSummary) -> Iterator[str]:
    """Yield what `maps` wrote."""
    yield f"{count(len(summary.maps), 'map')} of {summary.model} in {summary.out}"
    yield "each as float EXR, 16-bit TIFF and a picture with its legend; maps.json says what the codes mean"
    total = max(sum(summary.status.values()), 1)
    yield from (f"    {meaning}: {percent(count / total)}" for meaning, count in summary.status.items())
