"""Sums over pixels of what each fitted model gets wrong, and of which model each pixel asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.evaluate.criteria import is_highlight, misfit, unknowns
from impasto.models import parse_model
from impasto.pixels import Pixels, luminance
from impasto.store import Stack


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


class Tally:
    """Sums of squares per region and model, and the model that each pixel asks for.

    Parameters
    ----------
    stack : Stack
    models : sequence of str
        The first tells where highlights are.
    regions : sequence of str
        Names; the first is the whole painting.
    """

    def __init__(self, stack: Stack, models: Sequence[str], regions: Sequence[str]) -> None:
        self._stack, self._models, self._names = stack, tuple(models), tuple(regions)
        shape = (len(self._names), len(self._models), 2)
        self._squares, self._radiance, self._samples = (np.zeros(shape) for _ in range(3))
        self._chosen = np.zeros(shape[:2])
        self._known = np.zeros(len(self._names), int)
        self._area = np.zeros(len(self._names), int)
        self._coloured = [False] * len(self._models)

    def add(
        self, radiance: NDArray[np.float32], fitted: Sequence[Pixels], label: NDArray[np.integer]
    ) -> NDArray[np.uint8]:
        """Add pixels.

        Parameters
        ----------
        radiance : ndarray of shape (L, P, C)
            As photographed.
        fitted : sequence of Pixels
            The same pixels in each model's fit.
        label : ndarray of shape (P,)
            Each pixel's region by its place in the names; 0 is outside of all but the whole painting.

        Returns
        -------
        ndarray of shape (P,)
            The model that each pixel asks for, counted from 1; 0 where some model has no full fit.
        """
        whole = np.all([pixels.whole for pixels in fitted], axis=0)
        self._coloured = [pixels.specular_rgb is not None for pixels in fitted]
        self._area += [label.size, *np.bincount(label, minlength=len(self._names))[1:]]
        highlight = is_highlight(fitted[0].select(whole), self._stack)
        misfits = [misfit(p.select(whole), self._stack, radiance[:, whole], highlight) for p in fitted]
        best = np.argmin([each.criterion for each in misfits], axis=0)
        choice = np.zeros(label.size, np.uint8)
        choice[whole] = 1 + best
        for number in (0, *np.unique(label[label > 0])):
            member = label[whole] == number if number else np.ones(len(best), bool)
            self._known[number] += int(member.sum())
            self._chosen[number] += np.bincount(best[member], minlength=len(fitted))
            for index, each in enumerate(misfits):
                self._squares[number, index] += each.squares[:, member].sum(axis=1)
                self._radiance[number, index] += each.sums[:, member].sum(axis=1)
                self._samples[number, index] += each.samples[:, member].sum(axis=1)
        return choice

    def result(self, ratios: Mapping[str, Mapping[str, Ratio | None]]) -> tuple[RegionComparison, ...]:
        """Return what was found per region, given As/Ad by model and region."""
        found = []
        for number, name in enumerate(self._names):
            compared = []
            for index, model in enumerate(self._models):
                highlight, elsewhere = (self._rms(number, index, part) for part in ([0], [1]))
                compared.append(
                    ModelComparison(
                        model=model,
                        unknowns=unknowns(
                            parse_model(model), self._stack.shape[3], coloured=self._coloured[index]
                        ),
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


def specular_ratio(pixels: Pixels) -> Ratio | None:
    """Return As/Ad of pixels whose diffuse magnitude is above 0; None where there is none, or no lobe.

    A channel in which no pixel reflects has no ratio: NaN.
    """
    lit = luminance(pixels.diffuse) > 0
    if not lit.any() or not pixels.model.lobes:
        return None
    diffuse = pixels.diffuse[lit].astype(np.float64)
    specular = pixels.specular[lit].sum(axis=1, dtype=np.float64)
    ratio: NDArray[np.float64] = specular / luminance(diffuse)
    low, median, high = np.percentile(ratio, [5, 50, 95]).tolist()
    per_channel = tuple(
        float(np.mean(specular[channel > 0] / channel[channel > 0])) if (channel > 0).any() else float("nan")
        for channel in diffuse.T
    )
    return Ratio(float(ratio.mean()), per_channel, low, median, high)
