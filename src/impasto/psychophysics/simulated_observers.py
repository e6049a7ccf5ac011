"""Observers who are no persons: Thurstone's model, driven by a measured difference from the reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from impasto.errors import OptionError, Problem, raise_problems
from impasto.psychophysics.scaling.trials import SIMULATED, Trial, in_order


@dataclass(frozen=True)
class ObserverModel:
    """How simulated observers judge.

    Parameters
    ----------
    gain : float, optional
        Distance on the scale, in standard deviations of a difference, that a difference of 1 from the
        reference makes.
    variety : float, optional
        Standard deviation between observers of the scale value of each condition: tastes differ.
    lapse : float, optional
        Share of answers that are given by chance alone.
    left : float, optional
        Advantage of the left, on the scale.
    indifference : float, optional
        Distance below which the answer is a tie; 0 for forced choice.
    """

    gain: float = 1.0
    variety: float = 0.0
    lapse: float = 0.02
    left: float = 0.0
    indifference: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises
        ------
        OptionError
            If one is out of its range.
        """
        raise_problems(
            OptionError,
            [
                Problem(f"{name} {value}", f"must be {range_}", "Correct it")
                for name, value, right, range_ in (
                    ("gain", self.gain, self.gain >= 0, "0 or more"),
                    ("variety", self.variety, self.variety >= 0, "0 or more"),
                    ("lapse", self.lapse, 0 <= self.lapse <= 1, "between 0 and 1"),
                    ("indifference", self.indifference, self.indifference >= 0, "0 or more"),
                )
                if not right
            ],
        )


def simulate_observers(
    differences: Mapping[tuple[str, str, str], float],
    *,
    observers: int = 18,
    model: ObserverModel | None = None,
    repeats: int = 0,
    reversed_observers: int = 0,
    seed: int = 0,
) -> tuple[Trial, ...]:
    """Let simulated observers compare all conditions under all samples and angles.

    Parameters
    ----------
    differences : mapping of (str, str, str) to float
        How far each sample, angle and condition is from the reference, such as CIEDE2000 or FLIP; the smaller
        one is seen as closer.
    observers : int, optional
    model : ObserverModel, optional
    repeats : int, optional
        Pairs that each observer is asked again.
    reversed_observers : int, optional
        How many of them, the last ones, answer the opposite.
    seed : int, optional

    Returns
    -------
    tuple of Trial
        Every observer's name begins with "simulated", and every trial is marked as simulated.

    Raises
    ------
    OptionError
        If there is nothing to compare, or a difference is no number.
    """
    model = model or ObserverModel()
    bad = [key for key, value in differences.items() if not np.isfinite(value)]
    if bad:
        raise OptionError(
            Problem(
                f"difference of {', '.join(bad[0])}", "is no number", "Leave out what could not be measured"
            )
        )
    random = np.random.default_rng(seed)
    conditions = in_order(condition for _, _, condition in differences)
    scenes = sorted({(sample, angle) for sample, angle, _ in differences})
    pairs = [
        (sample, angle, first, second)
        for sample, angle in scenes
        for first, second in combinations(conditions, 2)
        if (sample, angle, first) in differences and (sample, angle, second) in differences
    ]
    if not pairs:
        raise OptionError(
            Problem("differences", "hold no two conditions of one sample and angle", "Give at least two")
        )
    digits = len(str(observers))
    trials = []
    for number in range(1, observers + 1):
        taste = dict(zip(conditions, random.normal(0, model.variety, len(conditions)), strict=True))
        judge = Judge(model, taste, random, turned=number > observers - reversed_observers)
        asked = [pairs[index] for index in random.permutation(len(pairs))]
        again = [asked[index] for index in random.permutation(len(asked))[:repeats]]
        for kind, questions in (("test", asked), ("repeat", again)):
            for sample, angle, first, second in questions:
                on_left = bool(random.random() < 0.5)
                closer = model.gain * (differences[sample, angle, second] - differences[sample, angle, first])
                trials.append(
                    Trial(
                        observer=f"{SIMULATED}-{number:0{digits}d}",
                        sample=sample,
                        angle=angle,
                        condition_A=first,
                        condition_B=second,
                        choice=judge.answer(closer, first, second, on_left=on_left),
                        side="left" if on_left else "right",
                        kind=kind,
                        simulated=True,
                    )
                )
    return tuple(trials)


@dataclass(frozen=True)
class Judge:
    """One simulated observer.

    Parameters
    ----------
    model : ObserverModel
    taste : mapping of str to float
        What is added to the scale value of each condition.
    random : numpy.random.Generator
    turned : bool, optional
        Whether the answers are the opposite of what is seen.
    """

    model: ObserverModel
    taste: Mapping[str, float]
    random: np.random.Generator
    turned: bool = False

    def answer(self, closer: float, first: str, second: str, *, on_left: bool) -> int:
        """Return 1 for the first condition, −1 for the second, 0 for a tie.

        Parameters
        ----------
        closer : float
            How much closer the first is to the reference, on the scale.
        first, second : str
        on_left : bool
            Whether the first stands on the left.

        Returns
        -------
        int
        """
        if self.random.random() < self.model.lapse:
            return 1 if self.random.random() < 0.5 else -1
        seen = closer + self.taste.get(first, 0.0) - self.taste.get(second, 0.0)
        seen = (-seen if self.turned else seen) + (self.model.left if on_left else -self.model.left)
        seen += self.random.normal()
        if abs(seen) < self.model.indifference:
            return 0
        return 1 if seen > 0 else -1
