"""Turn a photograph's values into the linear values that a stack stores."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture import Photograph
from impasto.colour import linearisation_table

# Relative radiance 1 of photographs that hold integers.
_WHITE = 65535

# A table is applied to this many rows at a time, because numpy widens the codes to 8 bytes on the way.
_SLAB_ROWS = 64


class Linearisation:
    """How the values of a photograph are stored.

    Integers become uint16 with 65535 for relative radiance 1: 16-bit linear values as they are, everything
    else by one table. Floats stay as they are.

    Parameters
    ----------
    photograph : Photograph
    clip_level : float
        Value, as stored in the photograph, from which on a sample is clipped; infinite where none is.
    """

    def __init__(self, photograph: Photograph, clip_level: float) -> None:
        self._threshold = clip_level
        self.is_float = photograph.dtype.kind == "f"
        self.dtype = np.dtype(np.float32 if self.is_float else np.uint16)
        self.scale = 1.0 if self.is_float else 1.0 / _WHITE
        self._codes: NDArray[np.uint16] | None = None
        if self.is_float:
            self.step = 0.0
            self.clip_level = np.full(photograph.channels, clip_level)
            return
        table = linearisation_table(photograph.transfer, photograph.dtype, photograph.icc_profile)
        codes = np.rint(table * _WHITE).astype(np.uint16)
        self.step = float(np.diff(table, axis=0).max())
        if not (photograph.dtype == np.uint16 and np.array_equal(codes, np.arange(_WHITE + 1))):
            self._codes = codes
        first = math.ceil(clip_level) if math.isfinite(clip_level) else len(codes)
        # Half a step below, so that rounding cannot lift a clipped sample out of the range.
        level = (codes[first].astype(np.float64) - 0.5) * self.scale if first < len(codes) else math.inf
        self.clip_level = np.broadcast_to(level, (photograph.channels,)).astype(np.float64)

    def clipped_samples(self, band: NDArray[Any]) -> int:
        """Return how many samples of a band (rows, W, C), as the photograph holds them, are clipped."""
        if not math.isfinite(self._threshold):
            return int(np.count_nonzero(np.isposinf(band))) if self.is_float else 0
        threshold = self._threshold if self.is_float else math.ceil(self._threshold)
        if not self.is_float and threshold > np.iinfo(band.dtype).max:
            return 0
        return int(np.count_nonzero(band >= band.dtype.type(threshold)))

    def __call__(self, band: NDArray[Any]) -> NDArray[Any]:
        """Return a band of shape (rows, W, C) as it is stored; samples that are not finite become NaN."""
        if self.is_float:
            band = np.asarray(band, np.float32)
            missing = ~np.isfinite(band)
            return np.where(missing, np.float32(np.nan), band) if missing.any() else band
        codes = self._codes
        if codes is None:
            return band
        stored = np.empty(band.shape, np.uint16)
        for row in range(0, band.shape[0], _SLAB_ROWS):
            slab = slice(row, row + _SLAB_ROWS)
            if codes.ndim == 1:
                stored[slab] = codes[band[slab]]
            else:
                for channel in range(band.shape[2]):
                    stored[slab, :, channel] = codes[band[slab, :, channel], channel]
        return stored


def linearisations(photographs: Sequence[Photograph], clip_level: float) -> list[Linearisation]:
    """Return how each photograph is stored; those with the same profile share one table."""
    made: dict[bytes | None, Linearisation] = {}
    for photograph in photographs:
        if photograph.icc_profile not in made:
            made[photograph.icc_profile] = Linearisation(photograph, clip_level)
    return [made[photograph.icc_profile] for photograph in photographs]
