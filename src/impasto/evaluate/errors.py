"""Differences between a photograph and its rendering, gathered band by band.

A band is a block of whole rows. Whatever the painting's size, only a band and the few rows of its margin are
in memory; the result is the one that the whole images would give.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

WINDOW = 7
"""Side in pixels of the square over which SSIM compares; scikit-image's default."""

_MARGIN = WINDOW // 2

# Colour differences cost far more than the rest, and their mean needs no more pixels.
_COLOUR_PIXELS = 40_000


@dataclass(frozen=True)
class ImageErrors:
    """How far a rendering is from the photograph taken under the same light.

    Parameters
    ----------
    psnr_db : float
        Peak signal-to-noise ratio of the sRGB images in decibels; infinite for equal images.
    ssim : float
        Mean structural similarity of the sRGB images, averaged over the channels.
    rms_relative : float
        Root mean square of the difference of relative radiance, divided by the photograph's mean.
    compared : float
        Share of the photograph's samples that `rms_relative` compares: neither clipped nor missing, and
        predicted by the fit.
    predicted : float
        Share of the pixels for which the fit gives a prediction.
    ciede2000 : float
        Mean colour difference ΔE00 [Sharma2005]_ of the sRGB images, over pixels on a regular grid.
    """

    psnr_db: float
    ssim: float
    rms_relative: float
    compared: float
    predicted: float
    ciede2000: float = float("nan")


def mean_errors(errors: Sequence[ImageErrors]) -> ImageErrors:
    """Return the mean of each of the errors, at least one, over images."""
    return ImageErrors(
        **{
            field.name: float(np.mean([getattr(entry, field.name) for entry in errors]))
            for field in fields(ImageErrors)
        }
    )


class ErrorAccumulator:
    """Gather `ImageErrors` from bands of a photograph and its rendering, top to bottom.

    Parameters
    ----------
    height, width, channels : int
        Size of the images.

    Notes
    -----
    Pixels without a prediction count as black in the sRGB comparison: a model that gives up on the difficult
    pixels must not look better for it. Clipped samples are left out of the radiance comparison, where their
    true value is unknown, and kept in the sRGB one, where they are white.

    References
    ----------
    SSIM is that of [Wang2004]_, with a uniform window and the sample covariance.
    """

    def __init__(self, height: int, width: int, channels: int) -> None:
        self._shape = (height, width, channels)
        self._colour_step = max(1, math.isqrt(height * width // _COLOUR_PIXELS))
        self._colour_sum, self._colour_count = 0.0, 0
        self._row = 0
        self._squares_srgb = 0.0
        self._squares = 0.0
        self._sum = 0.0
        self._compared = 0
        self._predicted = 0
        self._ssim_sum = 0.0
        self._margin: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None

    def add(
        self,
        photograph: NDArray[np.float32],
        rendering: NDArray[np.float32],
        photograph_srgb: NDArray[np.float32],
        rendering_srgb: NDArray[np.float32],
        clipped: NDArray[np.bool_],
    ) -> None:
        """Take in the next band.

        Parameters
        ----------
        photograph, rendering : ndarray of shape (rows, W, C), float32
            Relative radiance; NaN where the photograph has no sample or the fit no prediction.
        photograph_srgb, rendering_srgb : ndarray of shape (rows, W, C), float32
            The same, encoded as sRGB from 0 to 1; NaN counts as 0.
        clipped : ndarray of shape (rows, W, C), bool
            Samples of the photograph at or above the clip level.
        """
        rows = photograph.shape[0]
        predicted = np.isfinite(rendering)
        usable = predicted & np.isfinite(photograph) & ~clipped
        difference = np.where(usable, rendering, 0).astype(np.float64) - np.where(usable, photograph, 0)
        self._squares += float(np.square(difference).sum())
        self._sum += float(photograph[usable].sum(dtype=np.float64))
        self._compared += int(usable.sum())
        self._predicted += int(predicted.all(axis=-1).sum())

        first, second = np.nan_to_num(photograph_srgb), np.nan_to_num(rendering_srgb)
        self._squares_srgb += float(np.square(first.astype(np.float64) - second).sum())
        self._add_ssim(first, second)
        self._add_colour(first, second)
        self._row += rows

    def _add_colour(self, first: NDArray[np.float32], second: NDArray[np.float32]) -> None:
        from skimage.color import deltaE_ciede2000, rgb2lab

        step = self._colour_step
        grid = (slice(-self._row % step, None, step), slice(None, None, step))
        images = [np.broadcast_to(image[grid], (*image[grid].shape[:2], 3)) for image in (first, second)]
        if images[0].size:
            difference = deltaE_ciede2000(*(rgb2lab(image) for image in images))
            self._colour_sum += float(difference.sum())
            self._colour_count += difference.size

    def _add_ssim(self, first: NDArray[np.float32], second: NDArray[np.float32]) -> None:
        """Sum SSIM over the windows that this band completes, keeping the rows that the next one needs."""
        from skimage.metrics import structural_similarity

        if self._margin is not None:
            first = np.concatenate([self._margin[0], first])
            second = np.concatenate([self._margin[1], second])
        self._margin = (first[-2 * _MARGIN :].copy(), second[-2 * _MARGIN :].copy())
        if first.shape[0] < WINDOW or first.shape[1] < WINDOW:
            return
        _, full = structural_similarity(
            first, second, win_size=WINDOW, data_range=1.0, channel_axis=-1, full=True
        )
        self._ssim_sum += float(full[_MARGIN:-_MARGIN, _MARGIN:-_MARGIN].sum(dtype=np.float64))

    def result(self) -> ImageErrors:
        """Return the errors of the whole image, NaN where nothing could be compared.

        Returns
        -------
        ImageErrors

        Raises
        ------
        ValueError
            If rows are missing.
        """
        height, width, channels = self._shape
        if self._row != height:
            raise ValueError(f"{self._row} of {height} rows were added")
        samples = height * width * channels
        mean_square = self._squares_srgb / samples
        windows = max(height - 2 * _MARGIN, 0) * max(width - 2 * _MARGIN, 0) * channels
        rms = np.sqrt(self._squares / self._compared) if self._compared else np.nan
        mean = self._sum / self._compared if self._compared else np.nan
        return ImageErrors(
            psnr_db=float(-10 * np.log10(mean_square)) if mean_square > 0 else float("inf"),
            ssim=self._ssim_sum / windows if windows else float("nan"),
            rms_relative=float(rms / mean) if mean > 0 else float("nan"),
            compared=self._compared / samples,
            predicted=self._predicted / (height * width),
            ciede2000=self._colour_sum / self._colour_count if self._colour_count else float("nan"),
        )
