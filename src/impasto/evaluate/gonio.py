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

from impasto.errors import OptionError, Problem
from impasto.evaluate.compare import ordered_fits
from impasto.evaluate.curve_plot import draw_curve
from impasto.evaluate.curves import Curve, CurveSums, columns
from impasto.evaluate.regions import Regions, check_inside, read_regions, sample_regions
from impasto.models import basis, parse_model
from impasto.output import prepare_folder, write_text
from impasto.pixels import Pixels, read_pixels
from impasto.progress import progress
from impasto.store import Fit, Stack, open_fit, open_stack

_TILE_ROWS, _TILE_COLUMNS = 256, 512
_SAMPLED = 20_000
# Which pixels are shown unasked, by the rank of the height of their highlight.
_TELLING = {"high highlight": 0.99, "typical highlight": 0.5, "low highlight": 0.01}


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
        Single pixels, column and row. Without pixels and regions, three that tell the range of highlights.
    regions : path, optional
        Image of the painting's size with a colour per region; a region's curve is the mean of its pixels.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    GonioSummary

    Raises
    ------
    OptionError
        If a model or a region cannot be used, nothing is fitted, or a pixel lies outside of the painting.
    StoreError
        If there is no such store or a fit is missing.
    OutputError
        If the files cannot be written.
    """
    started = time.perf_counter()
    path = Path(store)
    stack = open_stack(path)
    names = [parse_model(name).name for name in models] or ordered_fits(path)
    fits = {name: open_fit(path, name) for name in names}
    height, width = stack.shape[1:3]
    check_inside(pixels, height, width)
    drawn = read_regions(Path(regions), height, width) if regions else None
    folder = prepare_folder(out)
    places = {f"pixel {column},{row}": (column, row) for column, row in pixels}
    if not places and drawn is None:
        places = _telling_pixels(fits[names[0]], stack, show_progress)
    curves = [_pixel_curve(name, *place, stack, fits) for name, place in places.items()]
    if drawn is not None:
        curves += _region_curves(drawn, stack, fits, show_progress)
    files: list[Path] = []
    for curve in curves:
        stem = folder / re.sub(r"[^0-9A-Za-z]+", "-", curve.name).strip("-")
        write_text(stem.with_suffix(".csv"), _csv(curve))
        draw_curve(stem.with_suffix(".png"), curve, fits)
        files += [stem.with_suffix(".png"), stem.with_suffix(".csv")]
    return GonioSummary(path, folder, tuple(curves), tuple(files), time.perf_counter() - started)


def _pixel_curve(name: str, column: int, row: int, stack: Stack, fits: Mapping[str, Fit]) -> Curve:
    sums = CurveSums(name, stack, tuple(fits))
    _add(sums, stack, fits, slice(row, row + 1), slice(column, column + 1))
    return sums.curve()


def _region_curves(drawn: Regions, stack: Stack, fits: Mapping[str, Fit], show: bool | None) -> list[Curve]:
    _, height, width, _ = stack.shape
    sums = [CurveSums(f"region {name}", stack, tuple(fits)) for name in drawn.names]
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


def _telling_pixels(fit: Fit, stack: Stack, show: bool | None) -> dict[str, tuple[int, int]]:
    """Return a pixel with a high, a typical and a low highlight."""
    sample = next(iter(sample_regions(fit, None, _SAMPLED, show=show).values())).pixels
    if not len(sample):
        raise OptionError(
            Problem(
                where=f"{stack.store}: {fit.group}",
                what="no pixel has a highlight that is known",
                do="Name pixels with --pixel, or fit lambert and look at its maps",
            )
        )
    order = np.argsort(_highlight(sample, stack.camera.view_direction), kind="stable")
    chosen = {name: order[round(rank * (len(order) - 1))] for name, rank in _TELLING.items()}
    return {name: (int(sample.column[number]), int(sample.row[number])) for name, number in chosen.items()}


def _highlight(pixels: Pixels, view: np.ndarray) -> np.ndarray:
    """Return the height of the highlights, lit from their mirror direction, shape (P,)."""
    normal = pixels.normal.astype(np.float64)
    mirror = 2 * (normal @ view)[:, None] * normal - view
    _, lobes = basis(
        pixels.model,
        normal,
        mirror,
        np.tile(view, (len(pixels), 1)),
        pixels.shape,
        index=pixels.attributes["index_of_refraction"],
        fresnel=pixels.attributes["fresnel"],
    )
    return np.asarray(np.sum(pixels.specular * lobes, axis=1))


def _csv(curve: Curve) -> str:
    table = columns(curve)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*table.values(), strict=True):
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row])
    return text.getvalue()
