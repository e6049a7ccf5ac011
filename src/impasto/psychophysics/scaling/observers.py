"""What is told about each observer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from impasto.psychophysics.scaling.comparisons import Comparisons, count_choices
from impasto.psychophysics.scaling.consistency import circular_triads, is_tournament, repeats
from impasto.psychophysics.scaling.screening import screen
from impasto.psychophysics.scaling.trials import Trial, in_order


@dataclass(frozen=True)
class ObserverReport:
    """One observer.

    Parameters
    ----------
    observer : str
    simulated : bool
        Whether this is no person.
    answers : int
    log10_likelihood, distance, log_reversed : float
    outlying, reversed : bool
        See `screening.Screened`.
    triads, most_triads : int
        Circular triads, and as many as are possible, over the samples and angles with complete choices.
    consistency : float
        Kendall's ζ over them; NaN without any.
    asked_again, same_again : int
        Repeated questions, and how many got the same answer.
    catches, caught : int
        Catch trials, of which the answer is known to be A, and how many were answered so.
    chose_left : float
        Share of the answers that went to the left; NaN if the sides are not known.
    """

    observer: str
    simulated: bool
    answers: int
    log10_likelihood: float
    distance: float
    log_reversed: float
    outlying: bool
    reversed: bool
    triads: int
    most_triads: int
    consistency: float
    asked_again: int
    same_again: int
    catches: int
    caught: int
    chose_left: float


def report_observers(trials: Sequence[Trial]) -> tuple[ObserverReport, ...]:
    """Compare each observer with the others and with themselves.

    Parameters
    ----------
    trials : sequence of Trial

    Returns
    -------
    tuple of ObserverReport
    """
    observers = in_order(trial.observer for trial in trials if trial.kind == "test")
    scenes: dict[tuple[str, str], list[Trial]] = {}
    for trial in trials:
        if trial.kind == "test":
            scenes.setdefault((trial.sample, trial.angle), []).append(trial)
    counted = [count_choices(scene, observers=observers) for scene in scenes.values()]
    asked = repeats(trials)
    reports = []
    for number, screened in enumerate(screen(counted)):
        own = [trial for trial in trials if trial.observer == screened.observer and trial.kind == "test"]
        triads, most = _triads(counted, number)
        again = asked.get(screened.observer)
        catch = [trial for trial in trials if trial.observer == screened.observer and trial.kind == "catch"]
        sided = [trial for trial in own if trial.side and trial.choice]
        left = sum((trial.side == "left") == (trial.choice > 0) for trial in sided)
        reports.append(
            ObserverReport(
                **screened.__dict__,
                simulated=any(trial.simulated for trial in own),
                answers=len(own),
                triads=triads,
                most_triads=most,
                consistency=1 - triads / most if most else float("nan"),
                asked_again=again.asked if again else 0,
                same_again=again.same if again else 0,
                catches=len(catch),
                caught=sum(trial.choice > 0 for trial in catch),
                chose_left=left / len(sided) if sided else float("nan"),
            )
        )
    return tuple(reports)


def _triads(groups: Sequence[Comparisons], observer: int) -> tuple[int, int]:
    complete = [group.wins[observer] for group in groups if is_tournament(group.wins[observer])]
    found = [circular_triads(wins) for wins in complete]
    return sum(each.triads for each in found), sum(each.most for each in found)
