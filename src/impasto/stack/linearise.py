"""Turn a photograph's values into the linear values that a stack stores."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import _core
from impasto.capture import Photograph
from impasto.colour import linearisation_table
from impasto.stack.corrections import Corrections

# Relative radiance 1 of photographs that hold integers.
_WHITE = 65535

# A table is applied to this many rows at a time, because numpy widens the codes to 8 bytes on the way.
_SLAB_ROWS = 64


class Linearisation:
    """How the values of a photograph are stored.

    Integers become uint16 with 65535 for relative radiance 1: 16-bit linear values as they are, everything
    else by one table. Floats stay as they are. Where a dark frame or a flat field corrects them, the largest
    uint16 stands for a clipped sample, and relative radiance up to the largest gain is stored below it.

    Parameters
    ----------
    photograph : Photograph
    clip_level : float
        Value, as stored in the photograph, from which on a sample is clipped; infinite where none is.
    corrections : Corrections, optional
    """

    def __init__(
        self, photograph: Photograph, clip_level: float, corrections: Corrections | None = None
    ) -> None:
        corrections = corrections or Corrections()
        self._threshold = clip_level
        self._height = photograph.height
        self.is_float = photograph.dtype.kind == "f"
        self.dtype = np.dtype(np.float32 if self.is_float else np.uint16)
        self.white_level = corrections.white_level
        self._dark, self._gain = corrections.dark(), corrections.gain(photograph.name)
        self._corrects = corrections.touch_pixels
        self._table: NDArray[np.float64] | None = None
        self._codes: NDArray[np.uint16] | None = None
        unit = 1.0 if self.is_float else 1.0 / _WHITE
        if self.is_float:
            self.step = 0.0
            self.clip_level = np.full(photograph.channels, clip_level * corrections.largest_gain)
        else:
            table = corrections.table(photograph)
            if table is None:
                table = linearisation_table(photograph.transfer, photograph.dtype, photograph.icc_profile)
            self.step = float(np.diff(table, axis=0).max())
            codes = np.rint(table * _WHITE).astype(np.uint16)
            first = math.ceil(clip_level) if math.isfinite(clip_level) else len(codes)
            plain = photograph.dtype == np.uint16 and np.array_equal(codes, np.arange(_WHITE + 1))
            if self._corrects:
                unit *= corrections.largest_gain
                self._table = None if plain else np.broadcast_to(table.T, (photograph.channels, len(table)))
                self._per_step = 1 / unit
                level = (_WHITE - 0.5) * unit
            else:
                self._codes = None if plain else codes
                # Half a step below, so that rounding cannot lift a clipped sample out of the range.
                level = (codes[first].astype(np.float64) - 0.5) * unit if first < len(codes) else math.inf
            self.clip_level = np.broadcast_to(level, (photograph.channels,)).astype(np.float64)
        # A white reference says what relative radiance 1 is.
        self.scale = unit / self.white_level
        self.clip_level = self.clip_level / self.white_level
        self.step /= self.white_level

    def _clipped_samples(self, band: NDArray[Any]) -> int:
        if not math.isfinite(self._threshold):
            return int(np.count_nonzero(np.isposinf(band))) if self.is_float else 0
        threshold = self._threshold if self.is_float else math.ceil(self._threshold)
        if not self.is_float and threshold > np.iinfo(band.dtype).max:
            return 0
        return int(np.count_nonzero(band >= band.dtype.type(threshold)))

    def radiance(self, band: NDArray[Any], row0: int) -> NDArray[np.float32]:
        """Return relative radiance of a band, before any white reference, infinite where it is clipped."""
        if self.is_float:
            return self._corrected_floats(band, row0)
        table = self._table
        if table is None and self._codes is not None:
            table = np.broadcast_to(self._codes.T / _WHITE, (band.shape[2], len(self._codes)))
        return self._correct(band, row0, table, None)[0]

    def stored(self, band: NDArray[Any], row0: int = 0) -> tuple[NDArray[Any], int]:
        """Return a band as it is stored, and how many of its samples are clipped.

        Parameters
        ----------
        band : ndarray of shape (rows, W, C)
            As the photograph holds it.
        row0 : int
            Its first row in the photograph.

        Returns
        -------
        values : ndarray of shape (rows, W, C)
            Samples that are not finite are NaN.
        clipped : int
        """
        if self._corrects and not self.is_float:
            return self._correct(band, row0, self._table, self._per_step)
        return self._decoded(band, row0), self._clipped_samples(band)

    def _decoded(self, band: NDArray[Any], row0: int) -> NDArray[Any]:
        if self.is_float:
            band = self._corrected_floats(band, row0) if self._corrects else np.asarray(band, np.float32)
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

    def _correct(
        self, band: NDArray[Any], row0: int, table: NDArray[np.float64] | None, per_step: float | None
    ) -> tuple[NDArray[Any], int]:
        clip = math.ceil(self._threshold) if math.isfinite(self._threshold) else 1 << 16
        return _core.correct(
            np.ascontiguousarray(band, np.uint16),
            row0=row0,
            height=self._height,
            clip=clip,
            table=None if table is None else np.ascontiguousarray(table, np.float32),
            dark=self._dark,
            gain=self._gain,
            per_step=per_step,
        )

    def _corrected_floats(self, band: NDArray[Any], row0: int) -> NDArray[np.float32]:
        radiance = np.array(band, np.float32)
        whole = np.full(band.shape, _WHITE, np.uint16)
        if self._dark is not None:
            # The core's own interpolation, of the dark frame taken from white.
            radiance -= (
                1 - _core.correct(whole, row0=row0, height=self._height, clip=1 << 16, dark=self._dark)[0]
            )
        if self._gain is not None:
            gain, _ = _core.correct(whole, row0=row0, height=self._height, clip=1 << 16, gain=self._gain)
            radiance *= gain
        return radiance


def linearisations(
    photographs: Sequence[Photograph], clip_level: float, corrections: Corrections | None = None
) -> list[Linearisation]:
    """Return how each photograph is stored; those with the same profile and flat field share one table."""
    made: dict[Any, Linearisation] = {}
    found = []
    for photograph in photographs:
        per_light = corrections is not None and "flat" in corrections.files
        key = (photograph.icc_profile, photograph.name if per_light else None)
        if key not in made:
            made[key] = Linearisation(photograph, clip_level, corrections)
        found.append(made[key])
    return found
