"""The RMS of sets of photographs over every pixel of the image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impasto.angles.photographed import Photographed
from impasto.angles.refit import Score
from impasto.angles.study import STRATEGIES, Point, Study
from impasto.geometry import rows_and_columns
from impasto.progress import progress
from impasto.store import STACK_CHUNK


def image_rms(
    study: Study, scored: Sequence[int], points: Sequence[Point], show: bool | None
) -> dict[str, float]:
    """Fit the whole image again from sets of photographs, tile by tile.

    Parameters
    ----------
    study : Study
    scored : sequence of int
        Numbers of the photographs that judge.
    points : sequence of Point
        The sets; those found among all sets are passed over.
    show : bool or None
        Whether to show a progress bar.

    Returns
    -------
    dict of str to float
        RMS over the mean radiance, as `Errors.rms`, per ``<strategy> <size>``.
    """
    stack, camera = study.pixels.stack, study.pixels.camera
    _, height, width, _ = stack.shape
    number = {name: light for light, name in enumerate(stack.lights.names)}
    sets = {
        f"{point.strategy} {point.size}": [number[name] for name in point.photographs]
        for point in sorted(points, key=lambda point: (point.strategy, point.size))
        if point.strategy in STRATEGIES
    }
    squares = dict.fromkeys(sets, 0.0)
    samples, radiance = 0, 0.0
    with progress("Refitting the image", height * width * len(sets), show=show) as advance:
        for top in range(0, height, STACK_CHUNK):
            for left in range(0, width, STACK_CHUNK):
                rows = slice(top, min(top + STACK_CHUNK, height))
                columns = slice(left, min(left + STACK_CHUNK, width))
                tile = stack.radiance(rows, columns)
                row, column = rows_and_columns(rows, columns)
                pixels = Photographed(stack, camera, row, column, tile.reshape(len(tile), row.size, -1))
                score = Score(pixels, scored)
                samples, radiance = samples + score.samples, radiance + score.radiance
                for name, lights in sets.items():
                    squares[name] += score.squares(study.refit(pixels, lights))
                    advance(row.size)
    if radiance <= 0:
        return {}
    return {name: float(np.sqrt(total * samples) / radiance) for name, total in squares.items()}
