"""Register photographs of one picture under different lights to each other, to a fraction of a pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, spline_filter

from impasto.geometry import Array

# Where all after some photograph lie elsewhere, the prediction follows slowly.
_STEPS = 40
_CONVERGED_PX = 0.005
_LONGEST_STEP_PX = 1.0
# Luminance over its mean enters by the logarithm of it and this: nearly as it is, because only then shading
# adds up from light to light (from a plain logarithm, a plaster seems to move by 0.9 px with the light), but
# highlights count less.
_NEARLY_LINEAR = 4.0
# Detail that is compared: neither noise nor shading that varies slowly.
_FINE_PX, _COARSE_PX = 1.0, 6.0
# Ridge on the prediction of a photograph from the others, relative to a unit variance of each.
_RIDGE = 0.002
# Blocks across and down a part, as long as each has this many pixels.
_BLOCKS, _LEAST_BLOCK_PX = 4, 24
# What spline and filters reach beyond a block.
_REACH_PX = 12
_LEAST_CORRELATION = 0.5
_LEAST_BLOCKS = 3
# What shading that moves with the light adds to the uncertainty: a plaster without any texture seems to move
# by up to 0.26 px, simulated paintings by up to 0.1 px.
_SHADING_PX = 0.1


@dataclass(frozen=True)
class Registration:
    """Where photographs lie.

    Parameters
    ----------
    shift_px : ndarray of shape (L, 2)
        Rows and columns by which the content of each lies off its usual place; NaN where it is not known.
    uncertainty_px : ndarray of shape (L,)
        Standard deviation of a component.
    turn : ndarray of shape (L, 2)
        Scale less 1, and rotation in radians (from the columns towards the rows).
    turned_px : ndarray of shape (L,)
        What the two displace in the corners of the frame; 0 where it is not significant.
    """

    shift_px: Array
    uncertainty_px: Array
    turn: Array
    turned_px: Array


def register(
    parts: Sequence[Sequence[NDArray[np.floating]]], corners: Array, half_diagonal_px: float, start: Array
) -> Registration:
    """Find the shifts of photographs against what the others predict of them.

    Parameters
    ----------
    parts : sequence of sequence of ndarray of shape (rows, columns)
        Per part of the frame and photograph, the luminance.
    corners : ndarray of shape (parts, 2)
        Row and column of each part's first pixel, from the middle of the frame.
    half_diagonal_px : float
        From the middle of the frame to its corners.
    start : ndarray of shape (L, 2)
        First guess: rows and columns, right to a pixel or so.

    Notes
    -----
    What a light shows of a relief is near a linear combination of what others show, so that each photograph
    is compared with its ridge regression on the others, block by block: highlights and shadows that move
    with the light are in the prediction too. The displacement of a block is the Gauss-Newton step of its
    least squares; that of a photograph is the median of its blocks. Repeated, because the others move as
    well. The uncertainty adds up from the scatter of the blocks, from the difference between predictions by
    either half of the others, and from what a relief may still pretend.

    References
    ----------
    [LucasKanade1981]_; [Belhumeur1998]_ for the linear combination.
    """
    details = [[_detail(one) for one in part] for part in parts]
    found = np.array(start, np.float64)
    largest = [min(part[0].shape) / 8 for part in parts]
    lost = np.abs(found).max(axis=1) > min(largest)
    found[lost] = 0
    everyone = np.ones(len(found), bool)
    for _ in range(_STEPS):
        displaced, place = _all_parts(details, corners, found, everyone)
        known = np.isfinite(displaced[..., 0]).sum(axis=1)
        lost |= known < max(_LEAST_BLOCKS, displaced.shape[1] // 4)
        step = _medians(displaced)
        step[lost] = 0
        found += np.clip(step, -_LONGEST_STEP_PX, _LONGEST_STEP_PX)
        lost |= np.abs(found).max(axis=1) > min(largest)
        found[lost] = 0
        if lost.all() or np.abs(step[~lost] - np.median(step[~lost], axis=0)).max() < _CONVERGED_PX:
            break
        found[~lost] -= np.median(found[~lost], axis=0)
    halves = [np.arange(len(found)) % 2 == half for half in (0, 1)]
    one, two = (_medians(_all_parts(details, corners, found, half)[0]) for half in halves)
    by_half = np.hypot(*(one - two).T) / 2
    lost |= np.isnan(by_half)
    turns, turned = np.zeros_like(found), np.zeros(len(found))
    uncertainty = np.full(len(found), np.nan)
    for photograph in np.flatnonzero(~lost):
        there = np.isfinite(displaced[photograph, :, 0])
        offsets = displaced[photograph, there] - step[photograph]
        # The median's standard error, from the median absolute deviation of a normal distribution.
        scatter = 1.4826 * np.median(np.abs(offsets - np.median(offsets, axis=0)), axis=0)
        error = 1.2533 * float(np.hypot(*scatter)) / np.sqrt(2 * len(offsets))
        uncertainty[photograph] = np.linalg.norm([error, by_half[photograph], _SHADING_PX])
        turns[photograph], turned[photograph] = _turn(offsets, place[there], half_diagonal_px)
    found[lost] = np.nan
    if not lost.all():
        found -= _usual(found[~lost])
    return Registration(found, uncertainty, turns, turned)


def _medians(displaced: Array) -> Array:
    """Return the median displacement of each photograph, NaN where no block tells one."""
    medians = np.full((len(displaced), 2), np.nan)
    known = np.isfinite(displaced[..., 0]).any(axis=1)
    medians[known] = np.nanmedian(displaced[known], axis=1)
    return medians


def _all_parts(
    parts: Sequence[Sequence[NDArray[np.float32]]],
    corners: Array,
    found: Array,
    others: NDArray[np.bool_],
) -> tuple[Array, Array]:
    """Return what is left of the shifts in the blocks of all parts, and their places in the frame."""
    made = [_displacements(details, found, others) for details in parts]
    places = [centres + corner for (_, centres), corner in zip(made, corners, strict=True)]
    return np.concatenate([displaced for displaced, _ in made], axis=1), np.concatenate(places)


def _usual(shifts: Array) -> Array:
    """Return the place where most photographs lie: those that lie there need not be shifted."""
    near = np.linalg.norm(shifts[:, None] - shifts, axis=-1) < 3 * _SHADING_PX
    return np.asarray(shifts[near[near.sum(axis=1).argmax()]].mean(axis=0))


def _displacements(
    details: Sequence[NDArray[np.float32]], found: Array, others: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return what is left of the shifts in each block of a part, and the blocks' middles.

    Parameters
    ----------
    details : sequence of ndarray of shape (rows, columns)
        As `_detail` returns them.
    found : ndarray of shape (L, 2)
        Shifts so far.
    others : ndarray of shape (L,), bool
        Those to predict from.

    Returns
    -------
    displaced : ndarray of shape (L, blocks, 2)
        Rows and columns, NaN where the block shows too little.
    centres : ndarray of shape (blocks, 2)
    """
    detail = np.array([_shifted(one, at) for one, at in zip(details, found, strict=True)])
    down, across = np.gradient(detail, axis=(1, 2))
    margin = _REACH_PX + int(np.ceil(np.abs(found).max()))
    rows, columns = (_edges(length, margin) for length in detail.shape[1:])
    displaced, centres = [], []
    for top, bottom in pairwise(rows):
        for left, right in pairwise(columns):
            block = (slice(None), slice(top, bottom), slice(left, right))
            one, by_row, by_column = (
                image[block].reshape(len(detail), -1) for image in (detail, down, across)
            )
            displaced.append(_block(one, by_row, by_column, others))
            centres.append(((top + bottom) / 2, (left + right) / 2))
    return np.stack(displaced, axis=1), np.array(centres)


