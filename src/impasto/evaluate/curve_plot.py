"""Draw a gonio curve: measurement, models, their parts and their errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impasto.evaluate.curves import SHOULDER, Curve
from impasto.output import written_whole
from impasto.pixels import luminance
from impasto.store import Fit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette [OkabeIto2008]_, and a marker of its own for each model.
MODEL_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
MODEL_MARKERS = "osD^vP"
_INK = "#22201c"
_PEAK, _SHOULDER = "#e8e4da", "#f4f1ea"
# A highlight this much higher than the middle of the curve is shown on a logarithmic axis.
_HIGH = 20.0


def draw_curve(path: Path, curve: Curve, fits: Mapping[str, Fit]) -> None:
    """Draw a curve in luminance, with the error of each model below.

    Parameters
    ----------
    path : Path
        PNG file to write.
    curve : Curve
    fits : mapping of str to Fit
        The models' fits: the paper's procedure has a threshold to show.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, 6.6), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    order = np.argsort(curve.angle_deg, kind="stable")
    angle = curve.angle_deg[order]
    measured = luminance(curve.measured)[order]
    on_arm = curve.angle_name.endswith("arm")
    for axes in (upper, lower):
        _shade(axes, curve, order, on_arm)
        axes.grid(color="#dddddd", linewidth=0.6)
        axes.tick_params(colors=_INK)
    upper.plot(angle, measured, "k.", markersize=9, label="measured", zorder=5)
    clipped = curve.clipped[order] > 0
    if clipped.any():
        shown = np.where(np.isfinite(measured), measured, np.nanmax(measured))
        upper.plot(
            angle[clipped],
            shown[clipped],
            "k^",
            markerfacecolor="none",
            markersize=11,
            label="clipped: brighter",
        )
    style = "-" if on_arm else "none"
    for index, (name, model) in enumerate(curve.models.items()):
        look = {"color": MODEL_COLOURS[index % len(MODEL_COLOURS)]}
        symbol = MODEL_MARKERS[index % len(MODEL_MARKERS)]
        marker = {} if on_arm else {"marker": symbol, "markerfacecolor": "none"}
        diffuse, specular = luminance(model.diffuse)[order], luminance(model.specular)[order]
        at, parts = angle, (diffuse, specular)
        if model.swept is not None:  # the model between the lights too, where a lobe may lie
            at = model.swept.angle_deg
            parts = (luminance(model.swept.diffuse), luminance(model.swept.specular))
        upper.plot(at, sum(parts), linestyle=style, **look, **marker, linewidth=1.6, label=name)
        if on_arm:
            upper.plot(at, parts[0], "--", **look, linewidth=1.0, label=f"{name}: diffuse")
            upper.plot(at, parts[1], ":", **look, linewidth=1.2, label=f"{name}: specular")
        marker = marker or {"marker": "."}
        lower.plot(angle, diffuse + specular - measured, linestyle=style, **look, **marker)
    middle = float(np.nanmedian(measured)) if np.isfinite(measured).any() else 0.0
    if middle > 0 and np.nanmax(measured) > _HIGH * middle:
        # Where the linear part ends at a decade, no labels stand within it.
        decade = 10 ** np.floor(np.log10(middle))
        upper.set_yscale("symlog", linthresh=decade)
        lower.set_yscale("symlog", linthresh=decade)
    for side, degrees in enumerate(_thresholds(fits, curve) if on_arm else ()):
        label = "threshold of the diffuse lights" if side == 0 else None
        upper.axvline(degrees, color=_INK, linewidth=0.8, linestyle=(0, (4, 3)), label=label)
    upper.set_ylabel("relative radiance per unit of irradiance")
    lower.set_ylabel("model − measured")
    lower.set_xlabel(f"{curve.angle_name}, degrees")
    lower.axhline(0.0, color=_INK, linewidth=0.8)
    figure.suptitle(f"{curve.name} · luminance, {_of(curve)}", x=0.02, ha="left", color=_INK)
    # Beside the curves, where it hides none of them.
    figure.legend(*upper.get_legend_handles_labels(), edgecolor="none", fontsize=9, loc="outside right upper")
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")


def _of(curve: Curve) -> str:
    if curve.pixels != 1:
        return f"mean of {curve.pixels:,} pixels"
    return "column {}, row {}".format(*curve.pixel) if curve.pixel else "one pixel"


def _shade(axes: Axes, curve: Curve, order: np.ndarray, on_arm: bool) -> None:
    """Shade peak and shoulder."""
    if not np.isfinite(curve.half_width_deg):
        return
    bands = ((SHOULDER[1], _SHOULDER, "shoulder"), (SHOULDER[0], _PEAK, "peak"))
    if on_arm:
        centre = curve.angle_deg[np.argmin(curve.off_mirror_deg)]
        axes.set_xlim(curve.angle_deg[order[0]] - 2, curve.angle_deg[order[-1]] + 2)
    else:
        centre = 0.0
        axes.set_xlim(0, curve.angle_deg.max() + 2)
    for widths, colour, label in bands:
        axes.axvspan(
            centre - widths * curve.half_width_deg,
            centre + widths * curve.half_width_deg,
            color=colour,
            zorder=0,
            linewidth=0,
            label=label,
        )


def _thresholds(fits: Mapping[str, Fit], curve: Curve) -> list[float]:
    """Return the arm angles at which the paper's procedure parts diffuse lights from the others."""
    samples = [fit.attributes.get("sample") for fit in fits.values()]
    width = next((sample["threshold_deg"] for sample in samples if sample), None)
    if width is None or not np.isfinite(curve.measured).any():
        return []
    peak = float(curve.angle_deg[np.nanargmax(luminance(curve.measured))])
    return [peak - width, peak + width]
