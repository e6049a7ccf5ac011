"""Thurstone's Case V and Bradley-Terry by maximum likelihood, with standard errors and a test of the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy
from scipy.stats import chi2

from impasto.psychophysics.scaling.batch import Link, fit_batch, probability
from impasto.psychophysics.scaling.comparisons import Comparisons, components, dominating

Status = Literal["converged", "unbounded", "disconnected", "not converged"]

JOD = 1.482602218505602
"""Just-objectionable differences in one standard deviation of a difference: 1 / Φ⁻¹(0.75).

At a distance of 1 JOD, three answers in four choose the better condition [PerezOrtiz2017]_.
"""


@dataclass(frozen=True)
class Fit:
    """A scale and what is known about it.

    Parameters
    ----------
    scale : ndarray of shape (C,), float64
        Of mean 0: standard deviations of a difference (Case V) or log odds (Bradley-Terry). NaN where the
        likelihood has no finite maximum, or the design is disconnected.
    covariance : ndarray of shape (C, C), float64
        Of the scale of mean 0, from the expected information.
    status : {"converged", "unbounded", "disconnected", "not converged"}
        "unbounded": all choices between two sets of conditions went one way, and the likelihood grows with
        their distance; or all answers are ties, and it grows with their threshold.
    parts : tuple of tuple of int
        The sets between which nothing is known (disconnected) or no distance is finite (unbounded); a single
        one where all answers are ties.
    deviance : float
        G² against the proportions themselves.
    degrees_of_freedom : int
    p_value : float
        Of a fit this bad or worse if the model holds; NaN without degrees of freedom.
    position, position_error : float
        Effect of standing on the left, in units of the scale, and its standard error; NaN if not fitted.
    """

    scale: NDArray[np.float64]
    covariance: NDArray[np.float64]
    status: Status
    parts: tuple[tuple[int, ...], ...]
    deviance: float
    degrees_of_freedom: int
    p_value: float
    position: float = float("nan")
    position_error: float = float("nan")

    @property
    def tells_nothing(self) -> bool:
        """Whether the answers leave the scale wholly open, also with the bias removed."""
        return self.status == "disconnected" or (self.status == "unbounded" and len(self.parts) == 1)

    def standard_errors(self, reference: int | None = None) -> NDArray[np.float64]:
        """Return the standard errors of the scale of mean 0, or of the differences to one condition.

        Parameters
        ----------
        reference : int, optional
            The condition whose value is taken as 0.

        Returns
        -------
        ndarray of shape (C,), float64
        """
        return np.sqrt(np.maximum(np.diag(contrasted(self.covariance, reference)), 0))


def contrasted(covariance: NDArray[np.float64], reference: int | None) -> NDArray[np.float64]:
    """Return the covariance of the differences to one condition, or the given one without a condition.

    Parameters
    ----------
    covariance : ndarray of shape (C, C), float64
    reference : int or None

    Returns
    -------
    ndarray of shape (C, C), float64
    """
    if reference is None:
        return covariance
    change = np.eye(len(covariance))
    change[:, reference] -= 1
    return np.asarray(change @ covariance @ change.T)


def pair_design(conditions: int) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Return the design of all pairs.

    Parameters
    ----------
    conditions : int

    Returns
    -------
    design : ndarray of shape (K, C), float64
        +1 for the first condition of the pair, −1 for the second.
    first, second : ndarray of shape (K,), int
    """
    first, second = np.triu_indices(conditions, 1)
    design = np.zeros((len(first), conditions))
    design[np.arange(len(first)), first] = 1
    design[np.arange(len(first)), second] = -1
    return design, first, second


