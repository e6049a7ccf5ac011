"""The criterion of a capture's lights, from fitted pixels, noise and what the model leaves unexplained."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from impasto.angles.criterion import Criterion
from impasto.fit.information import in_grey, noise_variance, radiance_slopes
from impasto.geometry import Array, Camera, Lights
from impasto.pixels import Pixels, luminance, render_pixels

# Pixels that the choice is made for: their mean varies by a few per cent, and the choice hardly.
MOST = 600


@dataclass(frozen=True)
class Expected:
    """The expected error of renderings, for any set of candidate lights.

    Parameters
    ----------
    criterion : Criterion
        Of which a value is the mean variance of rendered luminance over its squared mean, or that of its
        sRGB value.
    discrepancy : float
        Share of the radiance by which the model misses the photographs beyond their noise.
    floor : float
        Mean square of that discrepancy in the same unit.
    """

    criterion: Criterion
    discrepancy: float
    floor: float

    def rms(self, chosen: tuple[int, ...]) -> float:
        """Return the expected RMS of renderings over the mean radiance, or in sRGB."""
        return float(np.sqrt(self.floor + self.criterion.value(chosen)))


def expect(
    pixels: Pixels,
    lights: Lights,
    camera: Camera,
    noise: tuple[float, float, float],
    clip_level: Array,
    photographs: NDArray[np.float32] | None = None,
    *,
    displayed: bool = False,
) -> Expected:
    """Prepare the criterion for candidate lights, which are the test lights too.

    Parameters
    ----------
    pixels : Pixels
        With all their parameters.
    lights : Lights
        The candidates.
    camera : Camera
    noise : tuple of float
        (read, photon, relative), see `store.Stack.noise`.
    clip_level : ndarray of shape (C,)
        Radiance from which on a sample tells nothing.
    photographs : ndarray of shape (L, P, C), optional
        Of the pixels under the candidates: they tell by how much the model misses them.
    displayed : bool, optional
        Whether renderings are judged as sRGB pictures, in which what is brighter than white counts for
        nothing and shadows for more, instead of by their radiance.

    Notes
    -----
    Everything is in luminance, as if all lights had the same strength. What the model does not describe is
    taken for noise in proportion to the radiance, as much of it as brings the residuals' χ² to the number of
    degrees of freedom.
    """
    rendered = render_pixels(pixels, lights, camera)
    weights = luminance(np.eye(rendered.shape[-1]))
    strength = lights.intensity.mean(axis=1)[:, None]
    variance = noise_variance(rendered.astype(np.float64), noise) @ weights**2 / strength**2
    even = replace(lights, intensity=np.ones((len(lights), 1)))
    level, slopes = radiance_slopes(in_grey(pixels), even, camera)
    level, slopes = level[..., 0], slopes[..., 0, :]
    seen = (rendered < clip_level).all(axis=-1)
    discrepancy = 0.0
    if photographs is not None:
        seen &= np.isfinite(photographs).all(axis=-1) & (photographs < clip_level).all(axis=-1)
        residual = luminance((photographs - rendered) / strength[..., None])
        freedom = 1.0 - slopes.shape[-1] / len(lights)
        discrepancy = _unexplained(residual[seen] ** 2, variance[seen], level.T[seen] ** 2, freedom)
    mean = float(level.mean())
    squared = discrepancy**2 * level**2
    precision = np.where(seen.T, 1 / (variance.T + squared), 0.0)
    per_radiance = _srgb_slope(level) if displayed else np.full_like(level, 1 / mean)
    criterion = Criterion(slopes * np.sqrt(precision)[..., None], slopes * per_radiance[..., None])
    return Expected(criterion, discrepancy, float((squared * per_radiance**2).mean()))


def _srgb_slope(radiance: Array) -> Array:
    """Return the slope of sRGB's encoding [IEC61966-2-1]_, 0 where the display clips."""
    power = 1.055 / 2.4 * np.clip(radiance, 0.0031308, 1.0) ** (1 / 2.4 - 1)
    slope = np.where(radiance <= 0.0031308, 12.92, power)
    return np.where((radiance >= 0) & (radiance <= 1), slope, 0.0)


def _unexplained(squares: Array, variance: Array, level: Array, freedom: float) -> float:
    """Return d with mean(squares / (variance + d² level)) = freedom, or 0 where the noise explains them."""

    def misfit(d: float) -> float:
        return float(np.mean(squares / (variance + d**2 * level + 1e-30)) - freedom)

    if not len(squares) or misfit(0.0) <= 0:
        return 0.0
    from scipy.optimize import brentq

    return float(brentq(misfit, 0.0, 10.0)) if misfit(10.0) < 0 else 10.0
