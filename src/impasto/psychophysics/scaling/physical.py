"""Does a measured difference predict which condition is chosen?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.errors import Problem, raise_problems
from impasto.psychophysics.scaling.groups import ScaledGroup
from impasto.psychophysics.scaling.trials import Trial, TrialsError, read_table

_KEYS = ("sample", "angle", "condition")
Errors = Mapping[str, Mapping[tuple[str, str, str], float]]


@dataclass(frozen=True)
class PhysicalError:
    """A measured difference beside the visual scale.

    Parameters
    ----------
    name : str
        Such as "RMS", "CIEDE2000" or "FLIP", as the table has it.
    answers : int
        Answers to pairs of which both differences are known, without ties.
    predicted : float
        Share of them in which the condition with the smaller difference was chosen; 0.5 is chance.
    low, high : float
        Limits of `predicted` at 95 %, by the bootstrap over observers.
    correlation : float
        Pearson's, of scale values and differences, both relative to their mean in each group; negative if a
        smaller difference is seen as closer. NaN with fewer than three points.
    points : tuple of (str, str, float, float, float, float)
        Group, condition, mean difference, scale value and its limits.
    """

    name: str
    answers: int
    predicted: float
    low: float
    high: float
    correlation: float
    points: tuple[tuple[str, str, float, float, float, float], ...]


def read_errors(path: str | PathLike[str]) -> Errors:
    """Read measured differences: the columns sample, angle and condition, then one per kind of difference.

    Parameters
    ----------
    path : path

    Returns
    -------
    mapping of str to mapping of (str, str, str) to float
        For each kind, the difference by sample, angle and condition.

    Raises
    ------
    TrialsError
        With all problems of the file.
    """
    file = Path(path)
    header, rows = read_table(file, "Give a CSV file of differences")
    kinds = [name for name in header if name not in _KEYS]
    if not set(_KEYS) <= set(header) or not kinds:
        raise TrialsError(
            Problem(
                where=f"{file} row 1",
                what=f"has the columns {', '.join(header) or 'none'}",
                do="Name the columns sample, angle, condition, and one for each kind of difference",
            )
        )
    errors: dict[str, dict[tuple[str, str, str], float]] = {kind: {} for kind in kinds}
    problems = []
    for number, row in enumerate(rows, start=2):
        key = tuple((row[name] or "").strip() for name in _KEYS)
        for kind in kinds:
            try:
                value = float(row[kind] or "nan")
            except ValueError:
                problems.append(
                    Problem(
                        f"{file} row {number}", f"{kind} is {row[kind]}", "Write a number, or leave it empty"
                    )
                )
                continue
            if np.isfinite(value):
                errors[kind][key[0], key[1], key[2]] = value
    raise_problems(TrialsError, problems[:20])
    return errors


def relate(
    errors: Errors,
    trials: Sequence[Trial],
    groups: Sequence[ScaledGroup],
    *,
    draws: int = 1000,
    seed: int = 0,
) -> tuple[PhysicalError, ...]:
    """Compare measured differences with choices and with scale values.

    Parameters
    ----------
    errors : mapping
        As `read_errors` returns it.
    trials : sequence of Trial
    groups : sequence of ScaledGroup
        Those by angle and by sample give the points, or the pooled one if there are none.
    draws, seed : int, optional
        Of the bootstrap.

    Returns
    -------
    tuple of PhysicalError
    """
    observers = sorted({trial.observer for trial in trials})
    row = {name: number for number, name in enumerate(observers)}
    weights = np.random.default_rng(seed).multinomial(
        len(observers), np.full(len(observers), 1 / len(observers)), size=draws
    )
    found = []
    for name, values in errors.items():
        right, known = np.zeros(len(observers)), np.zeros(len(observers))
        for trial in trials:
            first = values.get((trial.sample, trial.angle, trial.condition_A))
            second = values.get((trial.sample, trial.angle, trial.condition_B))
            if trial.choice and first is not None and second is not None:
                known[row[trial.observer]] += 1
                # Where both are equal, a coin would be right half of the time.
                right[row[trial.observer]] += (
                    0.5 if first == second else (first < second) == (trial.choice > 0)
                )
        if not known.any():
            continue
        shares = weights @ right / np.maximum(weights @ known, 1)
        low, high = np.quantile(shares, [0.025, 0.975])
        points = tuple(_points(values, trials, groups))
        found.append(
            PhysicalError(
                name=name,
                answers=int(known.sum()),
                predicted=float(right.sum() / known.sum()),
                low=float(low),
                high=float(high),
                correlation=_correlation(points),
                points=points,
            )
        )
    return tuple(found)


def _points(
    values: Mapping[tuple[str, str, str], float], trials: Sequence[Trial], groups: Sequence[ScaledGroup]
) -> list[tuple[str, str, float, float, float, float]]:
    scenes = {(trial.sample, trial.angle) for trial in trials}
    single = [group for group in groups if group.by in ("angle", "sample")] or list(groups)
    points = []
    for group in single:
        word = group.name.partition(" ")[2]
        inside = [
            scene
            for scene in scenes
            if group.by == "pooled" or (scene[1] if group.by == "angle" else scene[0]) == word
        ]
        for number, condition in enumerate(group.conditions):
            known = [
                values[sample, angle, condition]
                for sample, angle in inside
                if (sample, angle, condition) in values
            ]
            if known and np.isfinite(group.scale[number]):
                place = (float(group.scale[number]), float(group.low[number]), float(group.high[number]))
                points.append((group.name, condition, float(np.mean(known)), *place))
    return points


def _correlation(points: Sequence[tuple[str, str, float, float, float, float]]) -> float:
    if len(points) < 3:
        return float("nan")
    names = [point[0] for point in points]
    both = np.array([point[2:4] for point in points])
    for name in set(names):
        inside = np.array([other == name for other in names])
        both[inside] -= both[inside].mean(axis=0)
    spread = both.std(axis=0)
    return float(np.mean(both[:, 0] * both[:, 1]) / (spread[0] * spread[1])) if spread.all() else float("nan")
