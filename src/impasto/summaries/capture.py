"""What the subcommands of `capture` say."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent, seconds

if TYPE_CHECKING:
    from impasto.stand.check import CheckedCapture
    from impasto.stand.checks.coverage import Coverage
    from impasto.stand.plan import CapturePlanSummary
    from impasto.stand.run import RunSummary

# A painting's normals do not tilt so far that highlights as broad as this fall between its lamps.
_NO_PAINTING_DEG = 90.0


def plan_lines(summary: CapturePlanSummary) -> Iterator[str]:
    """Yield what `stand.plan` planned."""
    yield f"{count(summary.places, 'place')} of the lamp, {count(summary.exposures, 'exposure')} each"
    yield from (f"{number}. {what}" for number, what in enumerate(summary.order, start=1))
    yield (
        f"{count(summary.photographs, 'photograph')}, about {_hours(summary.hours)} and "
        f"{summary.gigabytes:.1f} GB"
    )
    yield from (f"note: {note}" for note in summary.notes)
    yield f"{summary.file} is written"


def run_lines(summary: RunSummary) -> Iterator[str]:
    """Yield what `stand.run` did."""
    there = f", {summary.before} were there before" if summary.before else ""
    again = f", {summary.again} of them set aside" if summary.again else ""
    yield f"{count(summary.taken, 'photograph')} taken{again}{there}"
    for problem in summary.kept_findings:
        yield f"kept as it is: {problem.where}: {problem.what}"
    yield from (f"note: {note}" for note in summary.notes)
    yield from _coverage_lines(summary.coverage)
    if summary.complete:
        yield f"{summary.folder} is complete: {summary.photographs} photographs ({seconds(summary.seconds)})"
    else:
        yield f"{summary.folder} is not complete; run the same command again to go on"


def check_table(found: CheckedCapture) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of the table of photographs."""
    rows = [
        [name, percent(float(clipped)), *(_pixels(float(value)) for value in shift)]
        for name, clipped, shift in zip(found.names, found.clipped, found.shift_px, strict=True)
    ]
    return ["photograph", "clipped", "columns off", "rows off"], rows


def check_lines(found: CheckedCapture) -> Iterator[str]:
    """Yield what `stand.check` found."""
    for finding in found.findings:
        yield f"{finding.check}: {finding}"
    yield from _coverage_lines(found.coverage)
    many = count(len(found.findings), "finding") if found.findings else "nothing is wrong"
    yield f"{count(found.photographs, 'photograph')} checked: {many}"


def _coverage_lines(coverage: Coverage | None) -> Iterator[str]:
    if coverage is None:
        return
    narrow, gap = coverage.narrowest_deg, coverage.gap_deg
    if gap > _NO_PAINTING_DEG:
        yield "highlights, by a coarse fit: much of the surface faces no lamp's mirror direction"
        return
    verdict = "are covered" if coverage.enough else "may fall between the lamps"
    yield (
        f"highlights, by a coarse fit: the narrowest are {narrow:.1f}° wide, those below {gap:.1f}° meet no "
        f"lamp: they {verdict}"
    )
    yield from (f"  {sentence}" for sentence in coverage.sentences)


def _hours(hours: float) -> str:
    return f"{hours:.1f} hours" if hours >= 1 else f"{max(1, round(60 * hours))} minutes"


def _pixels(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:+.2f}"
