"""A camera's sensor: exposure, noise, clipping, response and quantisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]

EXPOSURE_S = 0.1
"""Exposure time that the files state of the full exposure; only ratios of exposure times have a meaning."""

# Exponents of the ``tone`` response, one per channel: a film-like curve that no standard formula decodes.
_TONE_POWER = (0.80, 0.84, 0.90)
_TONE_KNEE = 0.55


@dataclass(frozen=True)
class Sensor:
    """A sensor and what the camera makes of its signal.

    Parameters
    ----------
    exposure : float
        Signal of a perfect white diffuser that a light of intensity 1 meets along its normal, as a share of
        full scale.
    read, photon : float
        Noise in shares of full scale: variance = read² + photon · signal; photon noise is one over the number
        of electrons at full scale.
    noisy : bool
        Whether any noise is added.
    response : str
        ``linear``, ``srgb``, ``gamma:<number>`` or ``tone``, a curve per channel that has to be measured.
    dtype : str
        ``uint8``, ``uint16``, or ``float32``, which stands for exposures merged without loss: it never clips.
    vignetting : float
        Share of light lost in the image's corners.
    """

    exposure: float = 0.25
    read: float = 1e-4
    photon: float = 1e-5
    noisy: bool = True
    response: str = "linear"
    dtype: str = "uint16"
    vignetting: float = 0.0

    @property
    def full_scale(self) -> float:
        """Stored value at which a sample is clipped; infinite for floats."""
        return float("inf") if self.dtype == "float32" else float(np.iinfo(self.dtype).max)

    def expose(
        self, radiance: NDArray[np.floating], rng: np.random.Generator, ev: float = 0.0
    ) -> NDArray[Any]:
        """Return a photograph.

        Parameters
        ----------
        radiance : ndarray of shape (H, W, C)
            Relative radiance.
        rng : numpy.random.Generator
            The noise.
        ev : float
            Exposure in stops relative to the sensor's.

        Returns
        -------
        ndarray of shape (H, W, C), uint8, uint16 or float32
            Values from 0 to the type's largest; floats in shares of full scale, without end.
        """
        signal = np.asarray(radiance * np.float32(self.exposure * 2.0**ev), dtype=np.float32)
        if self.vignetting:
            signal *= self._vignette(signal.shape[0], signal.shape[1])
        if self.noisy:
            # Photons are counted in thousands here, where a Poisson number is a normal one.
            spread = np.sqrt(np.float32(self.read**2) + np.float32(self.photon) * signal)
            spread *= rng.standard_normal(signal.shape, dtype=np.float32)
            signal += spread
        np.clip(signal, 0, np.inf if self.dtype == "float32" else 1, out=signal)
        if self.dtype == "float32":
            return signal
        encoded = encode(signal, self.response) * np.float32(self.full_scale)
        return np.asarray(np.rint(encoded, out=encoded), dtype=self.dtype)

    def _vignette(self, height: int, width: int) -> Map:
        y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
        return np.asarray(1 - self.vignetting * (x**2 + y**2) / 2, dtype=np.float32)[..., None]


def encode(signal: Map, response: str) -> Map:
    """Return the camera's encoding of a signal of shape (H, W, C), both 0 to 1."""
    if response == "linear":
        return signal
    if response == "srgb":
        curve = 1.055 * np.maximum(signal, 1e-6) ** (1 / 2.4) - 0.055
        return np.where(signal <= 0.0031308, 12.92 * signal, curve).astype(np.float32)
    if response == "tone":
        power = np.resize(np.array(_TONE_POWER, np.float32), signal.shape[-1])
        lifted = signal**power
        return np.asarray(lifted * (1 + _TONE_KNEE) / (lifted + _TONE_KNEE), dtype=np.float32)
    return np.asarray(signal ** np.float32(1 / float(response.removeprefix("gamma:"))), dtype=np.float32)
