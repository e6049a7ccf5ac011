"""The scale under other draws of the observers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.psychophysics.scaling.batch import Link, fit_batch
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.likelihood import pair_design
from impasto.psychophysics.scaling.ties import fit_ties_batch

# A hundredth of a standard error of the smallest experiments, and far below one of the largest.
_TOLERANCE = 1e-3
# So many tables go through the matrix products at once: they stay in the processor's cache.
_BLOCK = 20_000


@dataclass(frozen=True)
class Resampled:
    """A scale, and how it varies when other observers are drawn.

    Parameters
    ----------
    scale : ndarray of shape (C,), float64
        With the first-order bias removed, of mean 0.
    covariance : ndarray of shape (C, C), float64
        If all answers were independent.
    drawn_covariance : ndarray of shape (C, C), float64
        Over the draws of observers.
    drawn : ndarray of shape (B, C), float64
        The scales of the draws.
    converged : bool
        Whether the fit of all observers ended.
    unusable : int
        Draws left out, in which no chain of comparisons connected all conditions or the fit did not end.
    """

    scale: NDArray[np.float64]
    covariance: NDArray[np.float64]
    drawn_covariance: NDArray[np.float64]
    drawn: NDArray[np.float64]
    converged: bool
    unusable: int


def resample_observers(
    comparisons: Comparisons, *, draws: int, seed: int, link: Link = "probit"
) -> Resampled:
    """Draw as many observers as there are, with replacement, and fit each draw.

    Parameters
    ----------
    comparisons : Comparisons
        Connected.
    draws : int
    seed : int
    link : {"probit", "logit"}, optional
        Ties, if there are any, get their threshold with the probit link and count as half choices with the
        logit link.

    Returns
    -------
    Resampled
    """
    conditions = len(comparisons.conditions)
    design, first, second = pair_design(conditions)
    chosen = comparisons.wins[:, first, second]
    refused = comparisons.wins[:, second, first]
    tied = comparisons.ties[:, first, second]
    answers = np.stack([chosen, refused, tied])
    compared = answers.sum(axis=(0, 1)) > 0
    design, answers = design[compared], answers[:, :, compared]
    observers = answers.shape[1]

    def fit(
        weights: NDArray[np.float64], start: NDArray[np.float64] | None, tolerance: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        won, lost, even = (weights @ answer for answer in answers)
        if comparisons.has_ties and link == "probit":
            fitted = fit_ties_batch(
                design,
                won,
                lost,
                even,
                conditions=conditions,
                reduce_bias=True,
                start=start,
                tolerance=tolerance,
            )
        else:
            fitted = fit_batch(
                design,
                won + even / 2,
                lost + even / 2,
                conditions=conditions,
                link=link,
                reduce_bias=True,
                start=start,
                tolerance=tolerance,
            )
        return fitted.parameters, fitted.covariance, fitted.converged

    parameters, covariance, done = fit(np.ones((1, observers)), None, 1e-9)
    random = np.random.default_rng(seed)
    weights = _draws(random, observers, (draws,))
    usable = _connected(weights @ answers.sum(axis=0) > 0, first[compared], second[compared], conditions)
    drawn = []
    for begin in range(0, draws, _BLOCK):
        block = weights[begin : begin + _BLOCK][usable[begin : begin + _BLOCK]]
        if len(block):
            found, _, converged = fit(block, np.repeat(parameters, len(block), axis=0), _TOLERANCE)
            drawn.append(found[converged, :conditions])
    scales = np.concatenate(drawn) if drawn else np.empty((0, conditions))
    return Resampled(
        scale=parameters[0, :conditions],
        covariance=covariance[0, :conditions, :conditions],
        drawn_covariance=np.cov(scales, rowvar=False)
        if len(scales) > 1
        else np.full((conditions,) * 2, np.nan),
        drawn=scales,
        converged=bool(done[0]),
        unusable=draws - len(scales),
    )


def resample_experiments(
    chosen: NDArray[np.float64],
    refused: NDArray[np.float64],
    *,
    conditions: int,
    draws: int,
    random: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Do as `resample_observers` does for many experiments with the same complete design.

    Parameters
    ----------
    chosen, refused : ndarray of shape (M, O, K), float64
        How often each observer of each experiment chose the first condition of each pair, and the second;
        pairs as in `likelihood.pair_design`.
    conditions : int
    draws : int
    random : numpy.random.Generator

    Returns
    -------
    scale : ndarray of shape (M, C), float64
    covariance, drawn_covariance : ndarray of shape (M, C, C), float64
        See `Resampled`.
    """
    design, _, _ = pair_design(conditions)
    experiments, observers, pairs = chosen.shape
    whole = fit_batch(
        design, chosen.sum(axis=1), refused.sum(axis=1), conditions=conditions, reduce_bias=True
    )
    drawn_covariance = np.empty((experiments, conditions, conditions))
    step = max(1, _BLOCK // draws)
    for begin in range(0, experiments, step):
        block = slice(begin, begin + step)
        size = len(chosen[block])
        weights = _draws(random, observers, (size, draws))
        tables = [(weights @ answers[block]).reshape(-1, pairs) for answers in (chosen, refused)]
        fitted = fit_batch(
            design,
            *tables,
            conditions=conditions,
            reduce_bias=True,
            start=np.repeat(whole.parameters[block], draws, axis=0),
            tolerance=_TOLERANCE,
        )
        scales = fitted.parameters.reshape(size, draws, conditions)
        scales = scales - scales.mean(axis=1, keepdims=True)
        drawn_covariance[block] = np.swapaxes(scales, 1, 2) @ scales / (draws - 1)
    return whole.parameters, whole.covariance, drawn_covariance


def _draws(random: np.random.Generator, observers: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return how often each observer is drawn, shape (*size, O)."""
    shares = np.full(observers, 1 / observers)
    return random.multinomial(observers, shares, size=size).astype(np.float64)


def _connected(
    compared: NDArray[np.bool_], first: NDArray[np.intp], second: NDArray[np.intp], conditions: int
) -> NDArray[np.bool_]:
    """Return for each row whether its pairs connect all conditions, shape (B,)."""
    connected = np.asarray(compared.all(axis=1))
    rest = np.flatnonzero(~connected)
    reach = np.zeros((len(rest), conditions, conditions), dtype=np.float32)
    reach[:, first, second] = compared[rest]
    reach += np.swapaxes(reach, 1, 2) + np.eye(conditions, dtype=np.float32)
    for _ in range(int(np.ceil(np.log2(conditions)))):
        reach = np.minimum(reach @ reach, 1)
    connected[rest] = (reach > 0).all(axis=(1, 2))
    return connected
