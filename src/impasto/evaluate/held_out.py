"""Which photographs are kept out of the fit, so that they can judge it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem, raise_problems
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


def named_lights(path: str | Path, names: tuple[str, ...]) -> list[int]:
    """Read which photographs to hold out from a file.

    Parameters
    ----------
    path : path
        A text file with one photograph per line, by its name with or without the ending. Empty lines and what
        follows a # are ignored. A .lp file does as well: its first line may hold a count, and only the name
        before the three numbers of each line is read.
    names : tuple of str
        The names of the stack's photographs.

    Returns
    -------
    list of int
        Indices into `names`, in rising order, each once.

    Raises
    ------
    OptionError
        Listing every line that names no photograph of the stack, or if the file cannot be read, names none or
        all of them.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a text file"
        raise OptionError(
            Problem(str(path), f"cannot be read: {reason}", "Give a text file with one photograph per line")
        ) from error
    indices = {name: index for index, name in enumerate(names)}
    found: set[int] = set()
    problems = []
    for number, line in enumerate(lines, start=1):
        entry = _name(line, light_file=path.suffix.lower() == ".lp")
        if not entry or (number == 1 and entry.isdigit() and entry not in indices):
            continue
        short = Path(entry.replace("\\", "/")).name
        index = indices.get(short, indices.get(Path(short).stem))
        if index is None:
            problems.append(
                Problem(
                    where=f"{path} line {number}",
                    what=f"no photograph of the stack is called {entry!r}",
                    do=f"Use the names in the store, such as {names[0]!r}",
                )
            )
        else:
            found.add(index)
    if not problems and not found:
        problems.append(Problem(str(path), "names no photograph", "Write one photograph per line"))
    if len(found) == len(names):
        problems.append(
            Problem(
                str(path), "names every photograph, so none is left to fit", "Name only those to hold out"
            )
        )
    raise_problems(OptionError, problems)
    return sorted(found)


def _name(line: str, light_file: bool) -> str:
    """Return the name in a line, without comment and, in a .lp file, without the three numbers after it."""
    line = line.split("#")[0].strip()
    if not light_file:
        return line.strip("\"'")
    parts = line.rsplit(maxsplit=3)
    return parts[0].strip("\"'") if len(parts) == 4 else line
