"""What `observers` says when it is done."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count

if TYPE_CHECKING:
    from impasto.psychophysics.planning import ObserversSummary


def observers_lines(summary: ObserversSummary) -> Iterator[str]:
    """Yield the number of observers, whether to stop, and the pairs to ask next."""
    if (plan := summary.plan) is not None:
        error = f" ± {plan.power_error:.3f}" if plan.power_error else ""
        yield f"{count(plan.observers, 'observer')}: power {plan.power:.3f}{error}"
        for observers, power in plan.tried:
            yield f"  {observers:4d} observers: {power:.3f}"
    if summary.simulated:
        yield f"SIMULATED: {count(summary.simulated, 'observer')} of these are a program, not people"
    if (stopping := summary.stopping) is not None:
        yield f"{'stop' if stopping.stop else 'go on'}: {stopping.why}"
        if not math.isfinite(stopping.widest):
            yield "  some difference is not known at all yet"
        yield "next observer:"
        for first, second in summary.next_pairs:
            yield f"  {first} – {second}"
