"""Find a grey wedge in a photograph: a row of even patches that become darker step by step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.spatial import cKDTree

from impasto.calibrate.find_target import BY_HAND, box_inside, smaller
from impasto.calibrate.lattice import Array, EvenPatches, even_patches, steep
from impasto.calibrate.patches import Box
from impasto.errors import CaptureError, Problem, raise_problems

LEAST, MOST = 5, 60
"""How many patches a wedge may have."""

# Steepness of the logarithm of radiance, per pixel, below which a pixel counts as part of an even patch: a
# step of density 0.05 reaches 0.04 through a lens that blurs by 0.7 px.
_EVEN = (0.01, 0.02, 0.04)
# Darker than this share of white, noise is all there is.
_FLOOR = 3e-4
_SLIM = 8.0
_NEIGHBOURS = 6
# A row goes on where the next patch lies within this share of a step of its place, of like area.
_OFF = 0.2
_ALIKE = 1.6
# Share of a step that a patch surely covers, and at least covers along the row.
_INSIDE = 0.62
_LEAST_FILLED = 0.4
# A step is at least this factor in radiance, and at most.
_LEAST_STEP, _LARGEST_STEP = 1.03, 4.0
# Patches of a wedge differ in colour by less than this, and by what noise adds in the dark, of white.
_COLOUR, _COLOUR_IN_THE_DARK = 0.15, 0.003
# What a patch may vary within, as a share of the smaller of the steps to its neighbours.
_EVENNESS = 0.5


@dataclass(frozen=True)
class FoundWedge:
    """A wedge found in a photograph.

    Parameters
    ----------
    names : tuple of str, length P
        Numbers from 1, the lightest patch, on.
    outlines : ndarray of shape (P, 4, 2)
        Columns and rows of the corners of the inner part of each patch.
    boxes : tuple of (int, int, int, int)
        First column, first row, end column and end row of an upright box inside of each.
    """

    names: tuple[str, ...]
    outlines: Array
    boxes: tuple[Box, ...]


@dataclass(frozen=True)
class _Row:
    """Patches in a row: middles and edge vectors along it and across it (P, 2), and their means (P, C)."""

    middle: Array
    along: Array
    across: Array
    colour: Array

    def part(self, which: slice) -> _Row:
        return _Row(self.middle[which], self.along[which], self.across[which], self.colour[which])


def find_wedge(radiance: NDArray[np.floating], count: int, where: str) -> FoundWedge:
    """Find a row of grey patches, however it is turned.

    Parameters
    ----------
    radiance : ndarray of shape (H, W, C)
        Linear, of any scale and white balance.
    count : int
        How many patches the wedge has.
    where : str
        What errors call the photograph.

    Raises
    ------
    CaptureError
        If no row of just so many patches is found, or more than one, or a patch is not even, naming it.

    Notes
    -----
    Even regions that are filled parallelograms are joined to rows, whose steps may grow or shrink slowly, as
    perspective makes them. A wedge is a part of a row in which each patch is darker than the one before, of
    the same colour, and that does not go on. A mirrored wedge reads as one turned by half, so that it need
    not be told apart.
    """
    small, factor = smaller(radiance)
    white = max(float(np.percentile(small, 99.5)), 1e-12)
    level = np.log(np.maximum(small.mean(axis=2), 0) / white + _FLOOR)
    steepness = steep(level[..., None])
    found: list[_Row] = []
    longest = 0
    for even in _EVEN:
        for row in _rows(even_patches(steepness < even, _SLIM), small):
            for wedge in _wedges(row, white):
                longest = max(longest, len(wedge.middle))
                if len(wedge.middle) == count and not any(_same(wedge, other) for other in found):
                    found.append(wedge)
    if longest > count or not found:
        told = f"the longest has {longest}" if longest else "there is none"
        what = f"shows no row of {count} grey patches that become darker step by step: {told}"
        do = "Lay it on a ground lighter or darker than all its patches, photograph it whole and sharp, or "
        do += "correct the number of its patches. "
        raise CaptureError(Problem(where, what, do + BY_HAND))
    if len(found) > 1:
        at = " and ".join("column {:.0f}, row {:.0f}".format(*(factor * row.middle[0])) for row in found[:2])
        what = f"shows {len(found)} rows of {count} grey patches, which begin at {at}"
        raise CaptureError(Problem(where, what, f"Cover all but the wedge. {BY_HAND}"))
    (wedge,) = found
    raise_problems(CaptureError, _uneven(wedge, level, where))
    corner = 0.5 * _INSIDE * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    edges = np.stack([wedge.along, wedge.across], axis=1)
    outlines = (wedge.middle[:, None] + corner @ edges + 0.5) * factor - 0.5
    names = tuple(str(number) for number in range(1, count + 1))
    return FoundWedge(names, outlines, tuple(box_inside(outline) for outline in outlines))


def _rows(patches: EvenPatches, image: Array) -> Iterator[_Row]:
    """Yield the rows of like patches that have at least `LEAST`, once each."""
    if len(patches.centre) < LEAST:
        return
    tree = cKDTree(patches.centre)
    _, near = tree.query(patches.centre, min(_NEIGHBOURS + 1, len(patches.centre)))
    joined: set[tuple[int, int]] = set()
    for seed in range(len(patches.centre)):
        for other in near[seed][1:]:
            if (seed, int(other)) in joined or not _fills(patches, seed, int(other)):
                continue
            ahead = _followed(patches, tree, seed, int(other))
            row = [*_followed(patches, tree, int(other), seed)[:1:-1], *ahead]
            if len(row) < LEAST or len(set(row)) < len(row):
                continue
            joined |= {pair for one, two in pairwise(row) for pair in ((one, two), (two, one))}
            yield _measured(patches, row, image)


def _fills(patches: EvenPatches, one: int, other: int) -> bool:
    """Return whether a patch is about as long as the step to the other one, which is like it."""
    step = patches.centre[other] - patches.centre[one]
    ratio = patches.area[other] / patches.area[one]
    filled = _length(patches.covariance[one], step) / np.hypot(*step)
    return bool(_LEAST_FILLED < filled < 1.05 and 1 / _ALIKE < ratio < _ALIKE)


def _followed(patches: EvenPatches, tree: cKDTree, first: int, second: int) -> list[int]:
    """Follow a row from its first two patches on as far as it goes."""
    row = [first, second]
    while len(row) < 2 * MOST:
        before, last = patches.centre[row[-2:]]
        step = last - before
        distance, near = tree.query(last + step)
        ratio = patches.area[near] / patches.area[row[-1]]
        if distance > _OFF * np.hypot(*step) or not 1 / _ALIKE < ratio < _ALIKE:
            break
        row.append(int(near))
    return row


def _length(covariance: Array, direction: Array) -> float:
    """Return the length of a parallelogram's edge in a direction, from its pixels' covariance.

    Notes
    -----
    Twelve covariances are a aᵀ + b bᵀ for edges a and b; without a aᵀ, their determinant vanishes.
    """
    unit = direction / np.hypot(*direction)
    across = np.array([-unit[1], unit[0]])
    return float(np.sqrt(12 * np.linalg.det(covariance) / (across @ covariance @ across)))


def _measured(patches: EvenPatches, row: list[int], image: Array) -> _Row:
    middle = patches.centre[row]
    along = np.gradient(middle, axis=0)
    edges = []
    for patch, step in zip(row, along, strict=True):
        covariance = patches.covariance[patch]
        unit = step / np.hypot(*step)
        rest = 12 * covariance - _length(covariance, step) ** 2 * np.outer(unit, unit)
        size, vectors = np.linalg.eigh(rest)
        edge = vectors[:, 1] * np.sqrt(max(size[1], 0.0))
        edges.append(edge * np.sign(step[0] * edge[1] - step[1] * edge[0]))
    across = np.array(edges)
    places = _places(middle, along, across, 0.2, image.shape)
    return _Row(middle, along, across, image[places[..., 1], places[..., 0]].mean(axis=1))


def _places(
    middle: Array, along: Array, across: Array, reach: float, shape: tuple[int, ...]
) -> NDArray[np.intp]:
    """Return 25 pixels of each patch, column and row, up to a share of its edges off its middle."""
    offsets = np.stack(np.meshgrid(*[np.linspace(-reach, reach, 5)] * 2), axis=-1).reshape(-1, 2)
    places = middle[:, None] + offsets @ np.stack([along, across], axis=1)
    return np.clip(np.rint(places), 0, np.array([shape[1], shape[0]]) - 1).astype(np.intp)


def _wedges(row: _Row, white: float) -> Iterator[_Row]:
    """Yield the longest parts of a row that become darker step by step and have one colour."""
    for turned in (row, row.part(slice(None, None, -1))):
        level = turned.colour.mean(axis=1)
        ratio = level[:-1] / np.maximum(level[1:], 1e-12)
        tint = turned.colour / level[:, None]
        same = (np.abs(np.diff(tint, axis=0)) < _COLOUR + _COLOUR_IN_THE_DARK * white / level[1:, None]).all(
            axis=1
        )
        falls = (ratio > _LEAST_STEP) & (ratio < _LARGEST_STEP) & same
        ends = np.flatnonzero(~falls) + 1
        for start, stop in pairwise([0, *ends.tolist(), len(level)]):
            if stop - start >= LEAST:
                yield turned.part(slice(start, stop))


def _same(one: _Row, other: _Row) -> bool:
    step = np.hypot(*one.along[0])
    return bool(np.hypot(*(one.middle[[0, -1]] - other.middle[[0, -1]]).T).max() < step / 2)


def _uneven(wedge: _Row, level: Array, where: str) -> list[Problem]:
    """Return a problem for each patch that something covers in part, or mirrors in."""
    places = _places(wedge.middle, wedge.along, wedge.across, _INSIDE / 2, level.shape)
    shown = uniform_filter(level, 3)[places[..., 1], places[..., 0]]
    steps = -np.diff(np.median(shown, axis=1))
    allowed = _EVENNESS * np.minimum(np.append(steps, np.inf), np.append(np.inf, steps))
    spread = np.abs(shown - np.median(shown, axis=1, keepdims=True)).max(axis=1)
    return [
        Problem(
            f"patch {number + 1}",
            f"differs within itself by {spread[number]:.0%} in {where}, "
            f"expected less than {allowed[number]:.0%}",
            f"Take away what covers it or mirrors in it. {BY_HAND}",
        )
        for number in np.flatnonzero(spread > allowed)
    ]
