"""What a set of lights is worth: the expected error of renderings under test lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from impasto.geometry import Array

# What is taken to be known before any photograph: each normal to this angle in radians, and the logarithm of
# every magnitude and shape to 1, which is a factor of e either way.
TILT_SD, LOG_SD = 0.2, 1.0


class Criterion:
    """The I-criterion of sets of candidate lights: mean variance of rendered radiance, averaged over pixels.

    Parameters
    ----------
    slopes : ndarray of shape (P, L, K)
        Of each pixel's radiance under each candidate light, over the standard deviation of a photograph's
        sample there.
    tests : ndarray of shape (P, T, K)
        Slopes under the test lights, in the unit in which errors are told.

    Notes
    -----
    For a pixel and a set S of lights the covariance of its parameters is V = (R + Σ a aᵀ)⁻¹, with the rows a
    of S and the weak prior R, and its criterion is the mean of t V tᵀ over the test rows t [Atkinson2007]_,
    ch. 10. What all candidates together tell no more of than the prior does is left out of t: no choice among
    them could make that better. Averaging over pixels makes the choice good for the range of normals and
    highlights that they span rather than for one of them (ch. 18).
    """

    def __init__(self, slopes: ArrayLike, tests: ArrayLike) -> None:
        slopes, tests = np.asarray(slopes, np.float64), np.asarray(tests, np.float64)
        prior_sd = np.full(slopes.shape[-1], LOG_SD)
        prior_sd[:2] = TILT_SD
        self._rows = np.ascontiguousarray(slopes * prior_sd)
        whitened = tests * prior_sd
        moments = np.swapaxes(whitened, 1, 2) @ whitened / tests.shape[1]
        everything = np.swapaxes(self._rows, 1, 2) @ self._rows
        information, axes = np.linalg.eigh(everything)
        told = axes * (information > 1.0)[:, None, :]
        identifiable = told @ np.swapaxes(told, 1, 2)
        self._moments = identifiable @ moments @ identifiable

    @property
    def lights(self) -> int:
        """Number of candidates."""
        return int(self._rows.shape[1])

    def value(self, chosen: Sequence[int]) -> float:
        """Return the criterion of a set of candidates; lower is better."""
        return float(np.mean(np.einsum("pij,pij->p", self.covariance(chosen), self._moments)))

    def covariance(self, chosen: Sequence[int]) -> Array:
        """Return the covariance of each pixel's parameters in units of the prior, shape (P, K, K)."""
        rows = self._rows[:, list(chosen)]
        return np.asarray(np.linalg.inv(np.eye(rows.shape[-1]) + np.swapaxes(rows, 1, 2) @ rows))

    def gains(self, covariance: Array) -> Array:
        """Return by how much each candidate would lower the criterion if it were added, shape (L,)."""
        return self._changes(covariance, 1.0)

    def losses(self, covariance: Array) -> Array:
        """Return by how much each light would raise the criterion if it were left out, shape (L,)."""
        return self._changes(covariance, -1.0)

    def without(self, covariance: Array, light: int) -> Array:
        """Return the covariance after a light of the set is left out."""
        along = np.einsum("pij,pj->pi", covariance, self._rows[:, light])
        kept = 1.0 - np.einsum("pi,pi->p", along, self._rows[:, light])
        return np.asarray(
            covariance + along[:, :, None] * along[:, None, :] / np.maximum(kept, 1e-12)[:, None, None]
        )

    def _changes(self, covariance: Array, sign: float) -> Array:
        # Sherman and Morrison's formula, traced with the moments of the test lights.
        along = covariance @ np.swapaxes(self._rows, 1, 2)
        scale = 1.0 + sign * np.einsum("plk,pkl->pl", self._rows, along)
        weight = np.einsum("pkl,pkl->pl", along, self._moments @ along)
        return np.asarray(np.mean(weight / np.maximum(scale, 1e-12), axis=0))
