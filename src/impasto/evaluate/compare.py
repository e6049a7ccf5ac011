"""Compare the fitted models: their magnitudes, their errors, and which of them each pixel asks for."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem, StoreError, raise_problems
from impasto.evaluate.clusters import choose_regions, write_regions
from impasto.evaluate.regions import WHOLE, sample_regions
from impasto.evaluate.tally import RegionComparison, Tally, specular_ratio
from impasto.images import write_tiff
from impasto.maps.pictures import draw_status
from impasto.models import parse_models
from impasto.output import prepare_folder
from impasto.pixels import read_pixels
from impasto.progress import progress
from impasto.store import fitted_models, open_fit, open_stack, source_problems

_TILE_ROWS, _TILE_COLUMNS = 128, 512
_SAMPLED = 20_000
_PREVIEW_PX = 1600


@dataclass(frozen=True)
class RatioSpread:
    """How much a model's As/Ad varies from region to region.

    Parameters
    ----------
    model : str
    regions : int
        Regions that have a ratio, at least two.
    mean, sd : float
        Mean and standard deviation of their mean ratios, every region counting alike.
    low, high : float
        Least and largest of them.
    """

    model: str
    regions: int
    mean: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True)
class CompareSummary:
    """What `compare` found.

    Parameters
    ----------
    store : Path
    regions : tuple of RegionComparison
        The whole painting first.
    spread : tuple of RatioSpread
        As/Ad over the other regions, for each model with a lobe; empty where there are fewer than two.
    files : tuple of Path
    seconds : float
    """

    store: Path
    regions: tuple[RegionComparison, ...]
    spread: tuple[RatioSpread, ...]
    files: tuple[Path, ...]
    seconds: float


def compare(
    store: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    regions: str | PathLike[str] | None = None,
    clusters: int | None = None,
    out: str | PathLike[str] | None = None,
    show_progress: bool | None = None,
) -> CompareSummary:
    """Compare fitted models on the photographs that they were fitted to.

    Parameters
    ----------
    store : path
        Store with fits.
    models : sequence of str, optional
        Models to compare, by default all that are fitted. The first tells where highlights are.
    regions : path, optional
        Image of the painting's size with a colour per region; see `read_regions`.
    clusters : int, optional
        Have this many regions found instead, from the first model's maps; see `cluster_regions`.
    out : path, optional
        Folder for the map of the models chosen, ``model_choice.tif`` and a picture, and for that of the
        clusters.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    CompareSummary

    Raises
    ------
    OptionError
        If a model or the regions cannot be used, nothing is fitted, or no pixel could be.
    StoreError
        If there is no such store or a fit is missing.
    OutputError
        If the maps cannot be written.
    """
    started = time.perf_counter()
    path = Path(store)
    stack = open_stack(path)
    names = [spec.name for spec in parse_models(models)] or ordered_fits(path)
    fits = {name: open_fit(path, name) for name in names}
    _, height, width, channels = stack.shape
    divided = choose_regions(fits[names[0]], regions, clusters, show=show_progress)
    folder = prepare_folder(out) if out else None
    tally = Tally(stack, names, (WHOLE, *(divided.names if divided else ())))
    label = divided.label if divided else np.zeros((height, width), np.uint16)
    choice = np.zeros((height, width), np.uint8)
    with progress("compare", height * width, show=show_progress) as advance:
        for top in range(0, height, _TILE_ROWS):
            for left in range(0, width, _TILE_COLUMNS):
                rows = slice(top, min(top + _TILE_ROWS, height))
                columns = slice(left, min(left + _TILE_COLUMNS, width))
                radiance = stack.radiance(rows, columns).reshape(len(stack.lights), -1, channels)
                fitted = [read_pixels(fit, rows, columns) for fit in fits.values()]
                chosen = tally.add(radiance, fitted, label[rows, columns].ravel())
                choice[rows, columns] = chosen.reshape(choice[rows, columns].shape)
                advance(chosen.size)
    if not choice.any():
        raise OptionError(
            Problem(
                where=f"{path}: {', '.join(names)}",
                what="no pixel has all parameters of these models, so nothing can be compared",
                do="Look at the notes and the statuses of impasto fit; take photographs under more lights",
            )
        )
    samples = {name: sample_regions(fit, divided, _SAMPLED, show=show_progress) for name, fit in fits.items()}
    found = tally.result(
        {model: {name: specular_ratio(s.pixels) for name, s in of.items()} for model, of in samples.items()}
    )
    files: list[Path] = []
    if folder is not None:
        files = [folder / "model_choice.tif", folder / "model_choice.png"]
        write_tiff(files[0], choice, None)
        step = -(-max(height, width) // _PREVIEW_PX)
        draw_status(
            files[1],
            choice[::step, ::step],
            title="Model that describes each pixel best for its number of unknowns",
            meaning=dict(enumerate(["not compared", *names])),
            counts=dict(enumerate(np.bincount(choice.ravel(), minlength=1 + len(names)).tolist())),
        )
        if divided is not None and clusters:
            files += write_regions(folder, divided)
    return CompareSummary(path, found, _spread(found), tuple(files), time.perf_counter() - started)


def _spread(regions: Sequence[RegionComparison]) -> tuple[RatioSpread, ...]:
    spread = []
    for index, model in enumerate(regions[0].models):
        ratios = [ratio.mean for region in regions[1:] if (ratio := region.models[index].ratio)]
        if len(ratios) > 1:
            mean, sd = float(np.mean(ratios)), float(np.std(ratios, ddof=1))
            spread.append(RatioSpread(model.model, len(ratios), mean, sd, min(ratios), max(ratios)))
    return tuple(spread)


def ordered_fits(store: Path) -> list[str]:
    """Return the names of the fits of a store, Torrance-Sparrow first: its lobe tells where highlights are.

    Raises
    ------
    OptionError
        If there is none.
    StoreError
        If there is no such store.
    """
    raise_problems(StoreError, source_problems(store))
    names = sorted(fitted_models(store), key=lambda name: (not name.startswith("torrance-sparrow"), name))
    if not names:
        raise OptionError(
            Problem(
                f"{store}: fits", "holds no fit, at least one is expected", f"Run impasto fit {store} first"
            )
        )
    return names
