"""What `simulate` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent

if TYPE_CHECKING:
    from impasto.capture.simulate import Simulation


def simulation_lines(summary: Simulation) -> Iterator[str]:
    """Yield what `simulate` made."""
    width, height = summary.size
    yield f"{summary.painting}: {count(summary.photographs, 'photograph')} of {width} x {height} px"
    if summary.brackets:
        yield f"{count(summary.brackets, 'shorter exposure')} of each, in brackets/"
    if summary.clipped_share == summary.clipped_share:
        yield f"clipped: {percent(summary.clipped_share)} of the samples"
        yield f"in cast shadow: {percent(summary.shadowed_share)} of the pixels, over all lights"
    yield f"{summary.folder} is ready, with the truth in {summary.folder / 'truth'}"
