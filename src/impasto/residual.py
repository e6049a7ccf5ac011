"""What a model leaves over of the photographs, as a smooth function of the light's direction per pixel.

docs/store.md specifies the numbers; why they are what they are says docs/decisions/0009-residual-term.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.direction_table import look_up
from impasto.geometry import Array

Values = NDArray[np.float32]

ZERO = 32768
"""Code of the coefficient 0: a pixel without a fit has nothing to add."""


def encode(radiance: ArrayLike, toe: float) -> Values:
    """Return radiance (...) on the scale in which the residual is added: f(Y) = √(max(Y, 0) + a) − √a.

    Parameters
    ----------
    radiance : array_like
        Relative radiance; NaN counts as 0.
    toe : float
        a, in relative radiance.
    """
    values = np.maximum(np.nan_to_num(np.asarray(radiance, np.float32)), np.float32(0.0))
    values += np.float32(toe)
    np.sqrt(values, out=values)
    values -= np.float32(np.sqrt(toe))
    return values


def kernel(first: ArrayLike, second: ArrayLike, length: float) -> Array:
    """Return exp(−|l − d|² / 2ℓ²) of unit vectors (N, 3) and (M, 3), as (N, M)."""
    # For unit vectors |l − d|² = 2 − 2 l·d.
    cosine = np.asarray(first, np.float64) @ np.asarray(second, np.float64).T
    result: Array = np.exp((np.minimum(cosine, 1.0) - 1.0) / length**2)
    return result


def told(found: Mapping[str, Any], direction: ArrayLike, fitted: ArrayLike) -> Array:
    """Return the logarithm of what the lights that were fitted tell of others, such as their strength.

    Parameters
    ----------
    found : mapping
        With a ``table`` over direction, or, of stores made before there were tables, the ``length`` of a
        kernel and ``weights``.
    direction : array_like of shape (L, 3)
        Of the others.
    fitted : array_like of shape (N, 3)
        Directions that the weights belong to.

    Returns
    -------
    ndarray of shape (L, C)
    """
    if "table" in found:
        return look_up(np.array(found["table"], np.float64), np.asarray(direction, np.float64))
    result: Array = kernel(direction, fitted, float(found["length"])) @ np.array(found["weights"]).T
    return result


@dataclass(frozen=True)
class ResidualTerm:
    """The part of a residual that all pixels share: K functions of the light's direction.

    Parameters
    ----------
    direction : ndarray of shape (N, 3)
        The lights that were fitted.
    length : float
        Length of the kernel.
    weights : ndarray of shape (K, C, N)
    step : ndarray of shape (K,)
        Coefficient per step of the codes from `ZERO`.
    toe : float
        Of the encoding.
    hull : ndarray of shape (F, 3)
        Unit vectors that point into the hull of the lights from each of its sides.
    fade : float
        Sine of the angle over which the term fades outside of the hull.
    table : ndarray of shape (256,), float32, or None
        Of a published store, what stands for a code in place of its distance from `ZERO`.
    """

    direction: Array
    length: float
    weights: Array
    step: Array
    toe: float
    hull: Array
    fade: float
    table: Values | None = None

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> ResidualTerm | None:
        """Return the term of a fit with these attributes, or None if it was fitted without."""
        found = attributes.get("residual")
        if not found:
            return None

        def array(name: str) -> Array:
            return np.array(found[name], np.float64)

        published = "table" in found
        return cls(
            direction=array("direction"),
            length=float(found["length"]),
            weights=array("weights"),
            step=np.ones(found["components"]) if published else array("step"),
            toe=float(found["toe"]),
            hull=array("hull"),
            fade=float(found["fade"]),
            table=array("table").astype(np.float32) if published else None,
        )

    @property
    def components(self) -> int:
        """K, the number of functions, and of coefficients per pixel."""
        return len(self.step)

    def share(self, direction: ArrayLike) -> Array:
        """Return how much of the term is left at directions (L, 3): 1 in the lights' hull, less beyond it."""
        outside = (-(np.asarray(direction, np.float64) @ self.hull.T)).max(axis=1)
        part = np.clip(outside / self.fade, 0.0, 1.0)
        result: Array = 1.0 - part * part * (3.0 - 2.0 * part)
        return result

    def basis(self, direction: ArrayLike) -> Array:
        """Return the functions at light directions (L, 3), with the fading, as (L, K, C)."""
        values = np.einsum("kcn,ln->lkc", self.weights, kernel(direction, self.direction, self.length))
        result: Array = values * self.share(direction)[:, None, None]
        return result

    def under(self, direction: ArrayLike) -> dict[str, Any]:
        """Return what the core needs besides the codes to add the term at directions (L, 3), if anything."""
        basis = self.basis(direction) * self.step[:, None]
        if not basis.any():
            return {}
        return {
            "table": self.table,
            "basis": np.ascontiguousarray(basis.transpose(0, 2, 1), np.float32),
            "toe": self.toe,
        }