def fit_likelihood(
    comparisons: Comparisons,
    *,
    link: Link = "probit",
    position: bool = False,
    reduce_bias: bool = False,
    precision: float = 0.0,
) -> Fit:
    """Fit a scale by maximum likelihood.

    Parameters
    ----------
    comparisons : Comparisons
        A tie counts as half a choice for each; `fit_ties` treats ties as answers of their own.
    link : {"probit", "logit"}, optional
        Thurstone's Case V, or Bradley-Terry [BradleyTerry1952]_.
    position : bool, optional
        Whether to fit an advantage of the left; only answers of which the side is known count then.
    reduce_bias : bool, optional
        Whether to remove the first-order bias [Firth1993]_, which gives finite values also where all agree.
    precision : float, optional
        Inverse variance of a normal prior of every scale value, of mean 0: with one, the mode of the
        posterior is found instead, finite in every case.

    Returns
    -------
    Fit

    Notes
    -----
    P(i over j) = F(s_i − s_j ± β), with + where i stands on the left and − where j does; F the normal
    distribution function or the logistic one. A design that is not complete needs nothing else.
    """
    conditions = len(comparisons.conditions)
    pairs, first, second = pair_design(conditions)
    if position:
        # Each pair twice: as the first condition stood on the left, and as it stood on the right.
        design = np.vstack([np.c_[pairs, np.ones(len(pairs))], np.c_[pairs, -np.ones(len(pairs))]])
        left, right = comparisons.wins_left, comparisons.wins_right
        chosen = np.r_[left[first, second], right[first, second]]
        refused = np.r_[right[second, first], left[second, first]]
        wins = left + right
    else:
        design, wins = pairs, comparisons.counts
        chosen, refused = wins[first, second], wins[second, first]
    compared = chosen + refused > 0
    design, chosen, refused = design[compared], chosen[compared], refused[compared]
    status, parts = existence(wins, finite=reduce_bias or precision > 0)
    degrees = len(chosen) - (conditions - 1) - int(position)
    if position and np.linalg.matrix_rank(design) < conditions:
        status = "disconnected"  # the sides cannot be told from the conditions
    if status != "converged":
        nothing = np.full(conditions, np.nan)
        unknown = np.full((conditions, conditions), np.nan)
        return Fit(nothing, unknown, status, parts, np.nan, degrees, np.nan)
    fitted = fit_batch(
        design,
        chosen[None],
        refused[None],
        conditions=conditions,
        link=link,
        reduce_bias=reduce_bias,
        precision=precision,
    )
    parameters, covariance = fitted.parameters[0], fitted.covariance[0]
    deviance = _deviance(chosen, refused, probability(design @ parameters, link))
    return Fit(
        scale=parameters[:conditions],
        covariance=covariance[:conditions, :conditions],
        status="converged" if fitted.converged[0] else "not converged",
        parts=parts,
        deviance=deviance,
        degrees_of_freedom=degrees,
        p_value=float(chi2.sf(deviance, degrees)) if degrees > 0 else float("nan"),
        position=float(parameters[-1]) if position else float("nan"),
        position_error=float(np.sqrt(covariance[-1, -1])) if position else float("nan"),
    )


def existence(
    wins: NDArray[np.float64], *, finite: bool = False
) -> tuple[Status, tuple[tuple[int, ...], ...]]:
    """Return whether a scale exists, and between which sets of conditions it does not.

    Parameters
    ----------
    wins : ndarray of shape (C, C), float64
        How often i was chosen over j.
    finite : bool, optional
        Whether the estimator is finite also where all choices went one way.

    Returns
    -------
    status : {"converged", "unbounded", "disconnected"}
    parts : tuple of tuple of int
    """
    connected = components(wins + wins.T > 0)
    if len(connected) > 1:
        return "disconnected", connected
    parts = connected if finite else dominating(wins)
    return ("unbounded" if len(parts) > 1 else "converged"), parts


def _deviance(
    chosen: NDArray[np.float64], refused: NDArray[np.float64], fitted: NDArray[np.float64]
) -> float:
    trials = chosen + refused
    per_cell = (
        xlogy(chosen, chosen / trials)
        - xlogy(chosen, fitted)
        + xlogy(refused, refused / trials)
        - xlogy(refused, 1 - fitted)
    )
    # Rounding leaves something below 0 where the model reaches the proportions themselves.
    return max(0.0, float(2 * per_cell.sum()))
