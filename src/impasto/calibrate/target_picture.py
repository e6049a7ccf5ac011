"""Draw the patches that were found of a target, to be checked by eye."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.patches import Array, Box
from impasto.output import written_whole


def draw_target(path: Path, radiance: NDArray[np.floating], outlines: Array, boxes: Sequence[Box]) -> None:
    """Draw numbered outlines of the patches, and the boxes that are read, over the photograph.

    Parameters
    ----------
    path : Path
        PNG file to write.
    radiance : ndarray of shape (H, W, C)
        Linear, grey or in colour.
    outlines : ndarray of shape (P, 4, 2)
        Columns and rows of each patch's corners.
    boxes : sequence of (int, int, int, int)
        First column, first row, end column and end row of what is read.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Polygon, Rectangle

    height, width = radiance.shape[:2]
    figure = Figure(figsize=(9.0, 9.0 * height / width + 0.2), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    white = max(float(np.percentile(radiance, 99.5)), 1e-12)
    step = max(1, max(height, width) // 1600)
    shown = np.sqrt(np.clip(radiance[::step, ::step] / white, 0, 1))
    shown = np.broadcast_to(shown, (*shown.shape[:2], 3))
    axes.imshow(shown, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    for number, (outline, box) in enumerate(zip(outlines, boxes, strict=True), start=1):
        axes.add_patch(Polygon(outline, fill=False, color="black", linewidth=2.2))
        axes.add_patch(Polygon(outline, fill=False, color="#f0e442", linewidth=1.0))
        left, top, right, bottom = box
        place = (left - 0.5, top - 0.5)
        axes.add_patch(
            Rectangle(place, right - left, bottom - top, fill=False, color="#56b4e9", linewidth=0.8)
        )
        column, row = outline.mean(axis=0)
        text = axes.text(
            column, row, str(number), ha="center", va="center", fontsize=7 if len(boxes) < 60 else 4
        )
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})
    axes.set_axis_off()
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
