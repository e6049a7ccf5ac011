"""Whose the error on held-out photographs is: the model's, the lights', shadows', noise's, their number's."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from impasto.output import written_whole
from impasto.page import Picture, Section
from impasto.report.sections.held_out import is_current
from impasto.report.subject import Subject, drawn
from impasto.store import read_evaluation

_SOURCES = {
    "model": ("the model", "#0072b2", "The paint reflects otherwise than the model can describe."),
    "lights": ("the lights", "#e69f00", "Lights were stronger, weaker or elsewhere than the fit has them."),
    "shadows": ("cast shadows", "#333333", "Relief stands between the light and the paint."),
    "noise": ("noise", "#999999", "The camera's noise, which no model can or should describe."),
    "sampling": (
        "too few photographs",
        "#56b4e9",
        "Only photographs that were kept out show what is there, such as a highlight.",
    ),
}


def section(subject: Subject) -> Section | None:
    """Return the shares that `evaluate` kept, or None where it kept none that are current."""
    shares = {}
    for model in subject.models:
        found = read_evaluation(subject.store, model)
        kept = found.attributes.get("shares") if found and is_current(found, subject, model) else None
        if kept and "sampling" in kept:  # else it is of the fitted photographs, from an earlier version
            shares[model] = kept
    if not shares:
        return None
    page = Section("Where the error comes from")
    counts = sorted({each["pixels"] for each in shares.values()})
    page.text(
        "The squared error on the photographs kept out of the fit, the same as above, of each model without "
        "a residual term, divided by its source. Sources are taken away in turn, and the pixels are fitted "
        "again: first each light is given the strength and direction that suit the photographs best, then "
        "samples in cast shadows are left out, then the photographs kept out are fitted too, then the noise "
        "that is expected is subtracted. What is left is the model's. From "
        f"{' or '.join(f'{n:,}' for n in counts)} pixels."
    )
    words = "; ".join(f"{model}: {_largest(each)}" for model, each in shares.items())
    alt = f"Bars of the five shares for each model; the table below has the figures. Largest: {words}."
    page.pictures([Picture(drawn(_draw, shares), "Share of the squared error", alt=alt)], columns=1)
    page.table(
        ("source", *shares, "what it means"),
        [
            (label, *(f"{100 * each[name]:.1f}\u00a0%" for each in shares.values()), meaning)
            for name, (label, _, meaning) in _SOURCES.items()
        ],
        caption="Share of the squared error on the photographs kept out, on a square-root scale",
        words=True,
    )
    return page


def _largest(shares: Mapping[str, float]) -> str:
    name = max(_SOURCES, key=lambda source: shares[source])
    return f"{_SOURCES[name][0]}, {100 * shares[name]:.0f} %"


def _draw(path: Path, shares: Mapping[str, Mapping[str, float]]) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 1.2 + 0.5 * len(shares)), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    rows = list(shares)[::-1]
    begin = dict.fromkeys(rows, 0.0)
    for name, (label, colour, _) in _SOURCES.items():
        widths = [100 * shares[row][name] for row in rows]
        left = [begin[row] for row in rows]
        axes.barh(rows, widths, left=left, color=colour, edgecolor="white", height=0.6, label=label)
        begin = {row: start + width for row, start, width in zip(rows, left, widths, strict=True)}
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the squared error, %")
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    figure.legend(loc="outside upper center", ncols=len(_SOURCES), frameon=False, fontsize=9)
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
