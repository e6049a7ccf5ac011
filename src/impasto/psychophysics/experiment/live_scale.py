"""The scale so far, for the laboratory to look at while observers answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sqlalchemy import Engine

from impasto.psychophysics.experiment.answers import answer_rows
from impasto.psychophysics.experiment.manifest import Experiment
from impasto.psychophysics.scaling.comparisons import count_choices
from impasto.psychophysics.scaling.likelihood import fit_likelihood
from impasto.psychophysics.scaling.trials import Trial, is_simulated

_CHOICES = {"A": 1, "B": -1, "tie": 0}


@dataclass(frozen=True)
class ScaledCondition:
    """A condition on the scale.

    Parameters
    ----------
    condition : str
    chosen, asked : float
        How often it was chosen, a tie as one half, and how often it stood for choice.
    scale, standard_error : float or None
        Of mean 0 over the conditions; None where the answers do not tell it yet.
    """

    condition: str
    chosen: float
    asked: float
    scale: float | None
    standard_error: float | None


@dataclass(frozen=True)
class LiveScale:
    """The scale so far, all samples and angles pooled.

    Parameters
    ----------
    answers, observers : int
        Practice, repeats and catch trials not counted.
    simulated : int
        How many of the observers are no persons.
    unit : str
    status : str
        Of the fit: ``converged``, or why there is no scale yet.
    conditions : tuple of ScaledCondition
    """

    answers: int
    observers: int
    simulated: int
    unit: str
    status: str
    conditions: tuple[ScaledCondition, ...]


def live_scale(engine: Engine, experiment: Experiment) -> LiveScale:
    """Fit Thurstone's Case V by maximum likelihood to the answers so far.

    Its standard errors take all answers for independent, which those of one observer are not: they are for
    looking, and `impasto scale` is for reporting.

    Parameters
    ----------
    engine : Engine
    experiment : Experiment

    Returns
    -------
    LiveScale
    """
    rows = answer_rows(engine, kinds=["test"])
    trials = [
        Trial(
            observer=row["observer"],
            sample=row["sample"],
            angle=row["angle"],
            condition_A=row["condition_A"],
            condition_B=row["condition_B"],
            choice=_CHOICES[row["choice"]],
            side=row["side"],
            kind="test",
        )
        for row in rows
    ]
    names = [condition.name for condition in experiment.conditions]
    comparisons = count_choices(trials, names)
    fit = fit_likelihood(comparisons)
    chosen = comparisons.counts
    asked = chosen + chosen.T
    columns = zip(names, chosen.sum(axis=1), asked.sum(axis=1), fit.scale, fit.standard_errors(), strict=True)
    observers = {row["observer"] for row in rows}
    return LiveScale(
        answers=len(rows),
        observers=len(observers),
        simulated=sum(map(is_simulated, observers)),
        unit="standard deviations of a difference",
        status=fit.status,
        conditions=tuple(
            ScaledCondition(name, float(times), float(of), _known(scale), _known(error))
            for name, times, of, scale, error in columns
        ),
    )


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
