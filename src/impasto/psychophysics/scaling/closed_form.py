"""Thurstone's Case V in closed form: least squares on the deviates of the proportions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import chi2

from impasto.errors import OptionError, Problem

ZeroOneRule = Literal["half", "omit", "morovic"]
ZERO_ONE_RULES: dict[str, str] = {
    "half": "a proportion of 0 or 1 counts as half a choice out of N",
    "omit": "pairs on which all agree are left out",
    "morovic": "pairs on which all agree get their deviate from the regression of deviates on log odds",
}


@dataclass(frozen=True)
class ClosedForm:
    """A scale by least squares.

    Parameters
    ----------
    scale : ndarray of shape (C,), float64
        Of mean 0, in standard deviations of a difference; NaN if the pairs used do not connect them all.
    unanimous : tuple of (int, int)
        Pairs on which all agreed: the first was always chosen.
    rule : str
        What was done with them.
    goodness : float
        1 − Σ (p̂ − p)² / Σ p² over the whole table of proportions, pairs not compared left out.
    mosteller : float
        Mosteller's χ² of the fit.
    degrees_of_freedom : int
    p_value : float
        Of a fit this bad or worse if Case V holds; NaN without degrees of freedom.
    """

    scale: NDArray[np.float64]
    unanimous: tuple[tuple[int, int], ...]
    rule: str
    goodness: float
    mosteller: float
    degrees_of_freedom: int
    p_value: float


def fit_closed_form(counts: NDArray[np.float64], rule: ZeroOneRule = "half") -> ClosedForm:
    """Fit Case V by least squares on the deviates z = Φ⁻¹(p).

    Parameters
    ----------
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j.
    rule : {"half", "omit", "morovic"}, optional
        What becomes of proportions of 0 and 1, which have no finite deviate.

    Returns
    -------
    ClosedForm

    Raises
    ------
    OptionError
        If there is no such rule.

    Notes
    -----
    The scale minimises Σ (s_i − s_j − z_ij)² over the pairs compared, each with the same weight
    [Mosteller1951a]_. For a complete table it is the mean of the deviates in each row, the diagonal of zeros
    among them; with pairs left out it is the solution of [Morrissey1955]_. Programs that divide the sum of a
    row by C − 1 stretch the scale by C / (C − 1).

    Morovic's rule [Morovic1998]_ regresses z on ln((f + ½) / (N − f + ½)) through the origin.

    The χ² compares the angles arcsin √p of fitted and observed proportions, whose variance is 1/(4N)
    [Mosteller1951b]_; proportions of 0 and 1 enter as they are.
    """
    if rule not in ZERO_ONE_RULES:
        raise OptionError(
            Problem(f"zero/one rule {rule}", "does not exist", f"Choose among {', '.join(ZERO_ONE_RULES)}")
        )
    trials = counts + counts.T
    compared = trials > 0
    proportions = np.divide(counts, trials, out=np.full_like(counts, 0.5), where=compared)
    unanimous = compared & ((proportions == 0) | (proportions == 1))
    used = compared & ~unanimous if rule == "omit" else compared
    deviates = ndtri(np.where(unanimous, 0.5, proportions))
    if rule == "half":
        half = 0.5 / np.where(compared, trials, 1)
        deviates = np.where(unanimous, ndtri(np.where(proportions == 1, 1 - half, half)), deviates)
    elif rule == "morovic":
        odds = np.log((counts + 0.5) / (trials - counts + 0.5))
        known = compared & ~unanimous
        norm = np.sum(odds[known] ** 2)
        slope = np.sum(odds[known] * deviates[known]) / norm if norm > 0 else np.nan
        deviates = np.where(unanimous, slope * odds, deviates)
    scale = _least_squares(deviates, used)
    fitted = ndtr(scale[:, None] - scale)
    with_diagonal = compared | np.eye(len(counts), dtype=bool)
    goodness = 1 - np.sum((fitted - proportions)[with_diagonal] ** 2) / np.sum(
        proportions[with_diagonal] ** 2
    )
    angles = np.arcsin(np.sqrt(fitted)) - np.arcsin(np.sqrt(proportions))
    upper = np.triu(compared)
    mosteller = float(np.sum(4 * trials[upper] * angles[upper] ** 2))
    degrees = int(upper.sum()) - (len(counts) - 1)
    return ClosedForm(
        scale=scale,
        unanimous=tuple((int(i), int(j)) for i, j in np.argwhere(unanimous & (proportions == 1))),
        rule=rule,
        goodness=float(goodness),
        mosteller=mosteller,
        degrees_of_freedom=degrees,
        p_value=float(chi2.sf(mosteller, degrees)) if degrees > 0 else float("nan"),
    )


def _least_squares(deviates: NDArray[np.float64], used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the scale of mean 0, or NaN where the pairs do not connect it."""
    weights = used.astype(np.float64)
    laplacian = np.diag(weights.sum(axis=1)) - weights
    conditions = len(used)
    if np.linalg.matrix_rank(laplacian) < conditions - 1:
        return np.full(conditions, np.nan)
    return np.linalg.solve(laplacian + 1 / conditions, np.where(used, deviates, 0).sum(axis=1))
