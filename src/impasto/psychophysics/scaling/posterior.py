"""The posterior distribution of a Case V scale, by expectation propagation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.psychophysics.scaling.batch import hazards

_SWEEPS = 500
_TOLERANCE = 1e-8


@dataclass(frozen=True)
class Posterior:
    """A normal distribution of scale values.

    Parameters
    ----------
    mean : ndarray of shape (C,), float64
        In standard deviations of a difference.
    covariance : ndarray of shape (C, C), float64
    converged : bool
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    converged: bool

    def differences(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and variance of all differences s_i − s_j, each of shape (C, C)."""
        variance = np.diag(self.covariance)
        return self.mean[:, None] - self.mean, variance[:, None] + variance - 2 * self.covariance


def posterior(counts: NDArray[np.float64], precision: float = 0.1) -> Posterior:
    """Return the posterior of the scale under a normal prior of mean 0.

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j. There may be none at all.
    precision : float, optional
        Inverse variance of the prior of every scale value.

    Returns
    -------
    Posterior

    Notes
    -----
    Expectation propagation [Minka2001]_ with one factor per answer. Equal answers have equal factors, so that
    one factor stands for all of them; the factors are visited in turn until none changes by 1e-8.
    """
    chosen, refused = np.nonzero(counts)
    number = counts[chosen, refused]
    size = len(counts)
    directions = np.zeros((len(chosen), size))
    directions[np.arange(len(chosen)), chosen] = 1
    directions[np.arange(len(chosen)), refused] = -1
    weight, shift = np.zeros(len(chosen)), np.zeros(len(chosen))
    covariance, vector = np.eye(size) / precision, np.zeros(size)
    converged = not len(chosen)
    for _ in range(_SWEEPS):
        if converged:
            break
        largest = 0.0
        for k, direction in enumerate(directions):
            along = covariance @ direction
            variance, mean = direction @ along, along @ vector
            # The distribution without one of the equal answers.
            left = 1 / variance - weight[k]
            mean_left = (mean / variance - shift[k]) / left
            spread = np.sqrt(1 + 1 / left)
            argument = mean_left / spread
            hazard = float(hazards(np.array(argument), "probit")[0])
            first, second = hazard / spread, -hazard * (argument + hazard) / spread**2
            new_weight = -second / (1 + second / left)
            new_shift = (first - mean_left * second) / (1 + second / left)
            # All equal factors move together, so that a full step would overshoot where there are many.
            damping = 1 / (1 + number[k] * new_weight * variance / 4)
            change = damping * (new_weight - weight[k])
            vector = vector + number[k] * damping * (new_shift - shift[k]) * direction
            shift[k] += damping * (new_shift - shift[k])
            weight[k] += change
            covariance -= np.outer(along, along) * number[k] * change / (1 + number[k] * change * variance)
            largest = max(largest, abs(change))
        # Afresh, since rounding gathers in the updates.
        information = precision * np.eye(size) + (directions.T * (number * weight)) @ directions
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        converged = largest < _TOLERANCE
    return Posterior(covariance @ vector, covariance, bool(converged))
