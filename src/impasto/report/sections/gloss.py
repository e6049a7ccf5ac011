"""What a glossmeter would read."""

from __future__ import annotations

from impasto.evaluate.gloss import sample_gloss
from impasto.models import parse_model
from impasto.page import Section
from impasto.report.subject import Subject
from impasto.summaries.gloss import gloss_lines, gloss_table


def section(subject: Subject) -> Section | None:
    """Return the readings by each model with a lobe, or None without one."""
    models = [model for model in subject.models if parse_model(model).lobes]
    if not models:
        return None
    page = Section("Gloss")
    page.text(
        "What a glossmeter would read, predicted from the fits, for the painting as a whole with its relief. "
        "The models differ most where the photographs say least."
    )
    rows, lines = [], []
    for model in models:
        summary = sample_gloss(subject.sample.pixels(model), subject.stack)
        header, found = gloss_table(summary)
        rows += [(model, *row[1:]) for row in found]
        lines += [line for line in gloss_lines(summary) if line not in lines]
    unit = "gloss units" if subject.stack.absolute else "relative gloss, comparable within this painting"
    page.table(("model", *header[1:]), rows, caption=f"{unit.capitalize()}, from {subject.sampled}")
    page.items(lines)
    return page
