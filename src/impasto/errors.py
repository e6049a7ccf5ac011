"""Errors that tell the person at the keyboard what to do.

Every error has four parts: what is wrong, where, what was found against what was expected, and what to do.
Input is checked as a whole: a stage collects a list of problems and raises them together.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with the input.

    Parameters
    ----------
    where : str
        The file, row, option or pixel concerned.
    what : str
        What is wrong, with what was found against what was expected.
    do : str
        What the person can do about it.
    """

    where: str
    what: str
    do: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}. {self.do}."


class ImpastoError(Exception):
    """Base of every error that impasto raises on purpose; carries one or more problems.

    Parameters
    ----------
    problems : Problem or iterable of Problem
        Everything that is wrong, in the order of the input.
    """

    def __init__(self, problems: Problem | Iterable[Problem]) -> None:
        self.problems = [problems] if isinstance(problems, Problem) else list(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class CaptureError(ImpastoError):
    """Photographs, light files or calibration files that cannot be used."""


class StoreError(ImpastoError):
    """A store that is missing, damaged, incomplete or from another version."""


class OptionError(ImpastoError):
    """An option or argument that does not exist or does not fit the data."""


class OutputError(ImpastoError):
    """Pictures and pages that cannot be written."""


def raise_problems(error: type[ImpastoError], problems: Iterable[Problem]) -> None:
    """Raise `error` with all `problems`, or return when there are none.

    Raises
    ------
    ImpastoError
        The given subclass, if `problems` is not empty.
    """
    problems = list(problems)
    if problems:
        raise error(problems)
