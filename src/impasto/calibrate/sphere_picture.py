"""Draw the spheres and the lamps that were found in them, to be checked by eye."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.mirror import Reflection, Sphere
from impasto.output import written_whole

_LONGEST_PX = 1600


def thinned(image: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return as many rows and columns of an image as a picture shows."""
    step = -(-max(image.shape) // _LONGEST_PX)
    return image[::step, ::step]


def draw_spheres(
    path: Path,
    image: NDArray[np.floating],
    size: tuple[int, int],
    spheres: Sequence[Sphere],
    seen: Sequence[Sequence[Reflection | None]],
    names: Sequence[str],
    doubtful: Sequence[str],
) -> None:
    """Draw circles and lamps over the brightest of all photographs.

    Parameters
    ----------
    path : Path
        PNG file to write.
    image : ndarray of shape (rows, columns)
        Relative radiance, `thinned`.
    size : (int, int)
        Height and width of the photographs.
    spheres : sequence of Sphere
    seen : sequence, length L, of one Reflection or None per sphere
    names : sequence of str, length L
    doubtful : sequence of str
        Lights to mark.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle

    height, width = size
    figure = Figure(figsize=(9.0, 9.0 * height / width + 0.2), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    shown = np.sqrt(np.clip(image / max(float(np.percentile(image, 99.5)), 1e-12), 0, 1))
    axes.imshow(shown, cmap="gray", extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    for sphere in spheres:
        column, row, radius = sphere.circle
        axes.add_patch(Circle((column, row), radius, fill=False, color="#56b4e9", linewidth=1.0))
        axes.plot([column], [row], "+", color="#56b4e9", markersize=8)
    for name, views in zip(names, seen, strict=True):
        colour = "#d55e00" if name in doubtful else "#e69f00"
        for view in views:
            if view is not None:
                axes.plot([view.pixel[0]], [view.pixel[1]], "x", color=colour, markersize=5)
                axes.annotate(
                    name, view.pixel, xytext=(3, 3), textcoords="offset points", fontsize=4, color=colour
                )
    axes.set_axis_off()
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
