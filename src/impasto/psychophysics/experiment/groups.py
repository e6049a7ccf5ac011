"""Groups of photographs whose fits compete: read from a file and matched with the stores."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from impasto.errors import OptionError, Problem, raise_problems
from impasto.psychophysics.experiment.manifest import PHOTOGRAPH, validation_problems
from impasto.store import Stack

_DO = "Write it with: impasto angles STORE --groups FILE"


class Group(BaseModel):
    """Photographs that a fit may use.

    Parameters
    ----------
    name : str
        Such as ``11 angles``.
    photographs : list of str
        Their names.
    recommended : bool
        Whether calculation recommends this group.
    """

    model_config = ConfigDict(frozen=True)

    name: Annotated[str, Field(min_length=1, max_length=100)]
    photographs: Annotated[list[str], Field(min_length=1)]
    recommended: bool = False


class Groups(BaseModel):
    """What a file of groups holds.

    Parameters
    ----------
    groups : list of Group
    test_lights : list of str
        Photographs under whose lights the groups are to be compared; may be empty.
    """

    model_config = ConfigDict(frozen=True)

    groups: Annotated[list[Group], Field(min_length=1)]
    test_lights: list[str] = []


def read_groups(files: Sequence[str | PathLike[str]], stacks: Mapping[str, Stack]) -> dict[str, Groups]:
    """Return the groups of each sample.

    Parameters
    ----------
    files : sequence of path
        One file for all samples, or one for each, in their order.
    stacks : mapping of str to Stack
        By the name of the sample.

    Returns
    -------
    dict of str to Groups
        All have groups of the same names.

    Raises
    ------
    OptionError
        Listing every file that cannot be read or does not suit its store.
    """
    if len(files) not in {1, len(stacks)}:
        what = f"{len(files)} files of groups are given for {len(stacks)} samples"
        raise OptionError(Problem("--groups", what, "Give one for all, or one for each, in their order"))
    paths = [Path(file) for file in (files if len(files) == len(stacks) else [*files] * len(stacks))]
    problems: list[Problem] = []
    found = {}
    for path, (sample, stack) in zip(paths, stacks.items(), strict=True):
        try:
            found[sample] = _read(path)
        except OptionError as error:
            problems += error.problems
        else:
            problems += _unsuitable(path, found[sample], stack)
    raise_problems(OptionError, dict.fromkeys(problems))
    first_sample, first = next(iter(found.items()))
    names = [group.name for group in first.groups]
    raise_problems(
        OptionError,
        (
            Problem(
                f"--groups: sample {sample}",
                f"has groups other than those of sample {first_sample}: {', '.join(names)}",
                "Give groups of the same names for all samples",
            )
            for sample, groups in found.items()
            if [group.name for group in groups.groups] != names
        ),
    )
    return found


def _read(path: Path) -> Groups:
    try:
        return Groups.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise OptionError(Problem(f"--groups {path}", f"cannot be read: {error.strerror}", _DO)) from error
    except ValidationError as error:
        raise OptionError(validation_problems(f"--groups {path}", error, _DO)) from error
    except ValueError as error:
        raise OptionError(Problem(f"--groups {path}", f"is no JSON: {error}", _DO)) from error


def _unsuitable(path: Path, groups: Groups, stack: Stack) -> list[Problem]:
    known = set(stack.lights.names)
    names = [group.name for group in groups.groups]
    problems = [
        Problem(f"--groups {path}", f"the name {name!r} cannot be used", "Give each group a name of its own")
        for name in dict.fromkeys(names)
        if names.count(name) > 1 or name.startswith(PHOTOGRAPH)
    ]
    lists = {f"group {group.name}": group.photographs for group in groups.groups}
    lists["test_lights"] = groups.test_lights
    for where, photographs in lists.items():
        if unknown := [name for name in photographs if name not in known]:
            what = f"{where} names what is no photograph of {stack.store}: {', '.join(unknown)}"
            problems.append(Problem(f"--groups {path}", what, _DO))
    return problems
