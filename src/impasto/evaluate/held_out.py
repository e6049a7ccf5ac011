"""Which photographs are kept out of the fit, so that they can judge it."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path, PurePosixPath

import numpy as np

from impasto.capture.light_files import read_light_file
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.fit.sample import deal_lights
from impasto.geometry import Lights, zenith_azimuth


def spread_lights(lights: Lights, count: int) -> list[int]:
    """Choose lights to hold out, spread in elevation.

    The lights are ordered by their zenith angle and cut into `count` groups of equal size, and the middle of
    each is chosen. So the choice is the same each time, covers low and high lights, and, where the groups
    have three lights or more, leaves the lowest and the highest to the fit.

    Parameters
    ----------
    lights : Lights
        The lights of a stack.
    count : int
        How many to hold out, from 1 to one fewer than there are.

    Returns
    -------
    list of int
        Indices into `lights`, in rising order.

    Raises
    ------
    OptionError
        If `count` leaves nothing to hold out or nothing to fit.
    """
    if not 1 <= count < len(lights):
        raise OptionError(
            Problem(
                where=f"--held-out {count}",
                what=f"of the stack's {len(lights)} photographs from 1 to {len(lights) - 1} can be held out",
                do="Choose a number in that range",
            )
        )
    zenith, _ = zenith_azimuth(lights.direction)
    order = np.argsort(zenith, kind="stable")
    return sorted(int(group[len(group) // 2]) for group in np.array_split(order, count))


def fold_lights(lights: Lights, folds: int) -> list[list[int]]:
    """Divide lights into folds, each spread in elevation and azimuth, so that each is held out once.

    Parameters
    ----------
    lights : Lights
        The lights of a stack.
    folds : int
        How many, from 2 to as many as there are lights.

    Returns
    -------
    list of list of int
        Indices into `lights`, in rising order.

    Raises
    ------
    OptionError
        If there are fewer lights than folds, or fewer than two folds.
    """
    if not 2 <= folds <= len(lights):
        what = f"is not from 2 to {len(lights)}, the number of photographs"
        raise OptionError(Problem(f"--folds {folds}", what, "Choose a number in that range, such as 5"))
    return deal_lights(lights, folds)


def named_lights(path: str | PathLike[str], names: tuple[str, ...]) -> list[int]:
    """Read from a file which photographs to hold out.

    Parameters
    ----------
    path : path
        A text file with one photograph per line, by its name with or without the ending; empty lines and what
        follows a # are ignored. Or a light file (.lp, .csv, .toml), of which only the names count.
    names : tuple of str
        The names of the stack's photographs.

    Returns
    -------
    list of int
        Indices into `names`, in rising order, each once.

    Raises
    ------
    OptionError
        Listing every name that no photograph of the stack has, or if the file cannot be read, names none or
        all of them.
    CaptureError
        If a light file cannot be read.
    """
    path = Path(path)
    if path.suffix.lower() in (".lp", ".csv", ".tsv", ".toml"):
        file = read_light_file(path)
        raise_problems(CaptureError, file.problems)
        return listed_lights([(row.where, row.file) for row in file.rows if row.file], names, str(path))
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a text file"
        raise OptionError(
            Problem(str(path), f"cannot be read: {reason}", "Give a text file with one photograph per line")
        ) from error
    entries = [(f"{path} line {number}", line.split("#")[0].strip()) for number, line in enumerate(lines, 1)]
    return listed_lights([entry for entry in entries if entry[1]], names, str(path))


def listed_lights(
    entries: Sequence[tuple[str, str]], names: tuple[str, ...], where: str = "held-out photographs"
) -> list[int]:
    """Return the lights that a list of names stands for.

    Parameters
    ----------
    entries : sequence of (str, str)
        Where each name stands, for messages, and the name, with or without folders and ending.
    names : tuple of str
        The names of the stack's photographs.
    where : str, optional
        What to call the list as a whole in messages.

    Returns
    -------
    list of int
        Indices into `names`, in rising order, each once.

    Raises
    ------
    OptionError
        Listing every name that no photograph has, or if the list names none or all of them.
    """
    indices = {name: index for index, name in enumerate(names)}
    found: set[int] = set()
    problems = []
    for place, entry in entries:
        short = PurePosixPath(entry.replace("\\", "/"))
        index = indices.get(short.name, indices.get(short.stem))
        if index is None:
            problems.append(
                Problem(
                    where=place,
                    what=f"no photograph of the stack is called {entry!r}",
                    do=f"Use the names in the store, such as {names[0]!r}",
                )
            )
        else:
            found.add(index)
    if not problems and not found:
        problems.append(Problem(where, "names no photograph", "Name at least one"))
    if len(found) == len(names):
        problems.append(
            Problem(where, "names every photograph, so none is left to fit", "Name only those to hold out")
        )
    raise_problems(OptionError, problems)
    return sorted(found)
