"""The description of an experiment: what is shown, how, and what the observers are told.

It lies as ``experiment.json`` in the experiment's folder, beside the stimuli; the server needs nothing else.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from impasto.errors import ImpastoError, Problem, raise_problems
from impasto.output import write_text
from impasto.psychophysics.experiment.plan import Pair, PlannedTrial, plan_session
from impasto.store import digest

MANIFEST = "experiment.json"
STIMULI = "stimuli"
PHOTOGRAPH = "photograph"
"""The condition that is the reference, and, where the real image competes, a candidate too."""
DIMMED = "photograph-dimmed"
"""The photograph at half the exposure, the wrong answer of catch trials."""

_SCHEMA = 1

Layout = Literal["beside", "alternating"]

_CONSENT = """\
You are asked to look at pictures of painted surfaces and to say which of two is closer to a third. There \
are no right or wrong answers.

Stored are: your answers, how long each took, the size of your window, the viewing conditions, and the \
results of the checks before the start. Nothing that tells who you are is asked for or stored; you are known \
by a number only.

You may stop at any moment by closing the page, and have all your answers deleted by asking the \
experimenter."""

_CHOOSE = """\
Choose the one that looks closer to the photograph. If it is hard to say, choose what your first impression \
tells you."""

_INSTRUCTIONS: dict[Layout, str] = {
    "beside": f"""\
In the middle you see a photograph of a painted surface. At its left and right you see two reproductions of \
it.

{_CHOOSE}""",
    "alternating": f"""\
At one place you see, one at a time, a photograph of a painted surface and two reproductions of it. Change \
between them as often as you like.

{_CHOOSE}""",
}


class ExperimentError(ImpastoError):
    """An experiment's folder, database or answers that cannot be used."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Stimulus(_Part):
    """A picture that is shown.

    Parameters
    ----------
    sample, angle, condition : str
        Of which painting, under which light, and made how.
    file : str
        Within the experiment's folder.
    sha256 : str
        Of the file.
    """

    sample: str
    angle: str
    condition: str
    file: str
    sha256: str


class SampleInfo(_Part):
    """A painting in the experiment.

    Parameters
    ----------
    name : str
    store : str
        As it was given.
    stack_sha256 : str
    crop_px : (int, int, int, int)
        Left, top, width and height of what is shown, in pixels of the photographs.
    reduced : int
        So many pixels along a side were averaged to one.
    size_px : (int, int)
        Width and height of its pictures.
    exposure : float
        Factor on radiance per unit of the light's intensity; the same for all pictures of the sample.
    camera_colour : str
        Where the meaning of the camera's channels comes from.
    """

    name: str
    store: str
    stack_sha256: str
    crop_px: tuple[int, int, int, int]
    reduced: int
    size_px: tuple[int, int]
    exposure: float
    camera_colour: str


class AngleInfo(_Part):
    """A light under which the samples are shown.

    Parameters
    ----------
    label : str
        Degrees along the arm, or the photograph's name where the lights lie on none.
    photographs : dict of str to str
        The photograph's name per sample.
    highlight_share : dict of str to float
        Per sample, the share of the light from the surface that its highlight brings, as the fit has it.
    with_highlight : bool
        Whether that is more than a tenth in the mean over the samples.
    """

    label: str
    photographs: dict[str, str]
    highlight_share: dict[str, float]
    with_highlight: bool


class ConditionInfo(_Part):
    """What competes.

    Parameters
    ----------
    name : str
    model : str or None
        None for the photograph.
    photographs : dict of str to list of str
        Per sample, those that its fit used.
    reference_in_fit : bool
        Whether any photograph that serves as a reference was among them.
    recommended : bool
        Whether this is the group of angles that calculation recommends.
    """

    name: str
    model: str | None
    photographs: dict[str, list[str]] = {}
    reference_in_fit: bool = False
    recommended: bool = False


class Presentation(_Part):
    """How trials run.

    Parameters
    ----------
    layout : {'beside', 'alternating'}
        The reference between the candidates; or all three at one place, one at a time.
    ties : bool
        Whether "no difference" may be answered.
    repeats : int
        Pairs shown twice to each observer, to see whether the answers repeat.
    catch_every : int
        One trial with an obvious answer among so many; 0 for none.
    practice : int
        Trials before the first that counts.
    break_every : int
        A pause is offered after so many trials; 0 for none.
    minimum_view_s : float
        An answer is taken only after the pictures were seen for so long.
    adaptation_s : float
        How long the neutral field is looked at before the first trial.
    vision_checks : bool
        Whether plates for colour vision and rings for acuity come before the start.
    display_check : bool
        Whether the display is checked by eye before the start.
    """

    layout: Layout = "beside"
    ties: bool = False
    repeats: Annotated[int, Field(ge=0, le=1000)] = 5
    catch_every: Annotated[int, Field(ge=0, le=1000)] = 20
    practice: Annotated[int, Field(ge=0, le=50)] = 3
    break_every: Annotated[int, Field(ge=0, le=1000)] = 40
    minimum_view_s: Annotated[float, Field(ge=0, le=30)] = 1.0
    adaptation_s: Annotated[float, Field(ge=0, le=600)] = 60.0
    vision_checks: bool = False
    display_check: bool = True


