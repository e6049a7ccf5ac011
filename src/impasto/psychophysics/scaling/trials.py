"""Read the answers of an experiment: a table with one row per trial."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from impasto.errors import ImpastoError, Problem, raise_problems
from impasto.output import write_text

COLUMNS = ("observer", "sample", "angle", "condition_A", "condition_B", "choice")
"""The columns that every table of trials has."""

SIMULATED = "simulated"
"""Word at the start of the name of an observer who is no person."""

_CHOICES = {"A": 1, "B": -1, "TIE": 0}
_KINDS = ("test", "repeat", "catch", "practice")
_YES, _NO = frozenset({"1", "true", "yes"}), frozenset({"", "0", "false", "no"})
# A file of the wrong kind would otherwise give a problem for each of its rows.
_PROBLEMS_SHOWN = 20


class TrialsError(ImpastoError):
    """A table of trials that cannot be used."""


@dataclass(frozen=True)
class Trial:
    """One answer.

    Parameters
    ----------
    observer, sample, angle : str
    condition_A, condition_B : str
        What was compared with the reference.
    choice : int
        1 where A was chosen, −1 where B was, 0 for a tie.
    side : str
        Where A stood: "left", "right", or "" where that is not known.
    kind : str
        "test", "repeat" (asked again, to see whether the answer stays), "catch" (the answer is known) or
        "practice".
    simulated : bool
        Whether the observer is no person.
    """

    observer: str
    sample: str
    angle: str
    condition_A: str
    condition_B: str
    choice: int
    side: str = ""
    kind: str = "test"
    simulated: bool = False


def read_table(file: Path, do: str) -> tuple[list[str], list[dict[str | Any, str | Any]]]:
    """Read a CSV file whose first row names the columns.

    Parameters
    ----------
    file : Path
    do : str
        What the error says to do.

    Returns
    -------
    header : list of str
    rows : list of dict of str to str
        Cells beyond the header's under the key None.

    Raises
    ------
    TrialsError
        If it cannot be read.
    """
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream)
            header = [name.strip() for name in reader.fieldnames or ()]
            reader.fieldnames = header
            return header, list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "is no text in UTF-8 with commas"
        raise TrialsError(Problem(str(file), f"cannot be read: {reason}", do)) from error


def read_trials(path: str | PathLike[str]) -> tuple[Trial, ...]:
    """Read a CSV file with one row per trial.

    Parameters
    ----------
    path : path
        Has the columns `COLUMNS`; `side`, `kind` and `simulated` are used if there, others are not.

    Returns
    -------
    tuple of Trial
        In the order of the file.

    Raises
    ------
    TrialsError
        With all problems of the file, if it cannot be read or a row cannot be understood.
    """
    file = Path(path)
    header, rows = read_table(file, "Give the CSV file of an experiment")
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise TrialsError(
            Problem(
                where=f"{file} row 1",
                what=f"lacks the columns {', '.join(missing)}; it has {', '.join(header) or 'none'}",
                do=f"Name the columns {', '.join(COLUMNS)}; docs/scaling.md describes them",
            )
        )
    trials, problems = [], []
    for number, row in enumerate(rows, start=2):
        cells = {name: (row.get(name) or "").strip() for name in header}
        where = f"{file} row {number}"
        found = [*_problems(where, cells)]
        if row.get(None):
            found.append(Problem(where, "has more cells than the first row", "Quote cells that hold commas"))
        problems += found
        if not found:
            trials.append(_trial(cells))
    if not rows:
        problems = [Problem(str(file), "has no trials", "Export the experiment after the first answers")]
    if len(problems) > _PROBLEMS_SHOWN:
        left = len(problems) - _PROBLEMS_SHOWN
        more = Problem(str(file), f"{left} more rows have problems", "Correct these first")
        problems = [*problems[:_PROBLEMS_SHOWN], more]
    raise_problems(TrialsError, problems)
    return tuple(trials)


def _problems(where: str, cells: Mapping[str, str]) -> Iterable[Problem]:
    for name in ("observer", "condition_A", "condition_B"):
        if not cells[name]:
            yield Problem(where, f"the cell {name} is empty", "Fill it in, or delete the row")
    if cells["condition_A"] and cells["condition_A"] == cells["condition_B"]:
        what = f"compares {cells['condition_A']} with itself"
        yield Problem(where, what, "Name two different conditions, or delete the row")
    if cells["choice"].upper() not in _CHOICES:
        what = f"choice is {cells['choice'] or 'empty'}, and must be A, B or tie"
        yield Problem(where, what, "Write A for condition_A, B for condition_B, or tie")
    if cells.get("side", "").lower() not in ("", "left", "right"):
        what = f"side is {cells['side']}, and must be left, right or empty"
        yield Problem(where, what, "Write where condition_A stood")
    if cells.get("kind", "").lower() not in ("", *_KINDS):
        what = f"kind is {cells['kind']}, and must be {', '.join(_KINDS)} or empty"
        yield Problem(where, what, "Correct it, or delete the column")
    if cells.get("simulated", "").lower() not in _YES | _NO:
        what = f"simulated is {cells['simulated']}, and must be yes, no or empty"
        yield Problem(where, what, "Correct it: nobody may take a simulated observer for a person")


def _trial(cells: Mapping[str, str]) -> Trial:
    return Trial(
        observer=cells["observer"],
        sample=cells["sample"],
        angle=cells["angle"],
        condition_A=cells["condition_A"],
        condition_B=cells["condition_B"],
        choice=_CHOICES[cells["choice"].upper()],
        side=cells.get("side", "").lower(),
        kind=cells.get("kind", "").lower() or "test",
        # A name that says so counts as well as a column: columns get lost when tables are merged.
        simulated=cells.get("simulated", "").lower() in _YES or is_simulated(cells["observer"]),
    )


def is_simulated(observer: str) -> bool:
    """Return whether the name says that an observer is no person."""
    return observer.lower().startswith(SIMULATED)


def write_trials(path: str | PathLike[str], trials: Iterable[Trial]) -> None:
    """Write trials as `read_trials` reads them.

    Parameters
    ----------
    path : path
    trials : iterable of Trial

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    names = {1: "A", -1: "B", 0: "tie"}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, "side", "kind", "simulated"])
    for trial in trials:
        writer.writerow(
            [
                *(getattr(trial, name) for name in COLUMNS[:-1]),
                names[trial.choice],
                trial.side,
                trial.kind,
                "yes" if trial.simulated else "no",
            ]
        )
    write_text(Path(path), text.getvalue())


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return the different names in the order of people: −5 before 10, and "5 angles" before "11 angles".

    Parameters
    ----------
    names : iterable of str

    Returns
    -------
    tuple of str
    """

    def rank(name: str) -> tuple[float, list[tuple[float, str]]]:
        try:
            value = float(name)
        except ValueError:
            value = math.inf
        parts = re.split(r"(\d+)", name.casefold())
        return value, [(float(part), "") if part.isdigit() else (math.inf, part) for part in parts if part]

    return tuple(sorted(set(names), key=rank))
