"""Pair lights with photographs by name, leaving out what the person asked to leave out."""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TypeVar

from impasto.capture.lights import LightFile, LightRow
from impasto.errors import Problem

Pair = tuple[LightRow, Path]
T = TypeVar("T")


def pair(
    lights: LightFile, photographs: Sequence[Path], exclude: Sequence[str]
) -> tuple[list[Pair], list[Path], list[str], list[Problem]]:
    """Pair each light with its photograph.

    Names are compared without their folders and without regard to case; where that fails, without their
    endings too, if that is unambiguous. Order is never used, unless the file has no names at all.

    Parameters
    ----------
    lights : LightFile
    photographs : sequence of Path
        In natural order.
    exclude : sequence of str
        Names of photographs to leave out, with or without ending; ``*`` and ``?`` stand for any characters.

    Returns
    -------
    pairs : list of (LightRow, Path)
        In the order of the light file.
    kept : list of Path
        All photographs that are not excluded, paired or not.
    notes : list of str
    problems : list of Problem
        Every light without a photograph, photograph without a light, and name that is not unique. Where rows
        could not be read, nobody knows which photographs have no light, and none is reported.
    """
    unread = bool(lights.problems)
    problems = [
        Problem(
            f"--exclude {pattern}",
            "matches no photograph and no light",
            "Correct the name; it may be given with or without ending, and with * for any characters",
        )
        for pattern in exclude
        if not any(_matches(name, [pattern]) for name in _all_names(lights, photographs))
    ]
    rows = [row for row in lights.rows if row.file is None or not _matches(_base(row.file), exclude)]
    kept = [path for path in photographs if not _matches(path.name, exclude)]
    left_out = [path.name for path in photographs if path not in kept]
    notes = [f"left out on request: {', '.join(left_out)}"] if left_out else []
    problems += _repeated_photographs(kept)
    if any(row.file is None for row in rows):
        # What is left out may have a direction, as a bad photograph, or none, as one of a test target.
        named = photographs if len(rows) == len(photographs) else kept
        if len(rows) != len(named):
            if unread:
                return [], kept, notes, problems
            # One problem, not one per photograph: without names nobody can say which one is too many.
            what = f"holds {len(rows)} directions without names, the folder {len(photographs)} photographs"
            do = "Remove what does not belong there, or give the lights by name in a .lp or CSV file"
            return [], kept, notes, [*problems, Problem(lights.path.name, what, do)]
        notes.append(
            f"{lights.path.name} has no names: its directions were taken for the photographs in the natural "
            f"order of their names, {named[0].name} to {named[-1].name}"
        )
        pairs = [(row, path) for row, path in zip(rows, named, strict=True) if path in kept]
        return pairs, kept, notes, problems
    pairs, pair_notes, pair_problems = _pair_by_name(lights.path.name, rows, kept, unread)
    return pairs, kept, notes + pair_notes, problems + pair_problems


def _pair_by_name(
    light_file: str, rows: Sequence[LightRow], photographs: Sequence[Path], unread: bool
) -> tuple[list[Pair], list[str], list[Problem]]:
    by_name = _group(photographs, lambda path: _key(path.name))
    by_stem = _group(photographs, lambda path: _key(path.stem))
    stems = _group(rows, lambda row: _key(_stem(_base(row.file or ""))))
    found: dict[Path, list[LightRow]] = defaultdict(list)
    pairs, problems, other_ending = [], [], []
    for row in rows:
        base = _base(row.file or "")
        candidates = by_name.get(_key(base)) or by_stem.get(_key(base))
        if not candidates and len(stems[_key(_stem(base))]) == 1:
            candidates = by_stem.get(_key(_stem(base)))
            if candidates and len(candidates) == 1:
                other_ending.append((base, candidates[0].name))
        if not candidates:
            do = "Add the photograph, correct the name, or leave it out with --exclude"
            problems.append(Problem(row.where, f"no photograph is named {base}", do))
            continue
        # More than one candidate means photographs of equal names, which are reported as such.
        pairs.append((row, candidates[0]))
        found[candidates[0]] += [row]
        for path in candidates[1:]:
            found[path] += [row]
    for path, named in found.items():
        if len(named) > 1:
            what = f"is named by {len(named)} lights: {', '.join(row.where for row in named)}"
            problems.append(Problem(path.name, what, f"Keep one of them in {light_file}"))
    for path in photographs:
        if path not in found and not unread:
            do = f"Add it to {light_file}, or leave it out with --exclude"
            problems.append(Problem(path.name, f"no light in {light_file} has this name", do))
    notes = []
    if other_ending:
        written, real = other_ending[0]
        notes.append(
            f"{len(other_ending)} photographs paired without their endings, such as {written} with {real}"
        )
    return pairs, notes, problems


def _repeated_photographs(photographs: Sequence[Path]) -> list[Problem]:
    groups = _group(photographs, lambda path: _key(path.stem))
    return [
        Problem(
            ", ".join(path.name for path in paths),
            "photographs have the same name but for ending or case",
            "Keep one of them, or leave the others out with --exclude and the full name",
        )
        for paths in groups.values()
        if len(paths) > 1
    ]


def _group(items: Iterable[T], key: Callable[[T], str]) -> dict[str, list[T]]:
    groups: dict[str, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def _all_names(lights: LightFile, photographs: Sequence[Path]) -> list[str]:
    return [path.name for path in photographs] + [_base(row.file) for row in lights.rows if row.file]


def _matches(name: str, patterns: Iterable[str]) -> bool:
    names = (_key(name), _key(_stem(name)))
    wanted = [_key(pattern) for pattern in patterns]
    return any(pattern in names or any(fnmatchcase(name, pattern) for name in names) for pattern in wanted)


def _base(name: str) -> str:
    """Return a name without the folders that it had on whatever machine wrote it."""
    return re.split(r"[/\\]", name.rstrip("/\\ "))[-1].strip()


def _stem(name: str) -> str:
    return Path(name).stem


def _key(name: str) -> str:
    """Return a name as it is compared: macOS and others write the same accents in different ways."""
    return unicodedata.normalize("NFC", name).casefold()
