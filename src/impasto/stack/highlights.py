"""Separate the highlights of pixels from their diffuse reflection, without a model of the lobe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS = 7

# Samples of fewer lights than this do not show what is diffuse: three unknowns, and some to disagree.
_LEAST_LIGHTS = 6

# A sample belongs to a highlight if it exceeds the diffuse prediction by this share of it, and the pixel's
# typical brightness by the other; weaker ones tell more about the paint than about the light.
_STRONG = 0.5
_STRONG_OF_TYPICAL = 0.2


@dataclass(frozen=True)
class Highlights:
    """The highlights of pixels that have one.

    Parameters
    ----------
    excess : ndarray of shape (N, C), float64
        What the pixel's brightest samples have above their diffuse part, summed; above 0.
    diffuse : ndarray of shape (N, C), float64
        The diffuse part of the same samples, summed; above 0.
    """

    excess: Array
    diffuse: Array


def separate(radiance: Array, usable: NDArray[np.bool_], light: Array, read_noise: float) -> Highlights:
    """Find the highlights of pixels.

    Parameters
    ----------
    radiance : ndarray of shape (N, L, C), float64
        Relative radiance per pixel and light, divided by the light's intensity.
    usable : ndarray of shape (N, L), bool
        Samples that are neither clipped nor missing.
    light : ndarray of shape (N or 1, L, 3), float64
        Direction towards each light, times its relative irradiance.
    read_noise : float
        Standard deviation of dark samples.

    Returns
    -------
    Highlights

    Notes
    -----
    The diffuse part is Lambert's law fitted to the samples by weighted least squares; samples that a first
    fit finds too bright (highlights) or too dark (shadows) lose their weight. All channels share the weights,
    so that the prediction under a light is the same linear combination of samples in each channel: exact for
    a matte surface of any normal and colour. What is left of a lobe among the samples then takes something
    off the excess, but does not change its colour.
    """
    usable = usable & (usable.sum(axis=1, keepdims=True) >= _LEAST_LIGHTS)
    radiance = np.where(usable[..., None], radiance, 0.0)
    mean = np.full(radiance.shape[2], 1 / radiance.shape[2])
    brightness = radiance @ mean
    count = np.maximum(usable.sum(axis=1), 1)
    # Samples that are left out sort first, so the middle of the others lies half their number from the end.
    middle = brightness.shape[1] - 1 - count // 2
    pixels = np.arange(len(brightness))
    typical = np.sort(np.where(usable, brightness, -np.inf), axis=1)[pixels, middle]
    typical = np.where(np.isfinite(typical), typical, 0.0)[:, None]
    weight = usable.astype(np.float64)
    light = np.ascontiguousarray(light.swapaxes(1, 2))  # numpy is slow along short axes
    for _ in range(_STEPS):
        shading = _lambert(brightness[..., None], weight, light)[..., 0]
        error = brightness - shading
        size = np.sort(np.where(usable, np.abs(error), -np.inf), axis=1)[pixels, middle][:, None]
        scale = np.clip(1.5 * size, 0.01 * typical + read_noise, 0.1 * typical + 2 * read_noise)
        lit = usable & (shading > 0.05 * typical)
        weight = np.where(lit, 1.0 / (1.0 + (error / (2 * scale)) ** 2) ** 2, 0.0)
    prediction = _lambert(radiance, weight, light)
    shading = prediction @ mean
    excess = radiance - prediction
    strength = excess @ mean
    bright = (
        usable
        & (strength > _STRONG * np.maximum(shading, 0.0))
        & (strength > _STRONG_OF_TYPICAL * typical)
        & (strength > 10.0 * read_noise)
        & (shading > 0.02 * typical)
    )
    excess = (excess * bright[..., None]).sum(axis=1)
    diffuse = (prediction * bright[..., None]).sum(axis=1)
    found = bright.any(axis=1) & (excess > 0).all(axis=1) & (diffuse > 0).all(axis=1)
    return Highlights(excess[found], diffuse[found])


def _lambert(radiance: Array, weight: Array, light: Array) -> Array:
    """Return Lambert's law, fitted to pixels (N, L, C) with weights (N, L), under lights (N or 1, 3, L)."""
    weighted = light * weight[:, None]
    normal_matrix = weighted @ light.swapaxes(1, 2)
    # Lights in one plane leave a direction open, which their own predictions do not need.
    ridge = 1e-6 * np.trace(normal_matrix, axis1=1, axis2=2) + 1e-12
    normal_matrix += ridge[:, None, None] * np.eye(3)
    prediction: Array = light.swapaxes(1, 2) @ np.linalg.solve(normal_matrix, weighted @ radiance)
    return prediction
