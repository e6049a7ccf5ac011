"""Draw interval scales with their limits, the proportions behind them, and measured differences."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from impasto.output import write_text, written_whole
from impasto.psychophysics.scaling.groups import UNITS, ScaledGroup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from impasto.psychophysics.scaling.physical import PhysicalError
    from impasto.psychophysics.scaling.scale import ScaleSummary

# Okabe and Ito's palette [OkabeIto2008]_, and a marker of its own for each condition.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#22201c")
_MARKERS = "osD^vP*"
_INK = "#22201c"
# In inches; the line that says who is simulated needs as much.
_NARROWEST = 5.4
# Distance of two conditions of a group, and the share of the group's width that all of them may take.
_STEP, _SPREAD = 0.14, 0.6


def write_figures(folder: Path, summary: ScaleSummary) -> tuple[Path, ...]:
    """Write all figures and the table.

    Parameters
    ----------
    folder : Path
        Exists.
    summary : ScaleSummary

    Returns
    -------
    tuple of Path

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    files = [folder / "scale.csv"]
    write_text(files[0], _csv(summary))
    pooled = [group for group in summary.groups if group.by in ("pooled", "pool")]
    for by in ("angle", "sample"):
        single = [group for group in summary.groups if group.by == by]
        if single:
            files.append(folder / f"scale-by-{by}.png")
            _save(files[-1], _scales(single, pooled, summary), summary)
    if len(files) == 1:
        files.append(folder / "scale.png")
        _save(files[-1], _scales([], pooled, summary), summary)
    for group in pooled:
        stem = re.sub(r"[^0-9A-Za-z]+", "-", group.name).strip("-") or "pool"
        files.append(folder / f"proportions-{stem}.png")
        _save(files[-1], _proportions(group), summary)
    if summary.physical:
        files.append(folder / "physical-errors.png")
        _save(files[-1], _physical(summary.physical, summary), summary)
    return tuple(files)


def _figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(path: Path, figure: Figure, summary: ScaleSummary) -> None:
    if summary.simulated:
        # On every figure: figures travel without the text around them.
        observers = len({report.observer for report in summary.observers if report.answers})
        whose = "all observers" if summary.simulated == observers else f"{summary.simulated} observers"
        figure.supxlabel(f"SIMULATED: {whose} are a program, not people", color="#b00020", weight="bold")
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")


def _look(summary_conditions: Sequence[str], condition: str) -> dict[str, Any]:
    number = summary_conditions.index(condition)
    return {"color": _COLOURS[number % len(_COLOURS)], "marker": _MARKERS[number % len(_MARKERS)]}


def _scales(single: Sequence[ScaledGroup], pooled: Sequence[ScaledGroup], summary: ScaleSummary) -> Figure:
    groups = [*single, *pooled]
    conditions = pooled[0].conditions
    figure = _figure(max(_NARROWEST, 1.5 + 0.35 * len(groups) * max(2, len(conditions))), 4.8)
    axes = figure.subplots()
    axes.axhline(0, color="#bbbbbb", linewidth=0.8)
    step = min(_STEP, _SPREAD / len(conditions))
    offsets = step * (np.arange(len(conditions)) - (len(conditions) - 1) / 2)
    bounds = [0.0]
    for group in groups:
        bounds += [bound for bound in (*group.scale, *group.low, *group.high) if np.isfinite(bound)]
    bottom, top = min(bounds), max(bounds)
    margin = 0.12 * max(top - bottom, 0.5)
    for place, group in enumerate(groups):
        for condition, value, low, high in zip(
            group.conditions, group.scale, group.low, group.high, strict=True
        ):
            if np.isfinite(value):
                at = place + offsets[conditions.index(condition)]
                _bar(
                    axes, at, value, low, high, (bottom - margin, top + margin), _look(conditions, condition)
                )
    for condition in conditions:
        axes.plot([], [], linestyle="none", label=condition, markersize=6, **_look(conditions, condition))
    if single and pooled:
        axes.axvline(len(single) - 0.5, color="#888888", linewidth=0.8, linestyle=(0, (4, 3)))
    labels = [group.name.partition(" ")[2] if group in single else group.name for group in groups]
    axes.set_xticks(range(len(groups)), labels)
    axes.set_xlim(-0.6, len(groups) - 0.4)
    axes.set_ylim(bottom - margin, top + margin)
    if single:
        axes.set_xlabel(f"{single[0].by}, then pooled")
    axes.set_ylabel("closer to the reference →")
    axes.grid(axis="y", color="#eeeeee", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=_INK)
    how = ", ".join(sorted({group.limits for group in groups}))
    axes.set_title(
        f"{UNITS[summary.unit]}; mean 0\n{100 * summary.options.level:g} % limits ({how})",
        loc="left",
        fontsize=9,
        color=_INK,
    )
    figure.legend(loc="outside upper left", ncols=min(len(conditions), 4), frameon=False, fontsize=9)
    return figure


