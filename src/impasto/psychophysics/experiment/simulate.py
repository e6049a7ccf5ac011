"""Let simulated observers take part: their answers go the way of all answers, without a browser."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem
from impasto.psychophysics.differences import KINDS, image_difference, read_picture
from impasto.psychophysics.experiment.administer import invite, opened
from impasto.psychophysics.experiment.manifest import Viewing
from impasto.psychophysics.experiment.sessions import Session, Side, Trial
from impasto.psychophysics.simulated_observers import Judge, ObserverModel

_SIDES: dict[int, Side] = {1: "left", 0: "tie", -1: "right"}
# What stands where the display of a person would: nobody has looked at one.
_VIEWING = Viewing(display="none: simulated", profile="none: simulated", surround="none: simulated")


@dataclass(frozen=True)
class SimulateSummary:
    """What `simulate` did.

    Parameters
    ----------
    observers : tuple of str
        Every name begins with "simulated".
    answers : int
        Of all kinds of trials.
    by : str
        The difference that they went by.
    """

    observers: tuple[str, ...]
    answers: int
    by: str


def simulate(
    experiment: str | PathLike[str],
    *,
    observers: int = 18,
    by: str = "CIEDE2000",
    model: ObserverModel | None = None,
    seed: int = 0,
    database: str | None = None,
) -> SimulateSummary:
    """Let simulated observers go through sessions of an experiment.

    They are Thurstone's: the closer a picture is to the photograph by a measured difference, the likelier it
    is chosen [Thurstone1927]_. Like the page they know the pictures of a trial and not what these are, and
    their answers are checked and stored like those of persons.

    Parameters
    ----------
    experiment : path
        Folder that `create` made.
    observers : int, optional
        How many.
    by : {"RMS", "CIEDE2000", "FLIP"}, optional
        The difference that they go by.
    model : ObserverModel, optional
        How they judge; its `gain` is per unit of the difference.
    seed : int, optional
        Of their noise.
    database : str, optional
        As for `serve`.

    Returns
    -------
    SimulateSummary

    Raises
    ------
    ExperimentError
        If the experiment or its database cannot be used.
    OptionError
        If there is no such difference, the experiment asks for a choice and the model has ties, or too few
        or too many observers are asked for.
    """
    model = model or ObserverModel()
    if by not in KINDS:
        raise OptionError(Problem(f"--by {by}", "does not exist", f"Choose among {', '.join(KINDS)}"))
    with opened(experiment, database, check_stimuli=True) as (described, engine):
        presentation = described.presentation
        if model.indifference and not presentation.ties:
            what = "makes ties, and the experiment asks for a choice"
            raise OptionError(Problem(f"--indifference {model.indifference}", what, "Leave it at 0"))
        files = {entry.sha256: Path(experiment) / entry.file for entry in described.stimuli}
        conditions = {entry.sha256: entry.condition for entry in described.stimuli}
        picture = cache(lambda digest: read_picture(files[digest]))
        difference = cache(lambda one, other: image_difference(picture(one), picture(other), by))

        def answer(judge: Judge, trial: Trial) -> Side:
            left, right = (difference(trial.reference, digest) for digest in (trial.left, trial.right))
            closer = model.gain * (right - left)
            return _SIDES[judge.answer(closer, conditions[trial.left], conditions[trial.right], on_left=True)]

        invited = invite(experiment, observers=observers, simulated=True, viewing=_VIEWING, database=database)
        answers = 0
        for invitation in invited:
            session = Session.by_code(engine, described, invitation.code)
            assert session is not None
            session.record_step("consent", {"agreed": True, "simulated": True})
            # Those who are invited later have noise of their own.
            random = np.random.default_rng([seed, *invitation.observer.encode()])
            taste = {name: random.normal(0, model.variety) for name in sorted(set(conditions.values()))}
            judge = Judge(model, taste, random)
            trial = session.next_trial()
            while trial is not None:
                side = answer(judge, trial)
                *_, trial = session.answer(
                    trial.token, side, presentation.minimum_view_s, {"simulated": True}
                )
                answers += 1
    return SimulateSummary(tuple(invitation.observer for invitation in invited), answers, by)
