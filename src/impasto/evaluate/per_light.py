"""How well a model describes the photographs that it was fitted to, light by light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impasto.evaluate.criteria import usable_samples
from impasto.geometry import Array
from impasto.pixels import Pixels, render_pixels
from impasto.store import Stack


def light_errors(pixels: Pixels, stack: Stack, radiance: NDArray[np.float32]) -> Array:
    """Return the RMS error of relative radiance over its mean, per light.

    Parameters
    ----------
    pixels : Pixels
    stack : Stack
    radiance : ndarray of shape (L, P, C)
        The pixels as photographed.

    Returns
    -------
    ndarray of shape (L,)
        NaN where a light has no sample that is neither clipped nor missing.
    """
    known = ~pixels.missing
    measured = radiance[:, known]
    usable = usable_samples(stack, measured)
    measured = np.where(usable, measured, np.float32(0.0))
    error = np.where(usable, render_pixels(pixels.select(known), stack.lights, stack.camera) - measured, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        count = usable.sum(axis=(1, 2))
        mean = measured.sum(axis=(1, 2), dtype=np.float64) / count
        rms = np.sqrt(np.square(error, dtype=np.float64).sum(axis=(1, 2)) / count)
        return np.asarray(rms / mean)
