"""What `stack` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent, seconds

if TYPE_CHECKING:
    from impasto.stack import StackSummary


def stack_lines(summary: StackSummary) -> Iterator[str]:
    """Yield what `stack` read, assumed and wrote."""
    yield (
        f"{count(summary.photographs, 'photograph')} of {summary.width} x {summary.height} px, "
        f"{count(summary.channels, 'channel')}, decoded as {summary.transfer}"
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
