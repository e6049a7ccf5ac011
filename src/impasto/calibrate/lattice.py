"""Lattices of even, four-cornered patches in a photograph: where a target of patches may lie."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

# Steepness, in cube roots of full scale per pixel, below which a pixel counts as part of an even patch.
_EVEN = (0.004, 0.012, 0.03)
_LEAST_PX = 36
_NEIGHBOURS = 6
# A patch belongs to a lattice that passes its centre within this share of a step.
_OFF = 0.2


@dataclass(frozen=True)
class Lattice:
    """A lattice seen in perspective.

    Parameters
    ----------
    homography : ndarray of shape (3, 3)
        From steps (across, down) to pixels (column, row).
    steps : ndarray of shape (N, 2), int
        Where patches were seen.
    """

    homography: Array
    steps: NDArray[np.intp]

    def pixels(self, steps: Array) -> Array:
        """Return columns and rows of places in the lattice, shape (…, 2)."""
        return project(self.homography, steps)


def lattices(image: Array, least: int, longest: int) -> Iterator[Lattice]:
    """Find lattices in an image, each of at least so many patches; not turned over.

    Parameters
    ----------
    image : ndarray of shape (H, W, C)
        About evenly spaced for the eye, such as cube roots of radiance, largest 1.
    least : int
    longest : int
        Patches in the longest row of what is looked for.
    """
    steepness = steep(image)
    for even in _EVEN:
        patches = even_patches(steepness < even)
        if len(patches.centre) >= least:
            yield from _lattices_of(patches.centre, patches.area, least, longest)


def steep(image: Array) -> Array:
    """Return the steepness of an image (H, W, C) per pixel, of its steepest channel."""
    channels = [ndimage.gaussian_gradient_magnitude(image[..., c], 1.0) for c in range(image.shape[2])]
    return np.asarray(np.max(channels, axis=0))


def project(homography: Array, points: Array) -> Array:
    """Return points (…, 2) seen through a homography."""
    seen = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ homography.T
    return np.asarray(seen[..., :2] / seen[..., 2:])


def fit_homography(points: Array, seen: Array) -> Array:
    """Return the homography from points (N, 2) to where they are seen, by the direct linear transform."""
    move, moved = _normalising(points), _normalising(seen)
    (x, y), (u, v) = project(move, points).T, project(moved, seen).T
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = np.concatenate([
        np.column_stack([x, y, one, none, none, none, -u * x, -u * y, -u]),
        np.column_stack([none, none, none, x, y, one, -v * x, -v * y, -v]),
    ])  # fmt: skip
    _, vectors = np.linalg.eigh(rows.T @ rows)
    found = np.linalg.inv(moved) @ vectors[:, 0].reshape(3, 3) @ move
    return np.asarray(found / found[2, 2])


def _normalising(points: Array) -> Array:
    centre = points.mean(axis=0)
    scale = 1 / max(float(np.abs(points - centre).mean()), 1e-12)
    return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])


@dataclass(frozen=True)
class EvenPatches:
    """Regions that are filled parallelograms.

    Parameters
    ----------
    centre : ndarray of shape (N, 2)
        Column and row.
    area : ndarray of shape (N,)
    covariance : ndarray of shape (N, 2, 2)
        Of their pixels' columns and rows.
    """

    centre: Array
    area: Array
    covariance: Array


def even_patches(even: NDArray[np.bool_], slim: float = 2.4) -> EvenPatches:
    """Find filled parallelograms among the even pixels, up to `slim` times as long as wide."""
    labels, count = ndimage.label(even)
    label = labels.ravel()
    row, column = (axis.ravel().astype(np.float64) for axis in np.indices(labels.shape))
    area = np.bincount(label, minlength=count + 1).astype(np.float64)
    area[0] = 0
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = (np.bincount(label, axis, count + 1) / area for axis in (column, row))
        xx, yy, xy = (
            np.bincount(label, one * other, count + 1) / area - mean
            for one, other, mean in ((column, column, x * x), (row, row, y * y), (column, row, x * y))
        )
        # Twelve roots of the determinant of a filled parallelogram's covariance are its area.
        filled = area / (12 * np.sqrt(np.maximum(xx * yy - xy * xy, 0)))
        root = np.hypot(xx - yy, 2 * xy)
        longer = (xx + yy + root) / (xx + yy - root)
        good = (
            (area >= _LEAST_PX) & (np.abs(filled - 1) < 0.12) & (longer < slim**2) & (area < labels.size / 12)
        )
    covariance = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-1)
    return EvenPatches(np.column_stack([x, y])[good], area[good], covariance[good])


def _lattices_of(centres: Array, areas: Array, least: int, longest: int) -> Iterator[Lattice]:
    tree = cKDTree(centres)
    _, near = tree.query(centres, min(_NEIGHBOURS + 1, len(centres)))
    seen: set[frozenset[int]] = set()
    used = np.zeros(len(centres), bool)
    for seed in range(len(centres)):
        if used[seed]:
            continue
        alike = [other for other in near[seed][1:] if 0.4 < areas[other] / areas[seed] < 2.5]
        for one, other in combinations(alike, 2):
            across, down = centres[one] - centres[seed], centres[other] - centres[seed]
            cross = across[0] * down[1] - across[1] * down[0]
            if cross < 0:
                across, down, cross = down, across, -cross
            lengths = np.hypot(*across), np.hypot(*down)
            if cross < 0.7 * lengths[0] * lengths[1] or max(lengths) > 1.8 * min(lengths):
                continue
            found = _grow(centres, seed, across, down, least, longest)
            if found is None:
                continue
            lattice, members = found
            if members in seen:
                continue
            seen.add(members)
            used[list(members)] = True
            yield lattice


def _grow(
    centres: Array, seed: int, across: Array, down: Array, least: int, longest: int
) -> tuple[Lattice, frozenset[int]] | None:
    homography = np.column_stack([[*across, 0], [*down, 0], [*centres[seed], 1]])
    reach = 1.5
    members = np.zeros(0, np.intp)
    steps = np.zeros((0, 2))
    for _ in range(longest):
        place = project(np.linalg.inv(homography), centres)
        step = np.rint(place)
        near = (np.abs(place - step).max(axis=1) < _OFF) & (np.abs(step).max(axis=1) <= reach)
        members = np.flatnonzero(near)
        _, first = np.unique(step[members], axis=0, return_index=True)
        members = members[first]
        steps = step[members]
        if len(members) < 4 or np.ptp(steps, axis=0).min() < 1:
            return None
        if len(members) >= 6:
            homography = fit_homography(steps, centres[members])
            if abs(np.linalg.det(homography)) < 1e-9:
                return None
        reach += 1
    if len(members) < least:
        return None
    return Lattice(homography, steps.astype(np.intp)), frozenset(members.tolist())
