"""A Gaussian process over light direction, shared by all pixels, and few functions in its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from impasto.geometry import Array, dome_direction
from impasto.residual import kernel

_LENGTHS = 0.1 * 2.0 ** (np.arange(9) / 2)
NOISES = 10.0 ** np.arange(-2.0, 0.51, 0.5)
"""Variances of the noise, over that of a process, that are tried: from a hundredth to three."""

# Beyond the outermost lights the term fades over 10 degrees: about the distance between the lights of a dome.
FADE_DEG = 10.0

_GRID = 500


@dataclass(frozen=True)
class LightProcess:
    """A Gaussian process over unit vectors, of unit variance and zero mean.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
        Of the lights that were seen.
    length : float
        Length of the kernel.
    noise : float
        Variance of the noise over that of the process.
    """

    direction: Array
    length: float
    noise: float

    def gram(self) -> Array:
        """Return the covariance of samples, shape (L, L), with the noise."""
        return kernel(self.direction, self.direction, self.length) + self.noise * np.eye(len(self.direction))

    def left_out(self, moments: Array) -> Array:
        """Return the mean square error at each light, predicted from all others; see `left_out`."""
        return left_out(self.gram(), moments)


def left_out(gram: Array, moments: Array) -> Array:
    """Return the mean square error of a Gaussian process at each light, predicted from all others.

    Parameters
    ----------
    gram : ndarray of shape (L, L)
        Covariance of samples at the lights, with the noise.
    moments : ndarray of shape (L, L)
        Second moments of the samples over all pixels.

    Returns
    -------
    ndarray of shape (L,)

    Notes
    -----
    Left out by one, a sample's error is [K⁻¹ r]ᵢ / [K⁻¹]ᵢᵢ ([Rasmussen2006]_, eq. 5.12), so that the mean
    over pixels needs their second moments alone.
    """
    inverse = np.linalg.inv(gram)
    result: Array = ((inverse @ moments) * inverse).sum(axis=1) / np.diag(inverse) ** 2
    return result


def choose_process(direction: Array, moments: Array) -> LightProcess:
    """Return the process that predicts each light best from the others, by the geometric mean of the errors.

    The geometric mean is the mean in decibels: it weighs lights near the highlight, where errors are large,
    like all others.
    """
    processes = usual_processes(direction)
    errors = [np.log(process.left_out(moments) + 1e-12).mean() for process in processes]
    return processes[int(np.argmin(errors))]


def usual_processes(direction: Array) -> list[LightProcess]:
    """Return the processes that are tried: lengths from 0.1 to 1.6, noise from a hundredth to three times."""
    return [LightProcess(direction, length, noise) for length in _LENGTHS for noise in NOISES]


@dataclass(frozen=True)
class Components:
    """The few functions of the light's direction that keep most of a process.

    Parameters
    ----------
    encoder : ndarray of shape (K, L, C)
        Coefficients of a pixel are its sums with the pixel's samples.
    weights : ndarray of shape (K, C, L)
        Function k in channel c is the sum over the lights of weight times kernel.
    kept : float
        Share of the process's variance, within the hull of the lights, that they keep.
    """

    encoder: Array
    weights: Array
    kept: float


def compress(process: LightProcess, hull: Array, moments: Array, count: int) -> Components:
    """Return the principal components of the predictions of a process within the hull of the lights.

    Parameters
    ----------
    process : LightProcess
    hull : ndarray of shape (F, 3)
        As `hull_of` returns it.
    moments : ndarray of shape (L, C, L, C)
        Second moments of samples over all pixels.
    count : int
        K, the most that is wanted.

    Notes
    -----
    With predictions f = H r at directions spread evenly over the hull, and S the samples' second moments, the
    components are the eigenvectors of H S Hᵀ, computed in the smaller space of the samples. Between those
    directions a component is what the process says that its coefficient lets expect.
    """
    lights, channels = moments.shape[:2]
    inverse = np.linalg.inv(process.gram())
    where = np.concatenate([_spread(hull), process.direction])
    predict = kernel(where, process.direction, process.length) @ inverse
    metric = np.kron(predict.T @ predict, np.eye(channels))
    flat = moments.reshape(lights * channels, -1)
    values, vectors = np.linalg.eigh(flat)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    variance, axes = np.linalg.eigh(root.T @ metric @ root)
    variance, axes = variance[::-1], axes[:, ::-1]
    count = int(min(count, (variance > 1e-10 * max(variance[0], 1e-30)).sum()))
    total = float(np.maximum(variance, 0.0).sum())
    kept = float(variance[:count].sum()) / total if total > 0 else 1.0
    variance, axes = variance[:count], axes[:, :count]
    half = root @ axes
    encoder = (metric @ half / np.sqrt(variance)).T.reshape(count, lights, channels)
    expected = (half / np.sqrt(variance)).reshape(lights, channels, count)
    return Components(encoder, np.einsum("nl,lck->kcn", inverse, expected), kept)


def hull_of(direction: Array) -> Array:
    """Return the sides of the convex cone of directions (L, 3): unit vectors (F, 3) that point into it."""
    values = np.linalg.svd(direction, full_matrices=True)
    across = values[2]
    if len(direction) < 3 or values[1][-1] < 1e-6 * values[1][0]:
        return _arc(direction, across[-1])
    sides = []
    for corner in direction:
        # A plane through two lights is a side if no light lies beyond it. (scipy takes a second to import.)
        normal = np.cross(corner, direction)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = normal[length[:, 0] > 1e-9] / length[length > 1e-9, None]
        sides.append(normal[(normal @ direction.T > -1e-9).all(axis=1)])
    return np.unique(np.round(np.concatenate(sides), 9), axis=0)


def _arc(direction: Array, across: Array) -> Array:
    """Return the sides of lights in one plane: the plane's two, and one at each end."""
    middle = direction.mean(axis=0)
    middle /= np.linalg.norm(middle)
    along = np.cross(across, middle)
    angle = np.arctan2(direction @ along, direction @ middle)
    ends = [
        sign * (np.sin(end) * middle - np.cos(end) * along)
        for sign, end in ((1.0, angle.max()), (-1.0, angle.min()))
    ]
    return np.stack([across, -across, *ends])


def _spread(hull: Array) -> Array:
    """Return directions spread evenly over the part of the hemisphere within a hull, by a golden spiral."""
    number = np.arange(_GRID) + 0.5
    grid = dome_direction(np.arccos(1.0 - number / _GRID), number * np.pi * (3.0 - np.sqrt(5.0)))
    inside: Array = grid[(grid @ hull.T >= 0.0).all(axis=1)]
    return inside


def rounded(values: Array, digits: int = 7) -> list[Sequence[float] | float]:
    """Return numbers as nested lists for JSON, with a few digits each."""
    digit = np.vectorize(lambda value: float(f"{value:.{digits}g}"), otypes=[float])
    result: list[Sequence[float] | float] = digit(values).tolist()
    return result
