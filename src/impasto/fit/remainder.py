"""What a model leaves over of the photographs, found over a sample of pixels and then put into codes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import _core
from impasto.fit.light_process import FADE_DEG, choose_process, compress, hull_of, rounded
from impasto.geometry import Array, Lights
from impasto.pixels import Pixels, scene
from impasto.residual import ZERO
from impasto.store import Stack

Values = NDArray[np.float32]

# Coefficients of other pixels may exceed the sample's by this factor before they meet the end of the codes.
_HEADROOM = 4.0


@dataclass(frozen=True)
class Remainder:
    """How to put what is left over at a pixel into a few codes.

    Parameters
    ----------
    encoder : ndarray of shape (K, L * C), float32
        Coefficients from samples.
    toe : float
        Of the encoding.
    attributes : dict
        Those of the residual term, for the attributes of a fit; see docs/store.md.
    """

    encoder: Values
    toe: float
    attributes: dict[str, Any]


def left_over(
    stack: Stack,
    values: NDArray[Any],
    pixels: Pixels,
    lights: Lights,
    toe: float,
    encoder: Values | None = None,
) -> NDArray[Any]:
    """Return what a model leaves over of photographs, on the scale of `impasto.residual.encode`.

    Parameters
    ----------
    stack : Stack
        What `values` mean.
    values : ndarray of shape (L, N, C), uint16 or float32
        The photographs, as stored.
    pixels : Pixels
        The fit.
    lights : Lights
    toe : float
        Of the encoding.
    encoder : ndarray of shape (K, L * C), float32, optional
        Coefficients from samples.

    Returns
    -------
    ndarray of shape (N, L, C), float32
        0, the model itself, where a sample is missing or the pixel has no fit. Of a clipped sample, which
        says only that the radiance was at least so large, what is left over is at least 0, and as much as is
        certain. With `encoder`, the codes of its coefficients instead, (N, K), uint16.
    """
    # As in the fit: without a scale, lengths are in pixels.
    camera = replace(stack.camera, mm_per_px=stack.camera.mm_per_px or 1.0)
    found: NDArray[Any] = _core.left_over(
        scene(pixels, lights, camera),
        np.ascontiguousarray(values),
        scale=stack.scale,
        offset=stack.offset,
        clip_level=stack.clip_level,
        toe=toe,
        encoder=None if encoder is None else np.ascontiguousarray(encoder),
    )
    return found


def usual_toe(measured: Values) -> float:
    """Return the toe of the encoding for photographs: a hundredth of their mean radiance."""
    return float(f"{max(0.01 * float(np.nanmean(measured)), 1e-6):.3g}")


def find_remainder(rest: Values, lights: Lights, toe: float, components: int) -> Remainder:
    """Choose the Gaussian process of a painting from a sample of its pixels, and its components.

    Parameters
    ----------
    rest : ndarray of shape (N, L, C), float32
        What is left over at the sample; see `left_over`.
    lights : Lights
    toe : float
        Of the encoding.
    components : int
        How many coefficients a pixel may have.
    """
    _, count, channels = rest.shape
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
            "model": decibels(np.diag(per_light)),
            "with_residual": decibels(process.left_out(per_light)),
        },
    }
    return Remainder(encoder, toe, attributes)


def left_out_db(rest: Values, lights: Lights) -> float:
    """Return to how many decibels lights left out one by one are met, by model and process together.

    Parameters
    ----------
    rest : ndarray of shape (N, L, C), float32
        What is left over at a sample; see `left_over`.
    lights : Lights
    """
    _, moments = _moments(rest)
    per_light = np.trace(moments, axis1=1, axis2=3) / rest.shape[2]
    return decibels(choose_process(lights.direction, per_light).left_out(per_light))


def _moments(rest: Values) -> tuple[Array, Array]:
    """Return samples (N, L * C) of what is left over, and their second moments (L, C, L, C)."""
    pixels, count, channels = rest.shape
    samples = rest.reshape(pixels, -1).astype(np.float64)
    moments = (samples.T @ samples / pixels).reshape(count, channels, count, channels)
    return samples, moments


def decibels(errors: Array) -> float:
    """Return mean squares (L,) on the residual's scale as decibels, their mean over the lights."""
    return round(float(-10.0 * np.log10(errors + 1e-12).mean()), 3)
