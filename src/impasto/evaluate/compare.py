"""Compare the fitted models: their magnitudes, their errors, and which of them each pixel asks for."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.errors import OptionError, Problem
from impasto.evaluate.criteria import is_highlight, misfit, unknowns
from impasto.evaluate.regions import WHOLE, Regions, read_regions, sample_regions
from impasto.images import write_tiff
from impasto.maps.pictures import draw_status
from impasto.models import parse_model
from impasto.output import prepare_folder
from impasto.pixels import Pixels, luminance, read_pixels
from impasto.progress import progress
from impasto.store import Fit, Stack, fitted_models, open_fit, open_stack

_TILE_ROWS, _TILE_COLUMNS = 128, 512
_SAMPLED = 20_000
_PREVIEW_PX = 1600


@dataclass(frozen=True)
class Ratio:
    """The specular magnitude over the diffuse one, As/Ad, of a region's pixels.

    Parameters
    ----------
    mean : float
        Mean of the pixels' ratios, Ad in luminance [Chen2007]_, Table II.
    per_channel : tuple of float
        The same with Ad of each channel.
    low, median, high : float
        5th, 50th and 95th percentile over the pixels, in luminance.
    """

    mean: float
    per_channel: tuple[float, ...]
    low: float
    median: float
    high: float


@dataclass(frozen=True)
class ModelComparison:
    """One model in one region.

    Parameters
    ----------
    model : str
    unknowns : int
        Numbers fitted per pixel.
    ratio : Ratio or None
        None for a model without a lobe, and where no pixel has a ratio.
    rms, rms_highlight, rms_elsewhere : float
        Root mean square error of relative radiance over the mean radiance: over all lights, where the first
        model's highlight makes more than a tenth of the radiance, and elsewhere; NaN without a sample.
    chosen : float
        Share of the pixels whose information criterion is least with this model.
    """

    model: str
    unknowns: int
    ratio: Ratio | None
    rms: float
    rms_highlight: float
    rms_elsewhere: float
    chosen: float


@dataclass(frozen=True)
class RegionComparison:
    """All models in one region.

    Parameters
    ----------
    name : str
    pixels, unknown_pixels : int
        Pixels compared, and those that some model could not be fitted to.
    models : tuple of ModelComparison
    """

    name: str
    pixels: int
    unknown_pixels: int
    models: tuple[ModelComparison, ...]


@dataclass(frozen=True)
class CompareSummary:
    """What `compare` found.

    Parameters
    ----------
    store : Path
    regions : tuple of RegionComparison
        The whole painting first.
    files : tuple of Path
    seconds : float
    """

    store: Path
    regions: tuple[RegionComparison, ...]
    files: tuple[Path, ...]
    seconds: float


def compare(
    store: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    regions: str | PathLike[str] | None = None,
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
    out : path, optional
        Folder for the map of the models chosen: ``model_choice.tif`` and a picture.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    CompareSummary

    Raises
    ------
    OptionError
        If a model or the regions cannot be used, or nothing is fitted.
    StoreError
        If there is no such store or a fit is missing.
    OutputError
        If the map cannot be written.
    """
    started = time.perf_counter()
    path = Path(store)
    stack = open_stack(path)
    names = [parse_model(name).name for name in models] or ordered_fits(path)
    fits = {name: open_fit(path, name) for name in names}
    _, height, width, _ = stack.shape
    drawn = read_regions(Path(regions), height, width) if regions else None
    folder = prepare_folder(out) if out else None
    sums = _Sums(stack, fits, drawn)
    with progress("compare", height * width, show=show_progress) as advance:
        for top in range(0, height, _TILE_ROWS):
            for left in range(0, width, _TILE_COLUMNS):
                rows = slice(top, min(top + _TILE_ROWS, height))
                columns = slice(left, min(left + _TILE_COLUMNS, width))
                sums.add(rows, columns)
                advance((rows.stop - rows.start) * (columns.stop - columns.start))
    ratios = {
        name: sample_regions(fit, drawn, _SAMPLED, show=show_progress)
        for name, fit in fits.items()
        if parse_model(name).lobes
    }
    found = sums.regions(
        {name: {r: _ratio(s.pixels) for r, s in each.items()} for name, each in ratios.items()}
    )
    files: tuple[Path, ...] = ()
    if folder is not None:
        files = (folder / "model_choice.tif", folder / "model_choice.png")
        write_tiff(files[0], sums.choice, None)
        step = -(-max(height, width) // _PREVIEW_PX)
        draw_status(
            files[1],
            sums.choice[::step, ::step],
            title="Model that describes each pixel best for its number of unknowns",
            meaning=dict(enumerate(["not compared", *names])),
            counts=dict(enumerate(np.bincount(sums.choice.ravel(), minlength=1 + len(names)).tolist())),
        )
    return CompareSummary(path, found, files, time.perf_counter() - started)


def ordered_fits(store: Path) -> list[str]:
    """Return the names of the fits of a store, Torrance-Sparrow first: its lobe tells where highlights are.

    Raises
    ------
    OptionError
        If there is none.
    """
    names = sorted(fitted_models(store), key=lambda name: (not name.startswith("torrance-sparrow"), name))
    if not names:
        raise OptionError(
            Problem(
                f"{store}: fits", "holds no fit, at least one is expected", f"Run impasto fit {store} first"
            )
        )
    return names


class _Sums:
    """Sums of squares per region and model, and the model that each pixel asks for."""

    def __init__(self, stack: Stack, fits: Mapping[str, Fit], drawn: Regions | None) -> None:
        _, height, width, self._channels = stack.shape
        self._stack, self._fits = stack, fits
        self._label = drawn.label if drawn else np.zeros((height, width), np.uint16)
        self._names = (WHOLE, *(drawn.names if drawn else ()))
        shape = (len(self._names), len(fits), 2)
        self._squares, self._radiance, self._samples = (np.zeros(shape) for _ in range(3))
        self._chosen = np.zeros(shape[:2])
        self._known = np.zeros(len(self._names), int)
        self._area = np.zeros(len(self._names), int)
        self.choice = np.zeros((height, width), np.uint8)

    def add(self, rows: slice, columns: slice) -> None:
        radiance = self._stack.radiance(rows, columns)
        radiance = radiance.reshape(len(radiance), -1, self._channels)
        fitted = [read_pixels(fit, rows, columns) for fit in self._fits.values()]
        label = self._label[rows, columns].ravel()
        whole = np.all([pixels.whole for pixels in fitted], axis=0)
        self._area += [label.size, *np.bincount(label, minlength=len(self._names))[1:]]
        highlight = is_highlight(fitted[0].select(whole), self._stack)
        misfits = [misfit(p.select(whole), self._stack, radiance[:, whole], highlight) for p in fitted]
        best = np.argmin([each.criterion for each in misfits], axis=0)
        choice = np.zeros(label.size, np.uint8)
        choice[whole] = 1 + best
        self.choice[rows, columns] = choice.reshape(self.choice[rows, columns].shape)
        for number in (0, *np.unique(label[label > 0])):
            member = label[whole] == number if number else np.ones(len(best), bool)
            self._known[number] += int(member.sum())
            self._chosen[number] += np.bincount(best[member], minlength=len(fitted))
            for index, each in enumerate(misfits):
                self._squares[number, index] += each.squares[:, member].sum(axis=1)
                self._radiance[number, index] += each.sums[:, member].sum(axis=1)
                self._samples[number, index] += each.samples[:, member].sum(axis=1)

    def regions(self, ratios: Mapping[str, Mapping[str, Ratio | None]]) -> tuple[RegionComparison, ...]:
        found = []
        for number, name in enumerate(self._names):
            compared = []
            for index, model in enumerate(self._fits):
                highlight, elsewhere = (self._rms(number, index, part) for part in ([0], [1]))
                compared.append(
                    ModelComparison(
                        model=model,
                        unknowns=unknowns(parse_model(model), self._channels),
                        ratio=ratios.get(model, {}).get(name),
                        rms=self._rms(number, index, [0, 1]),
                        rms_highlight=highlight,
                        rms_elsewhere=elsewhere,
                        chosen=float(self._chosen[number, index] / max(self._known[number], 1)),
                    )
                )
            known, area = int(self._known[number]), int(self._area[number])
            found.append(RegionComparison(name, known, area - known, tuple(compared)))
        return tuple(found)

    def _rms(self, region: int, model: int, parts: list[int]) -> float:
        samples = self._samples[region, model, parts].sum()
        radiance = self._radiance[region, model, parts].sum()
        if samples == 0 or radiance <= 0:
            return float("nan")
        squares = self._squares[region, model, parts].sum()
        return float(np.sqrt(squares / samples) / (radiance / samples))


def _ratio(pixels: Pixels) -> Ratio | None:
    """Return As/Ad of pixels whose diffuse magnitude is above 0."""
    diffuse = pixels.diffuse.astype(np.float64)
    lit = (diffuse > 0).all(axis=1)
    if not lit.any():
        return None
    specular = pixels.specular[lit].sum(axis=1, dtype=np.float64)
    ratio: NDArray[np.float64] = specular / luminance(diffuse[lit])
    low, median, high = np.percentile(ratio, [5, 50, 95]).tolist()
    per_channel = (specular[:, None] / diffuse[lit]).mean(axis=0)
    return Ratio(float(ratio.mean()), tuple(per_channel.tolist()), low, median, high)
