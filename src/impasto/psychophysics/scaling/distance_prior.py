"""Case V with a prior on distances, after Pérez-Ortiz and Mantiuk: finite also where all agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr

# Weight of "any distance is possible" against the distances seen, in the published program.
_FLOOR = 0.1


def fit_distance_prior(
    counts: NDArray[np.float64], start: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Fit Case V with the prior that all distances are like those seen in the experiment.

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j; all conditions connected by comparisons.
    start : ndarray of shape (C,), float64, optional

    Returns
    -------
    ndarray of shape (C,), float64
        Scale of mean 0, in standard deviations of a difference; multiply by `likelihood.JOD` for JOD. NaN if
        the optimiser fails.

    Notes
    -----
    The prior of a distance is the mean over all pairs of their normalised likelihoods at that distance, plus
    0.1; a unanimous pair enters as if one answer had been the other way [PerezOrtiz2017]_.
    """
    trials = counts + counts.T
    first, second = np.nonzero(trials)
    chosen, total = counts[first, second], trials[first, second]
    seen = np.where(chosen == 0, 1, np.where(chosen == total, total - 1, chosen))

    first_guess = np.zeros(len(counts)) if start is None else start

    def objective(scale: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        distance = scale[first] - scale[second]
        log_up, log_down = log_ndtr(distance), log_ndtr(-distance)
        density = np.exp(-0.5 * distance**2) / np.sqrt(2 * np.pi)
        up, down = density / np.exp(log_up), density / np.exp(log_down)
        # Row: a distance at which the likelihood is asked for; column: the answers it is asked of.
        log_like = np.outer(log_up, seen) + np.outer(log_down, total - seen)
        like = np.exp(log_like - log_like.max(axis=0))
        share = like / like.sum(axis=0)
        prior = share.sum(axis=1)
        slope = np.outer(up, seen) - np.outer(down, total - seen)
        # Derivative of Σ log(prior + floor) by each distance, through the numerators and the sums below them.
        weight = 1 / (prior + _FLOOR)
        through_sums = weight @ share
        by_distance = (share * slope * (weight[:, None] - through_sums)).sum(axis=1)
        by_distance += chosen * up - (total - chosen) * down
        value = np.sum(chosen * log_up + (total - chosen) * log_down) + np.sum(np.log(prior + _FLOOR))
        mean = scale.mean()
        gradient = np.bincount(first, by_distance, len(scale)) - np.bincount(second, by_distance, len(scale))
        return float(mean**2 - value), 2 * mean / len(scale) - gradient

    found = minimize(objective, first_guess, jac=True, method="BFGS", options={"gtol": 1e-8})
    # BFGS reports a loss of precision when it is as near as floating point lets it come.
    near = np.abs(found.jac).max() < 1e-4
    return np.asarray(found.x - found.x.mean()) if near else np.full(len(counts), np.nan)
