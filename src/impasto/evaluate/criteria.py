"""How well models describe each pixel, and which of them a pixel asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.geometry import Array
from impasto.models import ModelSpec
from impasto.pixels import Pixels, render_pixels
from impasto.store import Stack

HIGHLIGHT_SHARE = 0.1
"""A light counts as a highlight of a pixel where more than this share of the radiance is specular."""


@dataclass(frozen=True)
class Misfit:
    """How far a model is from the photographs of some pixels.

    Parameters
    ----------
    squares : ndarray of shape (2, P)
        Sum of squared residuals of relative radiance under highlights, and elsewhere.
    sums : ndarray of shape (2, P)
        Sum of the radiance there.
    samples : ndarray of shape (2, P)
        Number of samples there.
    criterion : ndarray of shape (P,)
        Bayesian information criterion; lower is better.
    """

    squares: Array
    sums: Array
    samples: Array
    criterion: Array


def unknowns(model: ModelSpec, channels: int, *, coloured: bool) -> int:
    """Return how many numbers a model fits to a pixel, its normal's two among them.

    Parameters
    ----------
    model : ModelSpec
    channels : int
    coloured : bool
        Whether highlights have a colour of their own.
    """
    colour = channels - 1 if coloured else 0
    return 2 + len(model.shape) + model.lobes + channels * (2 if model.ambient else 1) + colour


def usable_samples(stack: Stack, radiance: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return which samples (L, P, C) are neither clipped nor missing."""
    result: NDArray[np.bool_] = np.isfinite(radiance) & (radiance < stack.clip_level)
    return result


def misfit(
    pixels: Pixels, stack: Stack, radiance: NDArray[np.float32], highlight: NDArray[np.bool_]
) -> Misfit:
    """Compare a model with photographs.

    Parameters
    ----------
    pixels : Pixels
    stack : Stack
    radiance : ndarray of shape (L, P, C)
        As photographed.
    highlight : ndarray of shape (L, P)
        Which lights count as highlights.

    Notes
    -----
    The criterion is n ln(χ²/n) + k ln n [Schwarz1978]_, with χ² under the stack's noise model, whose scale is
    taken from the residuals, n samples and k unknowns.
    """
    usable = usable_samples(stack, radiance)
    known = np.where(usable, radiance, np.float32(0.0))
    residual = np.where(usable, render_pixels(pixels, stack.lights, stack.camera) - radiance, np.float32(0.0))
    read, photon, relative = (np.float32(term) for term in stack.noise)
    precision = 1 / (read**2 + (photon + relative**2 * np.maximum(known, 0)) * np.maximum(known, 0))
    chi2 = np.einsum("lpc,lpc,lpc->p", residual, residual, precision).astype(np.float64)
    count = usable.sum(axis=(0, 2))
    n = np.maximum(count, 1)
    free = unknowns(pixels.model, radiance.shape[-1], coloured=pixels.specular_rgb is not None)
    # Radiance as it would be under lights of equal strength.
    residual /= stack.lights.intensity[:, None].astype(np.float32)
    known /= stack.lights.intensity[:, None].astype(np.float32)
    return Misfit(
        squares=_split(np.einsum("lpc,lpc->lp", residual, residual), highlight),
        sums=_split(known.sum(axis=-1), highlight),
        samples=_split(usable.sum(axis=-1), highlight),
        criterion=n * np.log(np.maximum(chi2, 1e-12) / n) + free * np.log(n),
    )


def _split(values: NDArray[Any], highlight: NDArray[np.bool_]) -> Array:
    """Return the sums over the lights (L, P) that are highlights and over the others, shape (2, P)."""
    bright = np.where(highlight, values, 0).sum(axis=0, dtype=np.float64)
    return np.stack([bright, values.sum(axis=0, dtype=np.float64) - bright])


def is_highlight(pixels: Pixels, stack: Stack) -> NDArray[np.bool_]:
    """Return under which lights a pixel shows its highlight, as a model has it, shape (L, P)."""
    whole = render_pixels(pixels, stack.lights, stack.camera).sum(axis=-1)
    matte = pixels.without_highlights()
    diffuse = render_pixels(matte, stack.lights, stack.camera).sum(axis=-1)
    result: NDArray[np.bool_] = whole - diffuse > HIGHLIGHT_SHARE * whole
    return result
