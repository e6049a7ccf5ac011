"""The scale of one set of trials: an angle, a sample, or all together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from impasto.psychophysics.scaling.batch import Link
from impasto.psychophysics.scaling.closed_form import ClosedForm, ZeroOneRule, fit_closed_form
from impasto.psychophysics.scaling.comparisons import Comparisons, count_choices
from impasto.psychophysics.scaling.consistency import Agreement, agreement
from impasto.psychophysics.scaling.likelihood import JOD, Fit, fit_likelihood
from impasto.psychophysics.scaling.limits import Limits, Method, limits
from impasto.psychophysics.scaling.ties import fit_ties
from impasto.psychophysics.scaling.trials import Trial, in_order

Model = Literal["case-v", "closed-form", "bradley-terry"]
MODELS: dict[str, str] = {
    "case-v": "Thurstone's Case V by maximum likelihood, with Glenn and David's threshold for ties",
    "closed-form": "Thurstone's Case V by least squares on the deviates",
    "bradley-terry": "Bradley-Terry by maximum likelihood",
}
UNITS: dict[str, str] = {
    "z": "z: standard deviations of a difference",
    "jod": "JOD: at a distance of 1, three answers in four go one way",
    "log-odds": "log odds of a choice",
}


@dataclass(frozen=True)
class ScaleOptions:
    """How trials are scaled.

    Parameters
    ----------
    model : {"case-v", "closed-form", "bradley-terry"}, optional
    rule : {"half", "omit", "morovic"}, optional
        What the closed form does with proportions of 0 and 1.
    limits : str, optional
        Method of the limits, one of `limits.METHODS`.
    level : float, optional
        Probability with which the limits are to cover.
    draws, seed : int, optional
        Of the bootstrap.
    unit : {"z", "jod"}, optional
        Of Case V; Bradley-Terry is told in log odds.
    """

    model: Model = "case-v"
    rule: ZeroOneRule = "half"
    limits: Method = "auto"
    level: float = 0.95
    draws: int = 1000
    seed: int = 0
    unit: Literal["z", "jod"] = "z"

    @property
    def link(self) -> Link:
        """The link of the model."""
        return "logit" if self.model == "bradley-terry" else "probit"

    @property
    def factor(self) -> float:
        """What turns the model's values into the unit."""
        return JOD if self.unit_name == "jod" else 1.0

    @property
    def unit_name(self) -> str:
        """The unit in which values are told, a key of `UNITS`."""
        return "log-odds" if self.model == "bradley-terry" else self.unit


