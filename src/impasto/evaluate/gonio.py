"""Gonio curves of pixels and regions, as plots and as tables."""

from __future__ import annotations

import csv
import io
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem, raise_problems
from impasto.evaluate.clusters import choose_regions, write_regions
from impasto.evaluate.compare import ordered_fits
from impasto.evaluate.curve_plot import draw_curve
from impasto.evaluate.curves import Curve, CurveSums, columns
from impasto.evaluate.regions import WHOLE, Regions, check_inside, sample_regions
from impasto.evaluate.telling import telling_pixels
from impasto.models import parse_models
from impasto.output import prepare_folder, write_text
from impasto.pixels import read_pixels
from impasto.progress import progress
from impasto.store import Fit, Stack, open_fit, open_stack

_TILE_ROWS, _TILE_COLUMNS = 256, 512
_SAMPLED = 20_000


@dataclass(frozen=True)
class GonioSummary:
    """What `gonio` found.

    Parameters
    ----------
    store : Path
    out : Path
    curves : tuple of Curve
    files : tuple of Path
    seconds : float
    """

    store: Path
    out: Path
    curves: tuple[Curve, ...]
    files: tuple[Path, ...]
    seconds: float


def gonio(
    store: str | PathLike[str],
    *,
    out: str | PathLike[str],
    models: Sequence[str] = (),
    pixels: Sequence[tuple[int, int]] = (),
    regions: str | PathLike[str] | None = None,
    clusters: int | None = None,
    show_progress: bool | None = None,
) -> GonioSummary:
    """Plot measured and modelled radiance against the angle of the light [Chen2007]_, Figs. 4 and 6 to 8.

    Parameters
    ----------
    store : path
        Store with fits.
    out : path
        Folder for a plot (PNG) and a table (CSV) per place.
    models : sequence of str, optional
        Models to show, by default all that are fitted. The first tells how wide the highlight is.
    pixels : sequence of (int, int), optional
        Single pixels, column and row. Without pixels and regions, four that tell the range: see
        `telling_pixels`.
    regions : path, optional
        Image of the painting's size with a colour per region; a region's curve is the mean of its pixels.
    clusters : int, optional
        Have this many regions found instead, from the first model's maps; see `cluster_regions`.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    GonioSummary

    Raises
    ------
    OptionError
        If a model or a region cannot be used, nothing is fitted, or a pixel lies outside of the painting or,
        like a region, has no fit.
    StoreError
        If there is no such store or a fit is missing.
    OutputError
        If the files cannot be written.
    """
    started = time.perf_counter()
    path = Path(store)
    stack = open_stack(path)
    names = [spec.name for spec in parse_models(models)] or ordered_fits(path)
    fits = {name: open_fit(path, name) for name in names}
    height, width = stack.shape[1:3]
    check_inside(pixels, height, width)
    divided = choose_regions(fits[names[0]], regions, clusters, show=show_progress)
    folder = prepare_folder(out)
    places = {f"pixel {column},{row}": (column, row) for column, row in pixels}
    if not places and divided is None:
        sample = sample_regions(fits[names[0]], None, _SAMPLED, show=show_progress)
        places = telling_pixels(sample[WHOLE].pixels, fits[names[0]], stack)
    curves = [pixel_curve(name, *place, stack, fits) for name, place in places.items()]
    files: list[Path] = []
    if divided is not None:
        curves += _region_curves(divided, stack, fits, show_progress)
        files += write_regions(folder, divided) if clusters else []
    raise_problems(OptionError, [_unknown(curve, names) for curve in curves if not curve.pixels])
    for curve in curves:
        stem = folder / re.sub(r"[^0-9A-Za-z]+", "-", curve.name).strip("-")
        write_text(stem.with_suffix(".csv"), _csv(curve))
        draw_curve(stem.with_suffix(".png"), curve, fits)
        files += [stem.with_suffix(".png"), stem.with_suffix(".csv")]
    return GonioSummary(path, folder, tuple(curves), tuple(files), time.perf_counter() - started)


def pixel_curve(name: str, column: int, row: int, stack: Stack, fits: Mapping[str, Fit]) -> Curve:
    """Return the curve of one pixel, which gets the name `name`."""
    sums = CurveSums(name, stack, tuple(fits))
    _add(sums, stack, fits, slice(row, row + 1), slice(column, column + 1))
    return sums.curve()


def _region_curves(drawn: Regions, stack: Stack, fits: Mapping[str, Fit], show: bool | None) -> list[Curve]:
    _, height, width, _ = stack.shape
    sums = [
        CurveSums(name if name.startswith("cluster") else f"region {name}", stack, tuple(fits))
        for name in drawn.names
    ]
    with progress("gonio", height * width, show=show) as advance:
        for top in range(0, height, _TILE_ROWS):
            for left in range(0, width, _TILE_COLUMNS):
                rows = slice(top, min(top + _TILE_ROWS, height))
                columns = slice(left, min(left + _TILE_COLUMNS, width))
                label = drawn.label[rows, columns].ravel()
                for number in np.unique(label[label > 0]):
                    _add(sums[number - 1], stack, fits, rows, columns, label == number)
                advance(label.size)
    return [each.curve() for each in sums]


def _add(
    sums: CurveSums,
    stack: Stack,
    fits: Mapping[str, Fit],
    rows: slice,
    columns: slice,
    chosen: np.ndarray | None = None,
) -> None:
    radiance = stack.radiance(rows, columns)
    radiance = radiance.reshape(len(radiance), -1, radiance.shape[-1])
    fitted = {name: read_pixels(fit, rows, columns) for name, fit in fits.items()}
    if chosen is not None:
        radiance = radiance[:, chosen]
        fitted = {name: pixels.select(chosen) for name, pixels in fitted.items()}
    sums.add(radiance, fitted)


def _unknown(curve: Curve, models: Sequence[str]) -> Problem:
    return Problem(
        where=curve.name,
        what=f"has no pixel with all parameters of {', '.join(models)}, so there are no models to show",
        do="Choose another place; the status map of impasto maps tells where there are values",
    )


def _csv(curve: Curve) -> str:
    table = columns(curve)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*table.values(), strict=True):
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row])
    return text.getvalue()
