"""Plot a camera's response, its residuals and its noise."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from impasto.calibrate.response import Array, Response
from impasto.output import written_whole

_COLOURS = ("#d55e00", "#009e73", "#0072b2")


def draw_response(
    path: Path,
    response: Response,
    code: Array,
    radiance: Array,
    residual: Array,
    variance: Array,
    noise: Mapping[str, float],
) -> None:
    """Draw the function of each channel through its patches, the residuals, and noise against level.

    Parameters
    ----------
    path : Path
        PNG file to write.
    response : Response
    code, radiance, residual, variance : ndarray of shape (P, C)
        Of the patches; residuals relative, variance in codes.
    noise : mapping of str to float
        The noise model, in relative radiance.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.5), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplot_mosaic([["curve", "noise"], ["residual", "noise"]], height_ratios=(2.2, 1))
    channels = code.shape[1]
    colours = _COLOURS if channels == 3 else ("#222222",)
    names = ("R", "G", "B") if channels == 3 else ("Y",)
    for channel in range(channels):
        colour, name = colours[channel], names[channel]
        nodes = response.code[channel] + response.black[channel]
        axes["curve"].loglog(nodes, response.radiance[channel], color=colour, linewidth=1, label=name)
        axes["curve"].loglog(code[:, channel], radiance[:, channel], "o", color=colour, markersize=4)
        axes["residual"].semilogx(
            code[:, channel], 100 * residual[:, channel], "o-", color=colour, markersize=3
        )
        step = 0.5 + np.sqrt(variance[:, channel])
        around = np.repeat(code, 2, axis=0)
        around[::2, channel] += step
        around[1::2, channel] -= step
        levels = response(np.maximum(around, 0))[:, channel]
        sd = np.sqrt(variance[:, channel]) * (levels[::2] - levels[1::2]) / (2 * step)
        axes["noise"].loglog(radiance[:, channel], sd, "o", color=colour, markersize=4)
    level = np.geomspace(radiance.min(), 1, 200)
    model = np.sqrt(noise["read"] ** 2 + noise["photon"] * level + (noise["relative"] * level) ** 2)
    axes["noise"].loglog(level, model, color="#222222", linewidth=1, label="read² + photon·Y + (relative·Y)²")
    lowest = float(response.measured[:, 0].min())
    axes["curve"].set(ylabel="relative radiance", title="response", xlim=(0.3 * lowest, None))
    axes["curve"].set_ylim(0.3 * radiance.min(), 2)
    axes["residual"].set(xlabel="code", ylabel="residual, %", xlim=(0.3 * lowest, None))
    axes["noise"].set(xlabel="relative radiance", ylabel="standard deviation", title="noise")
    for one in axes.values():
        one.grid(color="#dddddd", linewidth=0.6)
    axes["curve"].legend()
    axes["noise"].legend()
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
