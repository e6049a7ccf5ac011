"""Fit pixels again from some of their photographs, and say how far renderings are from others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.angles.photographed import Photographed
from impasto.colour import encode_srgb
from impasto.evaluate.criteria import usable_samples
from impasto.fit import FitOptions, fit_tile
from impasto.models import ModelSpec
from impasto.pixels import Pixels, luminance, near_positions_mm, pixels_of_maps, render_pixels

# Colour differences take long, and their 95th percentile is known well enough from this many pixels.
_COLOURS = 2000


@dataclass(frozen=True)
class Refit:
    """The joint fit of one model to photographed pixels, from any of their photographs.

    Parameters
    ----------
    model : ModelSpec
    options : FitOptions
    """

    model: ModelSpec
    options: FitOptions

    def __call__(self, pixels: Photographed, lights: Sequence[int]) -> Pixels:
        """Return what a fit from the photographs of some lights finds.

        Parameters
        ----------
        pixels : Photographed
        lights : sequence of int
            Numbers of the photographs.

        Returns
        -------
        Pixels
            A pixel without a fit is NaN.
        """
        stack = pixels.stack
        size = stack.shape[1:3]
        chosen, camera = stack.lights.select(np.asarray(lights, np.intp)), pixels.camera
        maps = fit_tile(
            self.model,
            pixels.radiance[np.asarray(lights, np.intp)],
            lights=chosen,
            camera=camera,
            light_rgb=stack.light_rgb,
            clip_level=stack.clip_level,
            noise=stack.noise,
            position_mm=near_positions_mm(pixels.row, pixels.column, size, chosen, camera),
            options=self.options,
        )
        attributes = {
            "model": self.model.name,
            "light_rgb": stack.light_rgb.tolist(),
            "index_of_refraction": self.options.index,
            "fresnel": self.options.fresnel,
        }
        return pixels_of_maps(attributes, size, pixels.row, pixels.column, maps)


@dataclass(frozen=True)
class Errors:
    """How far renderings are from photographs, and from the renderings of a fit to all of them.

    Parameters
    ----------
    rms : float
        Root mean square of the difference of relative radiance, in luminance as if all lights had the same
        strength, over the photographs' mean.
    psnr_db : float
        Mean over the photographs of their peak signal-to-noise ratio in sRGB.
    ciede2000 : float
        95th percentile of the colour difference between these renderings and those of the fit to all
        photographs, in sRGB.
    """

    rms: float
    psnr_db: float
    ciede2000: float


class Score:
    """Judge fits by the photographs of some lights.

    Parameters
    ----------
    pixels : Photographed
    lights : sequence of int
        Numbers of the photographs.
    """

    def __init__(self, pixels: Photographed, lights: Sequence[int]) -> None:
        self.numbers = list(lights)
        self._lights = pixels.stack.lights.select(np.asarray(lights, np.intp))
        self._camera = pixels.camera
        self._photographs = pixels.radiance[np.asarray(lights, np.intp)]
        self._encoded = encode_srgb(np.nan_to_num(self._photographs))
        self._usable = np.asarray(usable_samples(pixels.stack, self._photographs).all(axis=-1))
        self._strength = self._lights.intensity.astype(np.float32)[:, None]
        self._measured = self._luminance(
            np.where(self._usable[..., None], self._photographs, np.float32(0.0))
        )
        self.samples = int(self._usable.sum())
        self.radiance = float(self._measured.sum(dtype=np.float64))
        step = max(1, len(pixels) // _COLOURS)
        self._few = slice(None, None, step)
        self._reference: NDArray[np.float64] | None = None

    def refer_to(self, reference: Pixels) -> None:
        """Take the fit to all photographs as what colour differences are counted from."""
        self._reference = _lab(self._rendered(reference.select(np.arange(len(reference))[self._few])))

    def rms(self, fitted: Pixels) -> float:
        """Return `Errors.rms` alone."""
        return self._rms(self._rendered(fitted))

    def errors(self, fitted: Pixels) -> Errors:
        """Return all errors."""
        rendered = self._rendered(fitted)
        difference = self._encoded - encode_srgb(rendered)
        squares = np.mean(np.square(difference, dtype=np.float64), axis=(1, 2))
        colour = float("nan")
        if self._reference is not None:
            from skimage.color import deltaE_ciede2000

            away = deltaE_ciede2000(self._reference, _lab(rendered[:, self._few]))
            colour = float(np.percentile(away, 95))
        psnr = float(np.mean(-10 * np.log10(np.maximum(squares, 1e-12))))
        return Errors(self._rms(rendered), psnr, colour)

    def _rendered(self, fitted: Pixels) -> NDArray[np.float32]:
        # A fit that gives up on a pixel renders it black: leaving it out would reward giving up.
        return np.nan_to_num(render_pixels(fitted, self._lights, self._camera), copy=False, nan=0.0)

    def _luminance(self, radiance: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return luminance as if all lights had the same strength, shape (L, P); in float32, for speed."""
        channels = radiance.shape[-1]
        weights = luminance(np.eye(channels)).astype(np.float32) / self._strength[:, 0]
        result: NDArray[np.float32] = (radiance @ weights[..., None])[..., 0]
        return result

    def squares(self, fitted: Pixels) -> float:
        """Return the sum of squared differences that `rms` is made of, over `samples` of sum `radiance`."""
        return self._squares(self._rendered(fitted))

    def _squares(self, rendered: NDArray[np.float32]) -> float:
        residual = self._luminance(rendered) - self._measured
        residual *= self._usable
        return float(np.vdot(residual, residual))

    def _rms(self, rendered: NDArray[np.float32]) -> float:
        if not self.samples or self.radiance <= 0:
            return float("nan")
        return float(np.sqrt(self._squares(rendered) * self.samples) / self.radiance)


def _lab(radiance: NDArray[np.float32]) -> NDArray[np.float64]:
    from skimage.color import rgb2lab

    encoded = encode_srgb(radiance)
    if encoded.shape[-1] != 3:
        encoded = np.repeat(encoded.mean(axis=-1, keepdims=True), 3, axis=-1)
    return np.asarray(rgb2lab(encoded))
