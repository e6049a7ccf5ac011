"""Draw where lights stand: on an arm seen from its side, or in a dome seen from above."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impasto.angles.placement import arm_angles_deg
from impasto.geometry import Lights, zenith_azimuth
from impasto.output import written_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CHOSEN, _OTHER, _INK = "#e69f00", "#bbbbbb", "#22201c"


def draw_plan(path: Path, lights: Lights, title: str) -> None:
    """Draw lights to be photographed.

    Parameters
    ----------
    path : Path
        PNG file to write.
    lights : Lights
    title : str

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    planar = arm_angles_deg(lights.direction) is not None
    figure = Figure(
        figsize=(8.5, 5.2) if planar else (7.5, 7.5), dpi=110, facecolor="white", layout="constrained"
    )
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw_lights(axes, lights, [True] * len(lights))
    axes.set_title(title, loc="left", fontsize=11, color=_INK)
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")


def draw_lights(axes: Axes, lights: Lights, chosen: Sequence[bool]) -> None:
    """Draw lights, those that are chosen with their angle.

    Parameters
    ----------
    axes : Axes
    lights : Lights
    chosen : sequence of bool
        One per light.
    """
    angle = arm_angles_deg(lights.direction)
    if angle is None:
        _draw_dome(axes, lights, np.asarray(chosen, bool))
    else:
        _draw_arm(axes, angle, np.asarray(chosen, bool))
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_arm(axes: Axes, angle_deg: np.ndarray, chosen: np.ndarray) -> None:
    sweep = np.radians(np.linspace(-90, 90, 181))
    axes.plot(np.sin(sweep), np.cos(sweep), color=_OTHER, linewidth=1)
    axes.plot([-0.35, 0.35], [0, 0], color=_INK, linewidth=4, solid_capstyle="butt")
    axes.text(0, -0.04, "painting", ha="center", va="top", fontsize=9, color=_INK)
    axes.plot([0, 0], [0, 0.9], color=_OTHER, linewidth=0.8, linestyle=":")
    x, y = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    axes.plot(x[~chosen], y[~chosen], "o", color="white", markeredgecolor=_OTHER, markersize=5)
    for one in np.flatnonzero(chosen):
        axes.plot([0, x[one]], [0, y[one]], color=_CHOSEN, linewidth=0.6, alpha=0.6, zorder=1)
    axes.plot(x[chosen], y[chosen], "o", color=_CHOSEN, markeredgecolor=_INK, markersize=8)
    # Angles of neighbours are written at two distances, or they would cover each other.
    for rank, one in enumerate(np.flatnonzero(chosen)[np.argsort(angle_deg[chosen])]):
        away = 1.08 if rank % 2 == 0 else 1.17
        axes.text(
            away * x[one], away * y[one], f"{angle_deg[one]:.0f}°".replace("-", "−"),
            ha="center", va="center", fontsize=8, color=_INK,
        )  # fmt: skip
    axes.set_xlim(-1.25, 1.25)
    axes.set_ylim(-0.15, 1.25)


def _draw_dome(axes: Axes, lights: Lights, chosen: np.ndarray) -> None:
    zenith, azimuth = zenith_azimuth(lights.direction)
    radius = np.degrees(zenith) / 90
    around = np.linspace(0, 2 * np.pi, 181)
    for ring in (30, 60, 90):
        axes.plot(ring / 90 * np.cos(around), ring / 90 * np.sin(around), color=_OTHER, linewidth=0.8)
        axes.text(0, -ring / 90 - 0.02, f"{ring}°", ha="center", va="top", fontsize=8, color="#777777")
    axes.plot(0, 0, "+", color=_INK, markersize=8)
    x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
    axes.plot(x[~chosen], y[~chosen], "o", color="white", markeredgecolor=_OTHER, markersize=5)
    axes.plot(x[chosen], y[chosen], "o", color=_CHOSEN, markeredgecolor=_INK, markersize=8)
    for number in np.flatnonzero(chosen):
        # light-007 as 7: there is little room.
        short = re.sub(r"^.*?0*(\d+)$", r"\1", lights.names[number])
        axes.annotate(
            short, (x[number], y[number]), xytext=(0, 7), textcoords="offset points",
            ha="center", fontsize=7, color=_INK,
        )  # fmt: skip
    axes.text(1.04, 0, "right", va="center", fontsize=8, color="#777777")
    axes.text(0, 1.04, "top", ha="center", fontsize=8, color="#777777")
    axes.set_xlim(-1.2, 1.2)
    axes.set_ylim(-1.15, 1.15)