class Viewing(_Part):
    """The conditions that the laboratory states; what is not stated, the page asks for.

    Parameters
    ----------
    display : str
        Name of the display.
    profile : str
        What it is calibrated or characterised to.
    luminance_cd_m2 : float or None
        Of its white.
    distance_mm : float or None
        From the eyes to the display.
    surround : str
        What is behind and around it, and the room's light.
    """

    display: Annotated[str, Field(max_length=100)] = ""
    profile: Annotated[str, Field(max_length=100)] = ""
    luminance_cd_m2: Annotated[float, Field(gt=0, le=10_000)] | None = None
    distance_mm: Annotated[float, Field(ge=100, le=10_000)] | None = None
    surround: Annotated[str, Field(max_length=200)] = ""


class Texts(_Part):
    """What observers read; paragraphs are separated by empty lines.

    Parameters
    ----------
    title, consent, instructions : str
    """

    title: str
    consent: str = _CONSENT
    instructions: str = _INSTRUCTIONS["beside"]


class Experiment(_Part):
    """An experiment.

    Parameters
    ----------
    impasto_experiment : int
        Version of this description.
    program : str
        What made it.
    design : str
        ``models`` or ``angle-groups``.
    seed : int
        Of every random choice.
    texts : Texts
    presentation : Presentation
    viewing : Viewing
    display : str
        What the pictures are made for.
    highlights : str
        What was done with colours brighter than its white.
    samples : list of SampleInfo
    angles : list of AngleInfo
    conditions : list of ConditionInfo
    pairs : list of (str, str, str, str)
        Sample, angle and the two conditions of each comparison.
    stimuli : list of Stimulus
    """

    impasto_experiment: Literal[1] = 1
    program: str
    design: str
    seed: int
    texts: Texts
    presentation: Presentation
    viewing: Viewing
    display: str
    highlights: str
    samples: list[SampleInfo]
    angles: list[AngleInfo]
    conditions: list[ConditionInfo]
    pairs: list[tuple[str, str, str, str]]
    stimuli: list[Stimulus]

    @property
    def design_sha256(self) -> str:
        """Digest of what the answers refer to: samples, pairs and pictures, not texts and timing."""
        return digest([self.seed, self.pairs, [stimulus.sha256 for stimulus in self.stimuli]])

    @property
    def catches(self) -> list[Pair]:
        """The pairs with an obvious answer: the reference itself against the dimmed one."""
        return [
            Pair(stimulus.sample, stimulus.angle, PHOTOGRAPH, DIMMED)
            for stimulus in self.stimuli
            if stimulus.condition == DIMMED
        ]

    def pictures(self) -> dict[tuple[str, str, str], str]:
        """Return the digest of each picture, which names it to the page, by sample, angle and condition."""
        return {
            (stimulus.sample, stimulus.angle, stimulus.condition): stimulus.sha256
            for stimulus in self.stimuli
        }


def session_trials(experiment: Experiment, number: int) -> list[PlannedTrial]:
    """Return the trials of the session of a number, from 0; see `plan_session`."""
    presentation = experiment.presentation
    return plan_session(
        [Pair(*pair) for pair in experiment.pairs],
        experiment.catches,
        seed=experiment.seed,
        number=number,
        repeats=presentation.repeats,
        catch_every=presentation.catch_every,
        practice=presentation.practice,
    )


def default_instructions(layout: Layout) -> str:
    """Return what observers are told where the laboratory says nothing else."""
    return _INSTRUCTIONS[layout]


def write_experiment(folder: Path, experiment: Experiment) -> None:
    """Write the description into the experiment's folder, whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(folder / MANIFEST, experiment.model_dump_json(indent=2) + "\n")


def read_experiment(folder: Path, *, check_stimuli: bool = True) -> Experiment:
    """Read the description of an experiment.

    Parameters
    ----------
    folder : Path
    check_stimuli : bool, optional
        Whether every picture's digest is compared too.

    Raises
    ------
    ExperimentError
        If there is none, it is damaged or from a newer version, or listing every picture that is missing or
        has changed.
    """
    path = folder / MANIFEST
    do = "Make it with: impasto experiment create STORE --out FOLDER"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        what = f"is no finished experiment: {MANIFEST} cannot be read: {error.strerror}"
        raise ExperimentError(Problem(str(folder), what, do)) from error
    except ValueError as error:
        raise ExperimentError(Problem(str(path), f"is damaged: {error}", do)) from error
    if isinstance(content, dict) and content.get("impasto_experiment", _SCHEMA) != _SCHEMA:
        what = f"is of version {content['impasto_experiment']}, and this program knows {_SCHEMA}"
        raise ExperimentError(Problem(str(path), what, "Use the program that made it, or a newer one"))
    try:
        experiment = Experiment.model_validate(content)
    except ValidationError as error:
        raise ExperimentError(validation_problems(str(path), error, do)) from error
    if check_stimuli:
        raise_problems(ExperimentError, _damaged(folder, experiment.stimuli))
    return experiment


def validation_problems(where: str, error: ValidationError, do: str) -> list[Problem]:
    """Return a problem for each thing that pydantic found wrong."""
    return [
        Problem(f"{where}: {'.'.join(map(str, entry['loc']))}", str(entry["msg"]).lower(), do)
        for entry in error.errors()
    ]


def _damaged(folder: Path, stimuli: Iterable[Stimulus]) -> list[Problem]:
    problems = []
    for stimulus in stimuli:
        found = file_sha256(folder / stimulus.file)
        if found != stimulus.sha256:
            what = "is missing" if found is None else "is not the picture that the experiment was made with"
            do = "Run the same impasto experiment create command again"
            problems.append(Problem(str(folder / stimulus.file), what, do))
    return problems


def file_sha256(path: Path) -> str | None:
    """Return the digest of a file, None where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
