"""Draw the error against the number of photographs, and where the recommended lights stand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impasto.angles.picture import draw_lights
from impasto.angles.recommendation import Tolerance
from impasto.angles.refit import Errors
from impasto.angles.study import BEST, CHOSEN
from impasto.geometry import Lights
from impasto.output import written_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from impasto.angles import ModelStudy

# Okabe and Ito's palette [OkabeIto2008]_.
_LOOKS = {
    CHOSEN: ("#0072b2", "o", "optimal"),
    "even": ("#d55e00", "s", "evenly spaced"),
    "informed": ("#009e73", "D", "placed by the highlights"),
    BEST: ("#cc79a7", "x", "best of all sets"),
}
_RANDOM, _INK, _RED = "#999999", "#22201c", "#d0021b"
_MEASURES = {"rms": "RMS / mean radiance", "psnr": "PSNR, dB", "ciede2000": "CIEDE2000, 95th percentile"}


def draw_curve(
    folder: Path,
    study: ModelStudy,
    lights: Lights,
    candidates: Sequence[int],
    allowed: Tolerance,
    *,
    held_out: bool,
) -> Path:
    """Draw the error of every set [Chen2007]_, Fig. 12, with the recommended one as a red point.

    Parameters
    ----------
    folder : Path
        Where ``<model>.png`` is written.
    study : ModelStudy
    lights : Lights
        All of the stack.
    candidates : sequence of int
        Those that sets were chosen from.
    allowed : Tolerance
    held_out : bool
        Whether others judged.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.6), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    whole = study.regions[0]
    _draw_errors(left, study, allowed)
    by = "photographs that the choice never saw" if held_out else "all photographs"
    left.set_title(f"{study.model}: judged by {by}", loc="left", fontsize=11, color=_INK)
    best = whole.best
    names = set(best.photographs)
    among = lights.select(np.asarray(candidates))
    draw_lights(right, among, [name in names for name in among.names])
    right.set_title(f"the recommended {best.size} of {len(among)}", loc="left", fontsize=11, color=_INK)
    path = folder / f"{study.model}.png"
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
    return path


def _value(errors: Errors, measure: str) -> float:
    return {"rms": errors.rms, "psnr": errors.psnr_db, "ciede2000": errors.ciede2000}[measure]


def _draw_errors(axes: Axes, study: ModelStudy, allowed: Tolerance) -> None:
    measure, whole = allowed.measure, study.regions[0]
    every = [*study.points, *whole.recommended.values()]
    if measure == "rms":
        sizes = [each.size for each in study.random]
        axes.fill_between(
            sizes,
            [each.low for each in study.random],
            [each.high for each in study.random],
            color=_RANDOM,
            alpha=0.25,
            linewidth=0,
            label="random sets, 5 to 95 %",
        )
        axes.plot(sizes, [each.median for each in study.random], color=_RANDOM, label="their median")
    for strategy, (colour, marker, label) in _LOOKS.items():
        points = {point.size: point for point in every if point.strategy == strategy}
        if not points:
            continue
        rising = [points[size] for size in sorted(points)]
        sizes = [point.size for point in rising]
        values = [_value(point.errors, measure) for point in rising]
        axes.plot(sizes, values, marker=marker, markersize=5, color=colour, linewidth=1.6, label=label)
        if measure != "ciede2000" and strategy in (CHOSEN, "even"):
            expected = [point.expected for point in rising]
            axes.plot(sizes, expected, ":", color=colour, linewidth=1.2, label=f"{label}: expected")
    full = _value(whole.full, measure)
    if measure != "ciede2000":
        axes.axhline(full, color=_INK, linewidth=0.8, label="all photographs")
    limit = {"rms": full * (1 + allowed.limit / 100), "psnr": full - allowed.limit}.get(
        measure, allowed.limit
    )
    axes.axhline(limit, color=_INK, linewidth=0.8, linestyle=(0, (4, 3)), label=f"tolerance: {allowed}")
    best = whole.best
    axes.plot(
        best.size, _value(best.errors, measure), "o", color=_RED, markersize=9, zorder=6, label="recommended"
    )
    if measure == "rms":
        axes.set_yscale("log")
    axes.set_xlabel("number of photographs")
    axes.set_ylabel(_MEASURES[measure])
    axes.grid(color="#dddddd", linewidth=0.6, which="both" if measure == "rms" else "major")
    axes.legend(facecolor="white", framealpha=0.92, edgecolor="none", fontsize=8.5)
