"""The fixed problem that accuracy and speed are measured on: lights, surfaces and noise, all constants.

40 lights, RGB, one Torrance-Sparrow lobe with Trowbridge-Reitz facets per pixel, c log-uniform from 0.02 to
0.9, noise of 0.5 % + 1e-4. What the figures to beat leave open (lights, tilts, albedo, κ) was searched for
such that the Cramér-Rao bound lies 5 to 35 % under those figures; README.md tells how, and what that means.
The accuracy table prints the bound beside the measurement.

Radiances come from the float64 reference models of the tests, which share no code with the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.reference_models import radiance

MODEL = "torrance-sparrow"
SEED = 2007
BLOCK = 4096
LIGHTS = 40
# Zeniths rise evenly, so that lights stand densest where the mirror directions of a painting's relief lie.
HIGHEST_ZENITH_DEG = 86.0
VIEW_DIRECTION = (0.0, 0.0, 1.0)
INDEX = 1.5
STEEPEST_DEG = 10.0
ALBEDO = (0.15, 0.9)
# κ = 4 c² As, 1 for a smooth interface of that index.
KAPPA = (1.0, 5.0)
C_RANGE = (0.02, 0.9)
# Standard deviation 1e-4 + 0.005 Y, written as read² + photon Y + (relative Y)².
NOISE = (1e-4, 2 * 1e-4 * 0.005, 0.005)


@dataclass(frozen=True)
class Problem:
    """Simulated measurements of N pixels with the truth.

    Parameters
    ----------
    light_direction : ndarray of shape (L, 3)
    radiance : ndarray of shape (L, N, 3), float32
        With noise; (light, pixel, channel) as a stack is decoded.
    radiance_true : ndarray of shape (L, N, 3)
        Without noise.
    normal : ndarray of shape (N, 3)
    diffuse : ndarray of shape (N, 3)
    specular, c : ndarray of shape (N,)
    """

    light_direction: NDArray[np.float64]
    radiance: NDArray[np.float32]
    radiance_true: NDArray[np.float64]
    normal: NDArray[np.float64]
    diffuse: NDArray[np.float64]
    specular: NDArray[np.float64]
    c: NDArray[np.float64]


def light_directions() -> NDArray[np.float64]:
    """Return unit vectors of shape (L, 3) on a golden spiral from the zenith down to `HIGHEST_ZENITH_DEG`."""
    step = np.arange(LIGHTS)
    zenith = np.radians(HIGHEST_ZENITH_DEG) * (step + 0.5) / LIGHTS
    azimuth = step * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], -1)


def noise_sd(radiance: NDArray) -> NDArray[np.float64]:
    """Return the standard deviation of the noise at radiances of any shape."""
    read, photon, relative = NOISE
    return np.sqrt(read**2 + photon * radiance + (relative * radiance) ** 2)


def simulate(pixels: int) -> Problem:
    """Return the first `pixels` pixels of an endless surface, drawn in blocks so that they stay the same."""
    rng = np.random.default_rng(SEED)
    light = light_directions()
    blocks = [_block(rng, light) for _ in range(-(-pixels // BLOCK))]
    normal, diffuse, specular, c, clean, noisy = zip(*blocks, strict=True)
    return Problem(
        light_direction=light,
        radiance=np.concatenate(noisy, axis=1)[:, :pixels].copy(),
        radiance_true=np.concatenate(clean, axis=1)[:, :pixels],
        normal=np.concatenate(normal)[:pixels],
        diffuse=np.concatenate(diffuse)[:pixels],
        specular=np.concatenate(specular)[:pixels],
        c=np.concatenate(c)[:pixels],
    )


def _block(rng: np.random.Generator, light: NDArray[np.float64]) -> tuple[NDArray, ...]:
    tilt = np.radians(STEEPEST_DEG) * np.sqrt(rng.uniform(size=BLOCK))
    azimuth = rng.uniform(0, 2 * np.pi, BLOCK)
    normal = np.stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)], axis=-1)
    diffuse = rng.uniform(*ALBEDO, (BLOCK, 3))
    c = np.exp(rng.uniform(*np.log(C_RANGE), BLOCK))
    specular = np.exp(rng.uniform(*np.log(KAPPA), BLOCK)) / (4 * c**2)
    clean = radiance(
        MODEL,
        normal,
        diffuse,
        specular,
        c,
        light_direction=light,
        view_direction=VIEW_DIRECTION,
        index=INDEX,
    )
    noisy = clean + noise_sd(clean) * rng.standard_normal(clean.shape)
    return normal, diffuse, specular, c, clean, noisy.astype(np.float32)
