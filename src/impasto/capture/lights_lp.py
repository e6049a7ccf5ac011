"""Read ``.lp`` files: a count, then one photograph and its light direction per line."""

from __future__ import annotations

import re
from pathlib import Path

from impasto.capture.lights import LightFile, LightRow, parse_number
from impasto.errors import Problem

_POINT_NUMBER = r"(?:[-+−]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?(?:nan|inf))"
_ANY_NUMBER = r"(?:[-+−]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[-+]?\d+)?|[-+]?(?:nan|inf))"
_NAME = r"(?:\"(?P<quoted>[^\"]+)\"|(?P<name>.+?))"


def _line(number: str, separator: str) -> re.Pattern[str]:
    return re.compile(
        rf"{_NAME}{separator}(?P<x>{number}){separator}(?P<y>{number}){separator}(?P<z>{number})[\s,;]*",
        re.IGNORECASE,
    )


# Numbers set apart by blanks or semicolons may hold decimal commas; those set apart by commas may not.
_LINES = (_line(_ANY_NUMBER, r"\s*(?:[,;]?\s|;)\s*"), _line(_POINT_NUMBER, r"\s*,\s*"))


def read_lp(path: Path, text: str) -> LightFile:
    """Read an ``.lp`` file as liberally as its many writers require.

    The count line may be missing or wrong; fields may be set apart by blanks, tabs, commas or semicolons;
    names may hold blanks, be quoted, or carry the path they once had; numbers may have decimal commas; blank
    lines, trailing blanks and lines that start with ``#`` are skipped.
    """
    file = LightFile(path)
    count = None
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("#"):
            continue
        if count is None and not file.rows and not file.problems and line.isdecimal():
            count = int(line)
            continue
        where = f"{path.name} row {number}"
        match = next((match for pattern in _LINES if (match := pattern.fullmatch(line))), None)
        if match is None:
            file.problems.append(
                Problem(where, f"reads {line[:60]!r}, expected: file x y z", "Correct or remove this row")
            )
            continue
        x, y, z = (parse_number(match[axis]) for axis in "xyz")
        file.rows.append(LightRow(where, match["quoted"] or match["name"].strip("'"), (x, y, z)))
    if not file.rows and not file.problems:
        file.problems.append(
            Problem(path.name, "holds no lights", "Write one row per photograph: file x y z")
        )
    if count is not None and count != len(file.rows) + len(file.problems):
        file.notes.append(f"{path.name} announces {count} lights and holds {len(file.rows)}: count ignored")
    return file
