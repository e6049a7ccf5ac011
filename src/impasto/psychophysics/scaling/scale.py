"""The stage `scale`: from a table of answers to interval scales, their limits and their figures."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.errors import OptionError, Problem, raise_problems
from impasto.output import prepare_folder
from impasto.psychophysics.scaling.closed_form import ZERO_ONE_RULES
from impasto.psychophysics.scaling.groups import MODELS, ScaledGroup, ScaleOptions, scale_group
from impasto.psychophysics.scaling.limits import METHODS
from impasto.psychophysics.scaling.observers import ObserverReport, report_observers
from impasto.psychophysics.scaling.physical import Errors, PhysicalError, read_errors, relate
from impasto.psychophysics.scaling.trials import Trial, in_order, read_trials


@dataclass(frozen=True)
class ScaleSummary:
    """What `scale` found.

    Parameters
    ----------
    trials : Path
    unit : str
        "z", "jod" or "log-odds".
    options : ScaleOptions
    answers : int
        Those that are scaled.
    simulated : int
        How many of the observers are no persons.
    excluded : tuple of str
        Observers left out on request.
    groups : tuple of ScaledGroup
        Pooled first, then by pool, angle and sample.
    observers : tuple of ObserverReport
        Those left out are among them, compared with the others.
    physical : tuple of PhysicalError
        How well each measured difference predicts the choices.
    files : tuple of Path
    seconds : float
    """

    trials: Path
    unit: str
    options: ScaleOptions
    answers: int
    simulated: int
    excluded: tuple[str, ...]
    groups: tuple[ScaledGroup, ...]
    observers: tuple[ObserverReport, ...]
    physical: tuple[PhysicalError, ...]
    files: tuple[Path, ...]
    seconds: float


def scale(
    trials: str | PathLike[str],
    *,
    options: ScaleOptions | None = None,
    conditions: Sequence[str] = (),
    pools: Mapping[str, Sequence[str]] | None = None,
    exclude: Sequence[str] = (),
    errors: str | PathLike[str] | None = None,
    out: str | PathLike[str] | None = None,
) -> ScaleSummary:
    """Turn observers' choices into an interval scale, per angle, per sample and pooled [Thurstone1927]_.

    Parameters
    ----------
    trials : path
        CSV file with one row per trial; see `trials.read_trials`.
    options : ScaleOptions, optional
        Model, limits and unit.
    conditions : sequence of str, optional
        Conditions to scale, in the order in which they are told; by default all, sorted.
    pools : mapping of str to sequence of str, optional
        Sets of angles to be scaled together, such as those with a highlight.
    exclude : sequence of str, optional
        Observers to leave out; they are named in the result.
    errors : path, optional
        Folder of the experiment, whose pictures are then compared with the photographs, or CSV file with the
        columns sample, angle and condition and one column per measured difference from the reference.
    out : path, optional
        Folder for figures (PNG) and the scale as a table (CSV).

    Returns
    -------
    ScaleSummary

    Raises
    ------
    TrialsError
        If the table of trials or of errors cannot be used.
    OptionError
        If an option, a condition, an angle or an observer does not exist, or the limits cannot be had.
    OutputError
        If the files cannot be written.
    """
    started = time.perf_counter()
    options = options or ScaleOptions()
    path = Path(trials)
    everything = read_trials(path)
    chosen = conditions or in_order(
        name
        for trial in everything
        if trial.kind == "test"
        for name in (trial.condition_A, trial.condition_B)
    )
    pools = pools or {}
    _check(everything, options, chosen, pools, exclude)
    kept = [
        trial
        for trial in everything
        if trial.observer not in exclude and {trial.condition_A, trial.condition_B} <= set(chosen)
    ]
    measured = _measured(Path(errors)) if errors else None
    groups = tuple(
        scale_group(name, by, part, chosen, options) for name, by, part in _parts(kept, pools) if part
    )
    tested = [trial for trial in kept if trial.kind == "test"]
    physical = relate(measured, tested, groups) if measured else ()
    summary = ScaleSummary(
        trials=path,
        unit=options.unit_name,
        options=options,
        answers=len(tested),
        simulated=len({trial.observer for trial in tested if trial.simulated}),
        excluded=tuple(exclude),
        groups=groups,
        observers=report_observers(everything),
        physical=physical,
        files=(),
        seconds=0.0,
    )
    files: tuple[Path, ...] = ()
    if out is not None:
        from impasto.psychophysics.scaling.figures import write_figures

        files = write_figures(prepare_folder(out), summary)
    return ScaleSummary(**{**summary.__dict__, "files": files, "seconds": time.perf_counter() - started})


def _measured(path: Path) -> Errors:
    """Return the differences in a table, or those of an experiment's pictures."""
    if not path.is_dir():
        return read_errors(path)
    from impasto.psychophysics.differences import measure_differences

    return measure_differences(path)


def _parts(trials: Sequence[Trial], pools: Mapping[str, Sequence[str]]) -> list[tuple[str, str, list[Trial]]]:
    """Return name, kind and trials of all groups; a group that is everything is not told twice."""
    tested = [trial for trial in trials if trial.kind == "test"]
    parts = [("pooled", "pooled", tested)]
    for name, angles in pools.items():
        parts.append((name, "pool", [trial for trial in tested if trial.angle in angles]))
    for by in ("angle", "sample"):
        names = in_order(getattr(trial, by) for trial in tested)
        if len(names) > 1:
            for name in names:
                part = [trial for trial in tested if getattr(trial, by) == name]
                parts.append((f"{by} {name or 'not named'}", by, part))
    return parts


def _check(
    trials: Sequence[Trial],
    options: ScaleOptions,
    conditions: Sequence[str],
    pools: Mapping[str, Sequence[str]],
    exclude: Sequence[str],
) -> None:
    tested = [trial for trial in trials if trial.kind == "test"]
    known = {
        "condition": {name for trial in tested for name in (trial.condition_A, trial.condition_B)},
        "angle": {trial.angle for trial in tested},
        "observer": {trial.observer for trial in trials},
    }
    asked = {
        "condition": list(conditions),
        "angle": [angle for angles in pools.values() for angle in angles],
        "observer": list(exclude),
    }
    problems = [
        Problem(f"{kind} {name}", "does not occur in the trials", f"Choose among {_some(known[kind])}")
        for kind, names in asked.items()
        for name in names
        if name not in known[kind]
    ]
    for what, value, choices in (
        ("model", options.model, MODELS),
        ("zero/one rule", options.rule, ZERO_ONE_RULES),
        ("limits", options.limits, METHODS),
        ("unit", options.unit, {"z": "", "jod": ""}),
    ):
        if value not in choices:
            problems.append(
                Problem(f"{what} {value}", "does not exist", f"Choose among {', '.join(choices)}")
            )
    if not 0 < options.level < 1:
        problems.append(Problem(f"level {options.level}", "is not between 0 and 1", "Give, say, 0.95"))
    if options.draws < 100:
        problems.append(Problem(f"draws {options.draws}", "are fewer than 100", "Give 1000 or more"))
    if not problems and not {trial.observer for trial in tested} - set(exclude):
        problems.append(Problem("observers", "are all left out", "Leave out fewer"))
    if not problems and len(conditions) < 2:
        problems.append(Problem("conditions", "are fewer than two", "Name at least two conditions"))
    raise_problems(OptionError, problems)


def _some(names: set[str]) -> str:
    listed = in_order(names)
    return ", ".join(listed[:12]) + (", …" if len(listed) > 12 else "")
