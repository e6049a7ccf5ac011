"""Numbers as words, for the summaries of all stages."""

from __future__ import annotations

from collections.abc import Sequence

Row = Sequence[str]


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


def count(number: int, what: str) -> str:
    """Return a number of things, in the plural where it is due."""
    return f"{number:,} {what}" + ("" if number == 1 else "s")
