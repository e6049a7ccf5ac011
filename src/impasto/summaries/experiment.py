"""What the subcommands of `experiment` say when they are done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, seconds

if TYPE_CHECKING:
    from impasto.psychophysics.experiment.administer import ExportSummary
    from impasto.psychophysics.experiment.create import CreateSummary
    from impasto.psychophysics.experiment.simulate import SimulateSummary


def create_lines(summary: CreateSummary) -> Iterator[str]:
    """Yield what an experiment consists of, and what to know before observers are invited."""
    width, height = summary.size_px
    yield (
        f"{count(len(summary.samples), 'sample')}, {count(len(summary.conditions), 'condition')} "
        f"({', '.join(summary.conditions)}), {count(len(summary.angles), 'angle')}"
    )
    highlight = ", ".join(summary.with_highlight) or "none"
    yield f"angles: {', '.join(summary.angles)}; with a highlight: {highlight}"
    yield (
        f"{count(summary.pairs, 'comparison')} for each observer, {summary.trials} trials with practice, "
        "repeats and catch trials"
    )
    yield (
        f"{count(summary.stimuli, 'picture')} of up to {width} x {height} px, {summary.rendered} made now "
        f"({seconds(summary.seconds)})"
    )
    for note in summary.notes:
        yield f"note: {note}"


def simulate_lines(summary: SimulateSummary) -> Iterator[str]:
    """Yield who answered, and by what."""
    names = f"{summary.observers[0]} to {summary.observers[-1]}"
    yield f"SIMULATED: {names}, a program that goes by {summary.by}, gave {count(summary.answers, 'answer')}"


def export_lines(summary: ExportSummary) -> Iterator[str]:
    """Yield what was written."""
    answers, observers = count(summary.answers, "answer"), count(summary.observers, "observer")
    simulated = f", {summary.simulated} of them SIMULATED," if summary.simulated else ""
    yield f"{answers} of {observers}{simulated} in {summary.file}"