def _bar(
    axes: Axes,
    at: float,
    value: float,
    low: float,
    high: float,
    frame: tuple[float, float],
    look: dict[str, Any],
) -> None:
    """Draw a value with its limits; one that is infinite, or missing, ends in an arrow at the frame."""
    for bound, edge, arrow in ((low, frame[0], "v"), (high, frame[1], "^")):
        if np.isnan(bound):
            continue
        end = bound if np.isfinite(bound) else edge
        axes.plot([at, at], [value, end], color=look["color"], linewidth=1.3, zorder=2)
        mark = "_" if np.isfinite(bound) else arrow
        axes.plot([at], [end], marker=mark, color=look["color"], markersize=7, clip_on=False, zorder=2)
    axes.plot([at], [value], markersize=6, zorder=3, markeredgecolor="white", markeredgewidth=0.5, **look)


def _proportions(group: ScaledGroup) -> Figure:
    size = len(group.conditions)
    trials = group.counts + group.counts.T
    shown = np.divide(group.counts, trials, out=np.full_like(trials, np.nan), where=trials > 0)
    figure = _figure(max(_NARROWEST, 2.6 + 0.95 * size), 1.9 + 0.8 * size)
    axes = figure.subplots()
    image = axes.imshow(shown, vmin=-0.2, vmax=1.2, cmap="PuOr", aspect="auto")
    for (row, column), share in np.ndenumerate(shown):
        if np.isfinite(share):
            text = f"{share:.2f}\n{group.counts[row, column]:g} of {trials[row, column]:g}"
            colour = "white" if abs(share - 0.5) > 0.4 else _INK
            axes.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(size), group.conditions, rotation=30, ha="right")
    axes.set_yticks(range(size), group.conditions)
    axes.set_ylabel("chosen")
    axes.set_xlabel("over")
    axes.tick_params(colors=_INK, length=0)
    # The ends of the colours are too dark for text.
    figure.colorbar(image, ax=axes, label="proportion").ax.set_ylim(0, 1)
    axes.set_title(
        f"{group.name}: {group.answers} answers, {group.observers} observers", fontsize=10, loc="left"
    )
    return figure


def _physical(errors: Sequence[PhysicalError], summary: ScaleSummary) -> Figure:
    conditions = summary.groups[0].conditions
    figure = _figure(max(_NARROWEST, 4.2 * len(errors) + 0.6), 4.6)
    for axes, error in zip(figure.subplots(1, len(errors), squeeze=False)[0], errors, strict=True):
        # The scale knows only differences within a group, and so must the errors beside it.
        for _, condition, measured, value, low, high in _centred(error):
            look = _look(conditions, condition)
            finite = [bound if np.isfinite(bound) else value for bound in (low, high)]
            axes.plot([measured, measured], finite, color=look["color"], linewidth=0.8, alpha=0.5)
            axes.plot([measured], [value], markersize=5, **look)
        axes.axhline(0, color="#bbbbbb", linewidth=0.8)
        axes.axvline(0, color="#bbbbbb", linewidth=0.8)
        axes.set_xlabel(f"{error.name}, less the mean of the group")
        axes.set_ylabel(f"scale value, {summary.unit}")
        axes.grid(color="#eeeeee", linewidth=0.6)
        axes.set_axisbelow(True)
        correlation = f"{error.correlation:.2f}".replace("-", "−")
        axes.set_title(
            f"the smaller {error.name} was chosen in {100 * error.predicted:.0f} %\n"
            f"({100 * error.low:.0f} – {100 * error.high:.0f} %; chance is 50 %); r = {correlation}",
            fontsize=9,
            loc="left",
        )
    for condition in conditions:
        axes.plot([], [], linestyle="none", label=condition, markersize=6, **_look(conditions, condition))
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="outside upper left",
        ncols=min(len(conditions), 4),
        frameon=False,
    )
    return figure


def _centred(error: PhysicalError) -> list[tuple[str, str, float, float, float, float]]:
    means: dict[str, list[float]] = {}
    for name, _, measured, *_ in error.points:
        means.setdefault(name, []).append(measured)
    return [
        (name, condition, measured - float(np.mean(means[name])), value, low, high)
        for name, condition, measured, value, low, high in error.points
    ]


def _csv(summary: ScaleSummary) -> str:
    rows = [
        {
            "group": group.name,
            "by": group.by,
            "condition": condition,
            "scale": f"{group.scale[number]:.6g}",
            "low": f"{group.low[number]:.6g}",
            "high": f"{group.high[number]:.6g}",
            "standard_error": f"{group.standard_error[number]:.6g}",
            "unit": summary.unit,
            "limits": group.limits,
            "level": summary.options.level,
            "status": group.status,
            "answers": group.answers,
            "observers": group.observers,
            "simulated": "yes" if summary.simulated else "no",
        }
        for group in summary.groups
        for number, condition in enumerate(group.conditions)
    ]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
