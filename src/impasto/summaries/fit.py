"""What `fit` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent, seconds

if TYPE_CHECKING:
    from impasto.fit import FitSummary, ModelFit


def fit_lines(summary: FitSummary) -> Iterator[str]:
    """Yield how the pixels of each model ended; `fit` has said its notes before."""
    yield f"{summary.width} x {summary.height} px under {count(summary.photographs, 'light')}"
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
