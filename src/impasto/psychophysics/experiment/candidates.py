"""What competes in an experiment: the fits of several models, or of several groups of photographs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Protocol

from impasto.errors import OptionError, Problem, StoreError, raise_problems
from impasto.fit import FitOptions, fit
from impasto.models import parse_model, parse_models
from impasto.psychophysics.experiment.groups import Groups
from impasto.store import Fit, Stack, digest, fit_attributes, open_fit
from impasto.store.borrow import borrowed_stack

USUAL_MODELS = ("torrance-sparrow", "phong")
_PROCEDURE = "joint"
"""Of all groups: the paper's needs more photographs without a highlight than small groups have."""


class Candidate(Protocol):
    """A condition other than the photograph."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def model(self) -> str:
        """Its model."""

    @property
    def recommended(self) -> bool:
        """Whether it is the group of angles that calculation recommends."""

    def used(self, sample: str) -> list[str]:
        """Return the names of the photographs that its fit of a sample uses."""

    def made_from(self, sample: str) -> str:
        """Return a digest of everything that its fit of a sample depends on."""

    def opened(self, sample: str) -> AbstractContextManager[Fit]:
        """Return a context in which its fit of a sample can be read."""


@dataclass(frozen=True)
class ModelCandidate:
    """A model, by the fits that are in the stores; see `Candidate`."""

    name: str
    fits: Mapping[str, Fit]
    stacks: Mapping[str, Stack]
    recommended: bool = False

    @property
    def model(self) -> str:
        """Its model."""
        return self.name

    def used(self, sample: str) -> list[str]:
        """Return the photographs that its fit of a sample uses."""
        excluded = FitOptions.of(self.fits[sample].attributes).exclude
        return [name for name in self.stacks[sample].lights.names if name not in excluded]

    def made_from(self, sample: str) -> str:
        """Return a digest of its fit of a sample."""
        return str(self.fits[sample].attributes["settings_sha256"])

    def opened(self, sample: str) -> AbstractContextManager[Fit]:
        """Return the fit in the store."""
        return nullcontext(self.fits[sample])


@dataclass(frozen=True)
class GroupCandidate:
    """A group of photographs, fitted anew into a temporary store when it is asked for; see `Candidate`."""

    name: str
    model: str
    photographs: Mapping[str, Sequence[str]]
    stacks: Mapping[str, Stack]
    recommended: bool = False
    show_progress: bool | None = None

    def used(self, sample: str) -> list[str]:
        """Return the photographs of the group, in the order of the stack."""
        return [name for name in self.stacks[sample].lights.names if name in self.photographs[sample]]

    def made_from(self, sample: str) -> str:
        """Return a digest of what will be fitted, and how."""
        options = self._options(sample).attributes({})
        return digest([self.stacks[sample].sha256, self.model, _PROCEDURE, options, self.used(sample)])

    @contextmanager
    def opened(self, sample: str) -> Iterator[Fit]:
        """Fit the group, jointly, with the options of the model's fit in the store if there is one."""
        with borrowed_stack(self.stacks[sample].store) as temporary:
            fit(
                temporary,
                models=[self.model],
                procedure=_PROCEDURE,
                options=self._options(sample),
                show_progress=self.show_progress,
            )
            yield open_fit(temporary, self.model)

    def _options(self, sample: str) -> FitOptions:
        stack = self.stacks[sample]
        found = fit_attributes(stack.store, self.model)
        options = FitOptions.of(found) if found else FitOptions()
        of_the_paper = {name: getattr(FitOptions, name) for name in ("refined", "threshold_deg", "highlight")}
        left_out = tuple(name for name in stack.lights.names if name not in self.photographs[sample])
        return replace(options, **of_the_paper, exclude=left_out)


def model_candidates(stacks: Mapping[str, Stack], models: Sequence[str]) -> list[ModelCandidate]:
    """Return one candidate per model.

    Raises
    ------
    OptionError
        If fewer than two models are named.
    StoreError
        Listing every fit that is missing or not finished.
    """
    names = [spec.name for spec in parse_models(models or USUAL_MODELS)]
    if len(names) < 2:
        what = f"names one model, {names[0]}, and two are compared at least"
        raise OptionError(Problem("--model", what, "Name the other one too"))
    problems: list[Problem] = []
    fits: dict[str, dict[str, Fit]] = {name: {} for name in names}
    for name in names:
        for sample, stack in stacks.items():
            try:
                fits[name][sample] = open_fit(stack.store, name)
            except StoreError as error:
                problems += error.problems
    raise_problems(StoreError, problems)
    return [ModelCandidate(name, found, stacks) for name, found in fits.items()]


def group_candidates(
    stacks: Mapping[str, Stack],
    groups: Mapping[str, Groups],
    models: Sequence[str],
    show_progress: bool | None = None,
) -> list[GroupCandidate]:
    """Return one candidate per group of photographs.

    Raises
    ------
    OptionError
        If more than one model is named, or it does not exist.
    """
    names = list(models) or [USUAL_MODELS[0]]
    if len(names) > 1:
        what = f"names {len(names)} models, and groups of angles are compared with one"
        raise OptionError(Problem("--model", what, "Make an experiment for each"))
    model = parse_model(names[0]).name
    first = next(iter(groups.values()))
    return [
        GroupCandidate(
            name=group.name,
            model=model,
            photographs={sample: groups[sample].groups[index].photographs for sample in stacks},
            stacks=stacks,
            recommended=any(groups[sample].groups[index].recommended for sample in stacks),
            show_progress=show_progress,
        )
        for index, group in enumerate(first.groups)
    ]
