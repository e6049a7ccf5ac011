"""The residual term of a fit in 8 bits per coefficient; docs/store.md, section "Published stores"."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.geometry import Array
from impasto.residual import ZERO, ResidualTerm

ROUNDING = 2.0**-11
"""What rounding costs: root mean square on the scale in which the term is added, as long as a pixel's
coefficients are small; an eighth of the step between two values of a display."""

_LARGEST = 127


class PackedResidual:
    """A residual term whose coefficients share one table of 255 values.

    Coefficients have long tails: the table's values lie evenly near 0 and in a constant ratio further out.

    Parameters
    ----------
    attributes : mapping
        Of a fit with a residual term.
    """

    def __init__(self, attributes: Mapping[str, Any]) -> None:
        self._found: Mapping[str, Any] = attributes["residual"]
        term = ResidualTerm.of(attributes)
        assert term is not None
        # Each coefficient moves the sum by its rounding times its function of the light's direction.
        lever = np.sqrt(np.square(term.basis(term.direction)).mean(axis=(0, 2)).sum())
        finest = ROUNDING * np.sqrt(12.0) / max(float(lever), 1e-12)
        upper = _table(finest, ZERO * float(term.step.max()))
        self.table = np.concatenate([[0.0], -upper[:0:-1], upper]).astype(np.float32)
        codes = np.arange(2 * ZERO) - ZERO
        between = (self.table[2:] + self.table[1:-1]) / 2
        # The code of each of the fit's, per component.
        self._codes = np.stack([1 + np.searchsorted(between, codes * step) for step in term.step]).astype(
            np.uint8
        )

    @property
    def components(self) -> int:
        """How many coefficients a pixel has."""
        return len(self._codes)

    @property
    def attributes(self) -> dict[str, Any]:
        """The attribute `residual` of a published model."""
        kept = {key: value for key, value in self._found.items() if key not in ("zero", "step")}
        upper = self.table[_LARGEST + 1 :].astype(np.float64)
        quantisation = {"rounding": ROUNDING, "relative": round(float(upper[-1] / upper[-2] - 1) / 2, 5)}
        return {**kept, "table": self.table.astype(np.float64).tolist(), "quantisation": quantisation}

    def pack(self, codes: NDArray[np.uint16]) -> NDArray[np.uint8]:
        """Return the published codes of those of the fit, both (..., K)."""
        packed = np.empty(codes.shape, np.uint8)
        for component, table in enumerate(self._codes):
            packed[..., component] = table[codes[..., component]]
        return packed


def _table(finest: float, largest: float) -> Array:
    """Return 0 and 127 values from about `finest` up to `largest`: finest · (e^(g i) − 1) / g."""
    number = np.arange(_LARGEST + 1, dtype=np.float64)
    low, high = 1e-6, 1.0
    if finest * _LARGEST >= largest:
        return finest * number
    for _ in range(60):
        growth = (low + high) / 2
        short = finest / growth * np.expm1(growth * _LARGEST) < largest
        low, high = (growth, high) if short else (low, growth)
    values: Array = finest / high * np.expm1(high * number)
    return values
