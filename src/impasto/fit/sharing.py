"""Reflectance sharing: pixels that show their highlight tell of the same paint around them [Zickler2006]_.

Width and strength of the highlights of one paint are alike and not the same: a hierarchical model, whose
upper level, mean and spread of the paint, is estimated from the pixels themselves (empirical Bayes, by
moments as in [DerSimonian1986]_). Neighbours count by their distance in place and in diffuse colour, as in a
joint bilateral filter [Petschnigg2004]_. Why so: docs/decisions/0014-reflectance-sharing.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import _core
from impasto import store as stores
from impasto.errors import Problem
from impasto.fit.tile import Belief
from impasto.models import ModelSpec

Values = NDArray[np.float32]
Array = NDArray[np.float64]
Index = NDArray[np.intp]

# Every so many rows and columns a pixel is asked what it shows.
STEP = 2
# Where the weight of a neighbour comes to nothing: in pixels, and in cube roots of the diffuse magnitudes.
_REACH_PX = 64.0
_REACH_COLOUR = 0.1
# Neighbours in one cell and one bin of colour are summed up. Tiles of a fit consist of whole cells.
_CELL = 32
_BIN = 0.05
# What a pixel's photographs alone tell to this standard deviation (of logarithms) counts as shown.
_SHOWN = 0.3
# The least standard deviation of a paint: of the logarithm of a shape parameter, and of As over its scale.
_LEAST_SPREAD = (0.1, 0.02)
# Weak priors this much wider decide nothing.
_NO_PRIOR = 30.0
_ROWS = 32


def sharing_problems(model: ModelSpec) -> list[Problem]:
    """Return what forbids sharing reflectance in fits of a model."""
    if model.lobes == 1 and all(parameter.prior for parameter in model.shape):
        return []
    return [
        Problem(
            where="--share-reflectance",
            what=f"is not defined for {model.name}, but for one lobe whose parameters are fitted one by one",
            do="Leave it out, or fit a model such as torrance-sparrow",
        )
    ]


class Sharing:
    """The highlights that a painting shows, and the priors that follow for all its pixels.

    A prior has a normal distribution for each shape parameter, or its logarithm, and one for As over the
    scale that the shape gives it (κ/4 of the Torrance-Sparrow model): S + 1 in all.

    Parameters
    ----------
    model : ModelSpec
    """

    def __init__(self, model: ModelSpec) -> None:
        self._model = model
        shape = [parameter.prior or (0.0, 1.0) for parameter in model.shape]
        # The weak priors, which hold where no neighbour knows better: means and standard deviations.
        self._weak = np.array([*shape, (0.0, 1.0)])
        self._least_variance: Array = np.repeat(_LEAST_SPREAD, (len(shape), 1)) ** 2
        # Per cell: places of its groups of neighbours, and their sums (groups, 4 (S + 1)).
        self._cells: dict[tuple[int, int], tuple[Values, Values]] = {}
        self._asked = self._shown = 0

    @property
    def attributes(self) -> dict[str, Any]:
        """What was found, for the attributes of a fit."""
        return {"pixels": self._asked, "shown": round(self._shown / max(1, self._asked), 4)}

    def doubt(self, maps: stores.Maps) -> Belief:
        """Return the belief that anything is possible, for a fit by the photographs of a pixel alone."""
        mean, deviation = (np.tile(values, (len(maps["normal"]), 1)) for values in self._weak.T)
        return self._from(maps, mean, _NO_PRIOR * deviation)

    def add(self, maps: stores.Maps, row: Index, column: Index) -> None:
        """Take what pixels show, all those of a cell at once.

        Parameters
        ----------
        maps : dict of str to ndarray of shape (N[, k])
            Of a fit from `doubt`.
        row, column : ndarray of shape (N,), int
            Where they lie.
        """
        value, variance, shown = self._shown_by(maps)
        self._asked += len(shown)
        self._shown += int(np.count_nonzero(shown[:, 0]))
        weight = shown / (variance + self._least_variance)
        away = value - self._weak[:, 0]
        sums = np.stack([weight, weight * away, weight * away**2, weight * variance], axis=-1)
        colour = _colour(maps)
        group = np.column_stack([row // _CELL, column // _CELL, np.floor(colour / _BIN)])
        kept = np.flatnonzero(shown.any(axis=1))
        order = kept[np.lexsort(group[kept].T[::-1])]
        group, place, sums = group[order], _place(row, column, colour)[order], sums[order]
        first = _firsts(group)
        if not len(first):
            return
        mean = np.add.reduceat(place, first) / np.diff(first, append=len(group))[:, None]
        total = np.add.reduceat(sums, first).reshape(len(first), -1)
        places, totals = mean.astype(np.float32), total.astype(np.float32)
        cell = group[first, :2].astype(np.intp)
        begins = _firsts(cell)
        for begin, end in zip(begins, [*begins[1:], len(first)], strict=True):
            self._cells[tuple(cell[begin].tolist())] = (places[begin:end], totals[begin:end])

    def _shown_by(self, maps: stores.Maps) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the S + 1 parameters of pixels, their variances, and whether the photographs show them."""
        shape, deviation = (
            np.stack([maps[f"{name}{end}"] for name in self._model.shape_names], axis=1).astype(np.float64)
            for end in ("", "_sd")
        )
        logarithmic = np.array([parameter.lower > 0 for parameter in self._model.shape])
        specular, specular_sd = maps["specular"].astype(np.float64), maps["specular_sd"].astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            shape_sd = np.where(logarithmic, deviation / shape, deviation)
            ratio = specular / _core.specular_scale(self._model.name, shape)[:, 0]
            # As if As and shape erred independently, the scale as the square of the first parameter. For a
            # lobe that is seen in part, whose errors cancel, this is too large, which only costs weight.
            ratio_sd = np.hypot(specular_sd / specular, 2 * shape_sd[:, 0])
            value = np.column_stack([np.where(logarithmic, np.log(shape), shape), ratio])
        shown = np.column_stack([shape_sd, ratio_sd]) < _SHOWN
        shown &= np.isfinite(value) & (maps["status"] == 0)[:, None]
        deviation = np.column_stack([shape_sd, ratio_sd * ratio])
        return np.where(shown, value, 0), np.where(shown, deviation, 0) ** 2, shown

    def belief(self, maps: stores.Maps, row: Index, column: Index) -> Belief:
        """Return what pixels are believed to be by what those around them show.

        Parameters
        ----------
        maps : dict of str to ndarray of shape (N[, k])
            Of a fit of the pixels, each by itself.
        row, column : ndarray of shape (N,), int
            Where they lie.
        """
        mean, deviation = np.empty((2, len(row), len(self._weak)))
        place = _place(row, column, _colour(maps))
        cell = np.column_stack([row // _CELL, column // _CELL])
        order = np.lexsort(cell.T[::-1])
        for pixels in np.split(order, _firsts(cell[order])[1:]):
            mean[pixels], deviation[pixels] = self._prior(cell[pixels[0]].tolist(), place[pixels])
        return self._from(maps, mean, deviation)

    def _prior(self, cell: list[int], place: Array) -> tuple[Array, Array]:
        """Return means and standard deviations (N, S + 1) of the priors at places in a cell."""
        row, column = cell
        reach = int(np.ceil(_REACH_PX / _CELL))
        around = [
            self._cells[y, x]
            for y in range(row - reach, row + reach + 1)
            for x in range(column - reach, column + reach + 1)
            if (y, x) in self._cells
        ]
        total = np.zeros((len(place), 4 * len(self._weak)))
        if around:
            # From the middle of the cell, so that places are small numbers, as float32 wants them.
            middle = np.zeros(place.shape[1], np.float32)
            middle[:2] = (np.array([row, column]) + 0.5) * (_CELL / _REACH_PX)
            here = (place - middle).astype(np.float32)
            there = np.concatenate([places for places, _ in around]) - middle
            sums = np.concatenate([sums for _, sums in around])
            nearness = _product(here, 2 * there.T)
            nearness += 1 - np.square(there).sum(axis=1)
            nearness -= np.square(here).sum(axis=1)[:, None]
            np.square(np.maximum(nearness, 0, out=nearness), out=nearness)
            total[...] = _product(nearness, sums)
        weight, first, second, noise = total.reshape(len(place), -1, 4).transpose(2, 0, 1)
        weak, weak_sd = self._weak.T
        # How far the neighbours' mean is off, and how far the paint departs from it: what is left of the
        # neighbours' spread when their own errors are taken out.
        variance = 1 / (weight + 1 / weak_sd**2)
        some = np.maximum(weight, 1e-12)
        spread = np.maximum((second - noise - first**2 / some) / some, 0) + self._least_variance
        return weak + first * variance, np.sqrt(variance + spread)

    def _from(self, maps: stores.Maps, mean: Array, deviation: Array) -> Belief:
        return Belief(
            normal=maps["normal"],
            shape=np.stack([maps[name] for name in self._model.shape_names], axis=1),
            mean=mean.astype(np.float32),
            deviation=deviation.astype(np.float32),
        )


def _product(left: Values, right: Values) -> Values:
    """Return left (N, K) @ right (K, M), in pieces so small that BLAS adds no threads of its own."""
    whole = len(left) // _ROWS * _ROWS
    pieces = np.matmul(left[:whole].reshape(-1, _ROWS, left.shape[1]), right)
    return np.concatenate([pieces.reshape(whole, right.shape[1]), np.matmul(left[whole:], right)])


def _firsts(rows: NDArray[Any]) -> Index:
    """Return where in sorted rows, none of which is negative, a row differs from the one before."""
    return np.flatnonzero(np.diff(rows, axis=0, prepend=-1).any(axis=1))


def _colour(maps: stores.Maps) -> Array:
    return np.cbrt(np.maximum(maps["diffuse"].astype(np.float64), 0))


def _place(row: Index, column: Index, colour: Array) -> Array:
    """Return where pixels lie in the space of place and colour, (N, 2 + C), in units of the reach."""
    return np.column_stack([row / _REACH_PX, column / _REACH_PX, colour / _REACH_COLOUR])
