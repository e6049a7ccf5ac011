"""The demo's experiment: simulated observers compare the models' renderings with photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from impasto.psychophysics.experiment.administer import export
from impasto.psychophysics.experiment.create import CreateSummary, create
from impasto.psychophysics.experiment.simulate import SimulateSummary, simulate
from impasto.psychophysics.scaling.scale import ScaleSummary, scale

OBSERVERS = 18
"""As many as judged in the paper [Chen2007]_."""

PARTS = ("experiment", "scales")
"""What it makes in the demo's folder."""


@dataclass(frozen=True)
class ObserversSummary:
    """What simulated observers chose.

    Parameters
    ----------
    created : CreateSummary
    simulated : SimulateSummary
    scaled : ScaleSummary
    """

    created: CreateSummary
    simulated: SimulateSummary
    scaled: ScaleSummary


def commands(store: Path, folder: Path, models: Sequence[str], angles: Sequence[str]) -> tuple[str, ...]:
    """Return the commands that do what `compare` does, without the program's name."""
    experiment, scales = (folder / part for part in PARTS)
    chosen = [*(f"--model {model}" for model in models), *(f"--angle {angle}" for angle in angles)]
    return (
        f"experiment create {store} --out {experiment} {' '.join(chosen)}",
        f"experiment simulate {experiment} --observers {OBSERVERS}",
        f"experiment export {experiment} {experiment}/trials.csv",
        f"scale {experiment}/trials.csv --errors {experiment} --out {scales}",
    )


def compare(
    store: Path,
    folder: Path,
    models: Sequence[str],
    angles: Sequence[str],
    *,
    show_progress: bool | None = None,
) -> ObserversSummary:
    """Make an experiment, let simulated observers answer, and scale their answers.

    Parameters
    ----------
    store : Path
    folder : Path
        The demo's; the experiment and the scales become folders in it.
    models, angles : sequence of str
        What competes, under the lights of which photographs.
    show_progress : bool, optional

    Returns
    -------
    ObserversSummary
    """
    experiment, scales = (folder / part for part in PARTS)
    created = create([store], out=experiment, models=models, angles=angles, show_progress=show_progress)
    simulated = simulate(experiment, observers=OBSERVERS)
    export(experiment, experiment / "trials.csv")
    scaled = scale(experiment / "trials.csv", errors=experiment, out=scales)
    return ObserversSummary(created, simulated, scaled)