@dataclass(frozen=True)
class FitTest:
    """A test of whether the model describes the proportions.

    Parameters
    ----------
    statistic : float
    degrees_of_freedom : int
    p_value : float
        NaN without degrees of freedom.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float


@dataclass(frozen=True)
class ScaledGroup:
    """The scale of a set of trials.

    Parameters
    ----------
    name : str
        Such as "angle 30", "sample a" or "pooled".
    by : {"pooled", "angle", "sample", "pool"}
    conditions : tuple of str, length C
    observers, answers, ties : int
        Repeats, catch trials and practice do not count.
    counts : ndarray of shape (C, C), float64
        How often i was chosen over j; a tie is half a choice for each.
    status : {"converged", "unbounded", "disconnected", "not converged"}
        Of the maximum of the likelihood.
    scale : ndarray of shape (C,), float64
        Of mean 0. If the status is "unbounded", the estimate with its bias removed; NaN if disconnected.
    standard_error : ndarray of shape (C,), float64
        If all answers were independent.
    low, high : ndarray of shape (C,), float64
    difference_low, difference_high : ndarray of shape (C, C), float64
        Of s_i − s_j.
    limits : str
        Their method.
    p_value : float
        Of the exact binomial test for two conditions, else NaN.
    deviance, mosteller : FitTest
        G² of the likelihood, and Mosteller's χ² of the closed form.
    closed_form, bradley_terry : ndarray of shape (C,), float64
        For comparison: in the unit of Case V, and in log odds.
    threshold : float
        Glenn and David's, in the unit; NaN without ties.
    position, position_error : float
        Advantage of the left in the unit, with its bias removed, and its standard error; NaN if the sides are
        not known, or each condition stood always on the same one.
    agreement : Agreement or None
        Kendall's u where every pair was answered equally often, without ties.
    notes : tuple of str
        What a reader has to know before using these values.
    """

    name: str
    by: str
    conditions: tuple[str, ...]
    observers: int
    answers: int
    ties: int
    counts: NDArray[np.float64]
    status: str
    scale: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    difference_low: NDArray[np.float64]
    difference_high: NDArray[np.float64]
    limits: str
    p_value: float
    deviance: FitTest
    mosteller: FitTest
    closed_form: NDArray[np.float64]
    bradley_terry: NDArray[np.float64]
    threshold: float
    position: float
    position_error: float
    agreement: Agreement | None
    notes: tuple[str, ...]


def scale_group(
    name: str, by: str, trials: Sequence[Trial], conditions: Sequence[str], options: ScaleOptions
) -> ScaledGroup:
    """Scale a set of trials.

    Parameters
    ----------
    name, by : str
    trials : sequence of Trial
    conditions : sequence of str
        In the order in which they are told; those that do not occur in the trials are left out.
    options : ScaleOptions

    Returns
    -------
    ScaledGroup

    Raises
    ------
    OptionError
        If the method of the limits cannot be used with these trials.
    """
    present = in_order(
        name for trial in trials if trial.kind == "test" for name in (trial.condition_A, trial.condition_B)
    )
    comparisons = count_choices(trials, [name for name in conditions if name in present])
    return scale_comparisons(name, by, comparisons, options)


def scale_comparisons(name: str, by: str, comparisons: Comparisons, options: ScaleOptions) -> ScaledGroup:
    """Scale choices that are already counted; see `scale_group`.

    Parameters
    ----------
    name, by : str
    comparisons : Comparisons
    options : ScaleOptions

    Returns
    -------
    ScaledGroup

    Raises
    ------
    OptionError
        If the method of the limits cannot be used with these counts.
    """
    names, counts = comparisons.conditions, comparisons.counts
    closed = fit_closed_form(counts, options.rule)
    odds = fit_likelihood(comparisons, link="logit")
    threshold = float("nan")
    if options.model != "bradley-terry" and comparisons.has_ties:
        with_ties = fit_ties(comparisons)
        fit, threshold = with_ties.fit, with_ties.threshold
    else:
        fit = odds if options.model == "bradley-terry" else fit_likelihood(comparisons)
    notes = [*_notes_of_fit(names, fit), *_notes_of_counts(names, counts, closed)]
    estimate = fit.scale
    errors = fit.standard_errors()
    if fit.status == "unbounded" and not fit.tells_nothing:
        reduced = fit_likelihood(comparisons, link=options.link, reduce_bias=True)
        estimate, errors = reduced.scale, reduced.standard_errors()
    if options.model == "closed-form":
        estimate = closed.scale
    if fit.tells_nothing:
        nothing = np.full(len(names), np.nan)
        unknown = np.full((len(names), len(names)), np.nan)
        found = Limits("none", options.level, nothing, nothing, unknown, unknown)
    else:
        found = limits(
            comparisons,
            method=options.limits,
            level=options.level,
            draws=options.draws,
            seed=options.seed,
            link=options.link,
        )
    notes += found.notes
    if options.model == "closed-form" and found.method in ("observers", "percentile", "likelihood"):
        notes.append("the values are those of the closed form, the limits those of the likelihood's scale")
    # With its bias removed it is finite also where everybody who saw a condition on the left chose it.
    sided = (
        fit_likelihood(comparisons, link=options.link, position=True, reduce_bias=True)
        if comparisons.wins_left.any()
        else None
    )
    factor = options.factor
    return ScaledGroup(
        name=name,
        by=by,
        conditions=names,
        observers=len(comparisons.observers),
        answers=int(counts.sum()),
        ties=int(comparisons.ties.sum() / 2),
        counts=counts,
        status=fit.status,
        scale=factor * estimate,
        standard_error=factor * errors,
        low=factor * found.low,
        high=factor * found.high,
        difference_low=factor * found.difference_low,
        difference_high=factor * found.difference_high,
        limits=found.method,
        p_value=found.p_value,
        deviance=FitTest(fit.deviance, fit.degrees_of_freedom, fit.p_value),
        mosteller=FitTest(closed.mosteller, closed.degrees_of_freedom, closed.p_value),
        closed_form=(JOD if options.unit == "jod" else 1.0) * closed.scale,
        bradley_terry=odds.scale,
        threshold=factor * threshold,
        position=factor * sided.position if sided else float("nan"),
        position_error=factor * sided.position_error if sided else float("nan"),
        agreement=None if comparisons.has_ties else agreement(counts),
        notes=tuple(notes),
    )


def _notes_of_fit(names: Sequence[str], fit: Fit) -> list[str]:
    parts = "; ".join(", ".join(names[i] for i in part) for part in fit.parts)
    if fit.status == "disconnected":
        return [f"no comparisons connect these conditions, so that there is no common scale: {parts}"]
    if fit.tells_nothing:
        return [f"all answers are ties, and nothing tells these conditions apart: {parts}"]
    if fit.status == "unbounded":
        return [
            f"all answers between these went one way, and the likelihood has no finite maximum: {parts}. "
            "The values are those with the bias removed"
        ]
    if fit.status == "not converged":
        return ["the fit did not converge; its values are not to be used"]
    return []


def _notes_of_counts(names: Sequence[str], counts: NDArray[np.float64], closed: ClosedForm) -> list[str]:
    if not closed.unanimous:
        return []
    pairs = ", ".join(f"{names[i]} over {names[j]} ({counts[i, j]:.0f})" for i, j in closed.unanimous)
    return [f"unanimous: {pairs}"]
