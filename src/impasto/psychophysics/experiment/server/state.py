"""What a server serves."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy import Engine

from impasto.psychophysics.experiment.manifest import Experiment
from impasto.psychophysics.experiment.server.limits import Limits, Rate


@dataclass(frozen=True)
class Served:
    """An experiment that is served, and who asked how often.

    Parameters
    ----------
    folder : Path
        Of the experiment.
    experiment : Experiment
    engine : Engine
        Its answers.
    admin_token : str
        What the laboratory shows.
    limits : Limits

    Attributes
    ----------
    requests, guesses : Rate
        Of each session and the laboratory; and of wrong codes, by address.
    files : dict of str to Path
        The pictures by their digest.
    """

    folder: Path
    experiment: Experiment
    engine: Engine
    admin_token: str = field(repr=False)
    limits: Limits = field(default_factory=Limits)
    requests: Rate = field(init=False)
    guesses: Rate = field(init=False)
    files: dict[str, Path] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        limits = self.limits
        made = {
            "requests": Rate(limits.per_second, limits.at_once),
            "guesses": Rate(limits.guesses_per_second, limits.guesses_at_once),
            "files": {entry.sha256: self.folder / entry.file for entry in self.experiment.stimuli},
        }
        for name, value in made.items():
            object.__setattr__(self, name, value)
