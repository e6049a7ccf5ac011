"""What a model leaves over of the photographs, found over a sample of pixels and then put into codes."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.fit.light_process import FADE_DEG, choose_process, compress, hull_of, rounded
from impasto.geometry import Array, Lights
from impasto.residual import ZERO

Values = NDArray[np.float32]

# Coefficients of other pixels may exceed the sample's by this factor before they meet the end of the codes.
_HEADROOM = 4.0

_BLOCK = 4096

# Products of up to so many multiplications OpenBLAS computes on the thread that asks for them.
_ON_ONE_THREAD = 2**18


def left_over(
    measured: Values, radiance: Values, clipped: NDArray[np.bool_], irradiance: Values, toe: float
) -> Values:
    """Return what a model leaves over of photographs, on the scale of `impasto.residual.encode`.

    Parameters
    ----------
    measured, radiance : ndarray of shape (L, N, C), float32
        Relative radiance of the photographs and of the model.
    clipped : ndarray of shape (L, N, C), bool
        Samples that say only that the radiance was at least so large: what is left over of them is at least
        0, and as much as is certain.
    irradiance : ndarray of shape (L, N or 1, C), float32
    toe : float

    Returns
    -------
    ndarray of shape (L, N, C), float32
        0, the model itself, where a sample is missing or the pixel has no fit.
    """
    rest, modelled = measured / irradiance, radiance / irradiance
    # The difference of two `encode`s, in place: this is the dearest step of a fit with a residual.
    for values in (rest, modelled):
        np.maximum(values, np.float32(0.0), out=values)
        values += np.float32(toe)
        np.sqrt(values, out=values)
    rest -= modelled
    if clipped.any():
        np.maximum(rest, 0.0, out=rest, where=clipped)
    rest[~np.isfinite(rest)] = 0.0
    return rest


@dataclass(frozen=True)
class Remainder:
    """How to put what is left over at a pixel into a few codes.

    Parameters
    ----------
    encoder : ndarray of shape (K, L * C), float32
        Codes from samples.
    toe : float
    attributes : dict
        Those of the residual term, for the attributes of a fit; see docs/store.md.
    """

    encoder: Values
    toe: float
    attributes: dict[str, Any]

    def codes(self, rest: Values) -> NDArray[np.uint16]:
        """Return the codes (N, K) of what is left over, (L, N, C)."""
        samples = rest.transpose(1, 0, 2).reshape(rest.shape[1], -1)
        codes = np.clip(np.rint(product(samples, self.encoder.T)), -ZERO, ZERO - 1)
        result: NDArray[np.uint16] = (codes + ZERO).astype(np.uint16)
        return result


def product(samples: Values, table: Values) -> Values:
    """Return samples (P, N) @ table (N, K), on the calling thread alone.

    For callers that keep all processors busy themselves: the threads that a BLAS would add for each product
    take a third of the whole processor time, most of it waiting for each other.
    """
    pixels, count = samples.shape
    rows = max(1, _ON_ONE_THREAD // max(1, count * table.shape[1]))
    whole = pixels // rows * rows
    result = np.empty((pixels, table.shape[1]), np.float32)
    np.matmul(
        samples[:whole].reshape(-1, rows, count),
        table,
        out=result[:whole].reshape(-1, rows, table.shape[1]),
    )
    np.matmul(samples[whole:], table, out=result[whole:])
    return result


def usual_toe(measured: Values) -> float:
    """Return the toe of the encoding for photographs: a hundredth of their mean radiance."""
    return float(f"{max(0.01 * float(np.nanmean(measured)), 1e-6):.3g}")


def find_remainder(rest: Values, lights: Lights, toe: float, components: int) -> Remainder:
    """Choose the Gaussian process of a painting from a sample of its pixels, and its components.

    Parameters
    ----------
    rest : ndarray of shape (L, N, C), float32
        What is left over at the sample; see `left_over`.
    lights : Lights
    toe : float
        Of the encoding.
    components : int
        How many coefficients a pixel may have.
    """
    count, _, channels = rest.shape
    samples, moments = _moments(rest)
    per_light = np.trace(moments, axis1=1, axis2=3) / channels
    process = choose_process(lights.direction, per_light)
    hull = hull_of(lights.direction)
    found = compress(process, hull, moments, components)
    # Components that are not there, where lights are few, have no weight.
    empty = components - len(found.encoder)
    linear = np.pad(found.encoder.reshape(-1, count * channels), ((0, empty), (0, 0)))
    weights = np.pad(found.weights, ((0, empty), (0, 0), (0, 0)))
    largest = np.abs(samples @ linear.T).max(axis=0)
    step = np.array([float(f"{value:.7g}") for value in np.maximum(_HEADROOM * largest / ZERO, 1e-12)])
    encoder = (linear / step[:, None]).astype(np.float32)

    attributes = {
        "components": len(step),
        "zero": ZERO,
        "step": step.tolist(),
        "toe": toe,
        "direction": rounded(lights.direction),
        "length": process.length,
        "noise": process.noise,
        "weights": rounded(weights),
        "hull": rounded(hull),
        "fade": round(float(np.sin(np.radians(FADE_DEG))), 7),
        "kept": round(found.kept, 5),
        "left_out_db": {
            "model": _decibels(np.diag(per_light)),
            "with_residual": _decibels(process.left_out(per_light)),
        },
    }
    return Remainder(encoder, toe, attributes)


def left_out_db(rest: Values, lights: Lights) -> float:
    """Return to how many decibels lights left out one by one are met, by model and process together.

    Parameters
    ----------
    rest : ndarray of shape (L, N, C), float32
        What is left over at a sample; see `left_over`.
    lights : Lights
    """
    _, moments = _moments(rest)
    per_light = np.trace(moments, axis1=1, axis2=3) / rest.shape[2]
    return _decibels(choose_process(lights.direction, per_light).left_out(per_light))


def _moments(rest: Values) -> tuple[Array, Array]:
    """Return samples (N, L * C) of what is left over, and their second moments (L, C, L, C)."""
    count, pixels, channels = rest.shape
    samples = rest.transpose(1, 0, 2).reshape(pixels, -1).astype(np.float64)
    moments = (samples.T @ samples / pixels).reshape(count, channels, count, channels)
    return samples, moments


def _decibels(errors: Array) -> float:
    return round(float(-10.0 * np.log10(errors + 1e-12).mean()), 3)


def in_blocks(count: int, compute: Callable[[slice], NDArray[np.uint16]]) -> NDArray[np.uint16]:
    """Return the codes of `count` pixels, computed in blocks that stay in the cache, on all processors."""
    blocks = [slice(first, min(first + _BLOCK, count)) for first in range(0, count, _BLOCK)]
    with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="residual") as pool:
        return np.concatenate(list(pool.map(compute, blocks)))