def _detail(luminance: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the detail of a part that is compared, as the coefficients of its cubic spline."""
    level = np.log(np.maximum(luminance, 0) / max(float(luminance.mean()), 1e-9) + _NEARLY_LINEAR)
    fine = gaussian_filter(level, _FINE_PX)
    return np.asarray(spline_filter(fine - gaussian_filter(fine, _COARSE_PX), order=3, output=np.float32))


def _shifted(coefficients: NDArray[np.float32], off: Array) -> NDArray[np.float32]:
    """Return a part shifted back by rows and columns, from the coefficients of its cubic spline."""
    for axis, distance in enumerate(off):
        whole = int(np.floor(distance))
        part = distance - whole
        rest = 1 - part
        weights = (
            rest**3 / 6,
            (4 - 6 * part**2 + 3 * part**3) / 6,
            (4 - 6 * rest**2 + 3 * rest**3) / 6,
            part**3 / 6,
        )
        size = coefficients.shape[axis]
        beyond = [(0, 0), (0, 0)]
        beyond[axis] = (abs(whole) + 2,) * 2
        padded = np.pad(coefficients, beyond, mode="edge")
        coefficients = np.zeros_like(coefficients)
        for number, weight in enumerate(weights):
            start = abs(whole) + 2 + whole - 1 + number
            taken = padded[start : start + size] if axis == 0 else padded[:, start : start + size]
            coefficients += np.float32(weight) * taken
    return coefficients


def _edges(length: int, margin: int) -> list[int]:
    inner = max(length - 2 * margin, 1)
    blocks = int(np.clip(inner // _LEAST_BLOCK_PX, 1, _BLOCKS))
    return [round(edge) for edge in np.linspace(margin, margin + inner, blocks + 1)]


def _block(detail: Array, down: Array, across: Array, others: NDArray[np.bool_]) -> Array:
    """Return the displacement of each photograph in one block, ndarray of shape (L, 2).

    Parameters
    ----------
    detail, down, across : ndarray of shape (L, N)
        The photographs, and their derivatives.
    others : ndarray of shape (L,), bool
        Those to predict from.
    """
    size = np.sqrt(np.mean(detail**2, axis=1, keepdims=True))
    blank = size[:, 0] < 1e-6
    detail, down, across = (image / np.maximum(size, 1e-6) for image in (detail, down, across))
    weights = _weights(detail @ detail.T / detail.shape[1], others).astype(np.float32)
    predicted, by_row, by_column = weights @ detail, weights @ down, weights @ across
    left = detail - predicted
    rr, rc, cc = (
        (a * b).sum(axis=1) for a, b in ((by_row, by_row), (by_row, by_column), (by_column, by_column))
    )
    r, c = -(by_row * left).sum(axis=1), -(by_column * left).sum(axis=1)
    determinant = rr * cc - rc**2
    correlation = (predicted * detail).sum(axis=1) / np.sqrt(
        np.maximum((predicted**2).sum(axis=1) * detail.shape[1], 1e-12)
    )
    unknown = blank | (correlation < _LEAST_CORRELATION) | (determinant <= 1e-4 * (rr + cc) ** 2)
    determinant = np.where(unknown, 1.0, determinant)
    displaced = np.column_stack([(cc * r - rc * c) / determinant, (rr * c - rc * r) / determinant])
    displaced[unknown] = np.nan
    return displaced


def _weights(gram: Array, others: NDArray[np.bool_]) -> Array:
    """Return the ridge regression of each photograph on some, never on itself, from all products.

    Parameters
    ----------
    gram : ndarray of shape (L, L)
    others : ndarray of shape (L,), bool
        Those to predict from.
    """
    count = int(others.sum())
    inverse = np.linalg.inv(gram[np.ix_(others, others)] + _RIDGE * count * np.eye(count))
    weights = np.zeros(gram.shape)
    weights[:, others] = gram[:, others] @ inverse
    # Those that are among them are left out one by one, which the inverse tells at once.
    weights[np.ix_(others, others)] = -inverse / np.diag(inverse)[:, None]
    np.fill_diagonal(weights, 0.0)
    return weights


def _turn(offsets: Array, place: Array, half_diagonal_px: float) -> tuple[Array, float]:
    """Return scale less 1 and rotation of a photograph, and what they displace in the corners.

    Parameters
    ----------
    offsets, place : ndarray of shape (N, 2)
        Displacement of each block, and its place: rows and columns from the middle of the frame.
    half_diagonal_px : float
    """
    centred = place - place.mean(axis=0)
    if len(offsets) < 2 * _LEAST_BLOCKS or not centred.any():
        return np.zeros(2), 0.0
    row, column = centred.T
    # (row, column) is displaced by scale times itself, and by rotation times (column, -row).
    design = np.stack([np.stack([row, column], axis=-1), np.stack([column, -row], axis=-1)], axis=1)
    used = np.ones(len(offsets), bool)
    turn, error = np.zeros(2), np.inf
    for _ in range(3):
        wanted = offsets - np.median(offsets[used], axis=0)
        turn = np.linalg.lstsq(design[used].reshape(-1, 2), wanted[used].ravel(), rcond=None)[0]
        left = np.hypot(*(wanted - design @ turn).T)
        used = left <= max(3 * float(np.median(left)), 1e-9)
        error = float(np.sqrt(np.mean(left[used] ** 2) / np.sum(centred[used] ** 2)))
    moved = float(np.hypot(*turn)) * half_diagonal_px
    return turn, moved if moved > 4 * error * half_diagonal_px else 0.0
