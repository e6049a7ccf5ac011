"""Find observers who answer unlike all others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr
from scipy.stats import binom

from impasto.psychophysics.scaling.comparisons import Comparisons, components
from impasto.psychophysics.scaling.distance_prior import fit_distance_prior

OUTLYING = 1.5
"""Distance below the quartile, in interquartile ranges, from which an observer is worth a look."""

FALSE_ALARM = 0.05
"""Greatest probability that any observer who answers like the others is taken for reversed."""


@dataclass(frozen=True)
class Screened:
    """How one observer answers beside the others.

    Parameters
    ----------
    observer : str
    log10_likelihood : float
        Of the observer's answers under the scale of all others, per pair; NaN without a scale of the others.
    distance : float
        How far that lies below the lower quartile of all observers, in interquartile ranges; 0 above it.
    log_reversed : float
        Logarithm of the likelihood of the answers if they are turned round, over that as they are.
    outlying : bool
        Whether `distance` reaches 1.5.
    reversed : bool
        Whether `log_reversed` reaches ln(O / 0.05) with O observers: chance alone gives that to one of them
        in a twentieth of all experiments at most.
    """

    observer: str
    log10_likelihood: float
    distance: float
    log_reversed: float
    outlying: bool
    reversed: bool


def screen(groups: Sequence[Comparisons]) -> tuple[Screened, ...]:
    """Compare each observer with the scale of all others [PerezOrtiz2017]_.

    Parameters
    ----------
    groups : sequence of Comparisons
        One per scale, such as an angle, with the same observers in the same order; likelihoods add up.

    Returns
    -------
    tuple of Screened
        In the order of the observers. Nothing is excluded.

    Notes
    -----
    The scale of the others is that of `fit_distance_prior`. The observer's answers on a pair have a binomial
    likelihood; the mean of their logarithms is compared between observers by Hazen's quartiles.
    """
    observers = groups[0].observers
    total, pairs, turned = (np.zeros(len(observers)) for _ in range(3))
    for group in groups:
        choices = group.wins
        everyone = choices.sum(axis=0)
        start = fit_distance_prior(everyone) if len(components(everyone + everyone.T > 0)) == 1 else None
        # Many observers leave the same table behind, above all where there are two conditions.
        scales: dict[bytes, NDArray[np.float64]] = {}
        for number, own in enumerate(choices):
            others = everyone - own
            first, second = np.nonzero(np.triu(own + own.T))
            if not len(first):
                continue
            if len(components(others + others.T > 0)) > 1:
                total[number] = np.nan
                continue
            key = others.tobytes()
            if key not in scales:
                scales[key] = fit_distance_prior(others, start)
            scale = scales[key]
            distance = scale[first] - scale[second]
            chosen, refused = own[first, second], own[second, first]
            straight = binom.logpmf(chosen, chosen + refused, np.exp(log_ndtr(distance)))
            total[number] += straight.sum() / np.log(10)
            pairs[number] += len(first)
            turned[number] += np.sum((refused - chosen) * (log_ndtr(distance) - log_ndtr(-distance)))
    likelihood = np.divide(total, pairs, out=np.full(len(observers), np.nan), where=pairs > 0)
    distance = _below_quartile(likelihood)
    return tuple(
        Screened(
            observer=name,
            log10_likelihood=float(likelihood[number]),
            distance=float(distance[number]),
            log_reversed=float(turned[number]),
            outlying=bool(distance[number] >= OUTLYING),
            reversed=bool(turned[number] >= np.log(len(observers) / FALSE_ALARM)),
        )
        for number, name in enumerate(observers)
    )


def _below_quartile(values: NDArray[np.float64]) -> NDArray[np.float64]:
    known = values[np.isfinite(values)]
    distance = np.zeros(len(values))
    if len(known) < 4:
        return distance
    low, high = np.quantile(known, [0.25, 0.75], method="hazen")
    below = np.isfinite(values) & (values < low)
    if high > low:
        distance[below] = (low - values[below]) / (high - low)
    return distance
