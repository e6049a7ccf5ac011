"""The errors light by light, on the photographs that were fitted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from impasto.arm import find_arm
from impasto.evaluate.curve_plot import MODEL_COLOURS, MODEL_MARKERS
from impasto.evaluate.per_light import light_errors
from impasto.geometry import Array, zenith_azimuth
from impasto.output import written_whole
from impasto.page import Picture, Section
from impasto.report.subject import Subject, drawn


def section(subject: Subject) -> Section:
    """Return the errors of every model under every light."""
    lights = subject.stack.lights
    errors = {
        model: light_errors(subject.sample.pixels(model), subject.stack, subject.sample.radiance)
        for model in subject.models
    }
    zenith, azimuth = np.degrees(zenith_azimuth(lights.direction))
    arm = find_arm(lights.direction)
    if arm.planar:
        along = arm.into(lights.direction)
        angle, name = np.degrees(np.arctan2(along[:, 0], along[:, 2])), "angle of the light on the arm"
    else:
        angle, name = zenith, "zenith angle of the light"
    page = Section("Errors by light")
    page.text(
        f"RMS error of relative radiance over its mean, under each light, from {subject.sampled}. Lights "
        "that stand out may have been measured wrongly."
    )
    picture = drawn(_draw, angle, name, errors)
    alt = f"Plot of the RMS error over the mean against the {name}; the table below has the same figures."
    page.pictures([Picture(picture, f"RMS / mean against the {name}", alt=alt)], columns=1)
    rows = [
        (
            lights.names[light],
            f"{zenith[light]:.1f}°",
            f"{azimuth[light]:.0f}°",
            *("no sample" if np.isnan(each[light]) else f"{each[light]:.4f}" for each in errors.values()),
        )
        for light in np.argsort(angle, kind="stable")
    ]
    header = ("light", "zenith", "azimuth", *errors)
    page.table(header, rows, caption="RMS / mean under each light, on the photographs that were fitted")
    return page


def _draw(path: Path, angle_deg: Array, name: str, errors: Mapping[str, Array]) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.2), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for index, (model, values) in enumerate(errors.items()):
        look: dict[str, Any] = {
            "color": MODEL_COLOURS[index % len(MODEL_COLOURS)],
            "marker": MODEL_MARKERS[index % len(MODEL_MARKERS)],
        }
        axes.plot(angle_deg, values, linestyle="none", markerfacecolor="none", label=model, **look)
    axes.set_ylim(bottom=0)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_xlabel(f"{name}, degrees")
    axes.set_ylabel("RMS error / mean radiance")
    figure.legend(loc="outside right upper", edgecolor="none", fontsize=9)
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
