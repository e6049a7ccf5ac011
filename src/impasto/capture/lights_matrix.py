"""Read light directions written as a bare matrix, without the names of the photographs."""

from __future__ import annotations

from pathlib import Path

from impasto.capture.lights import LightFile, LightRow, parse_number
from impasto.errors import Problem


def read_matrix(path: Path, text: str) -> LightFile:
    """Read a matrix of 3 rows (x, y, z) and one column per light, or of 3 columns and one row per light.

    Such a file has no names, so the lights belong to the photographs in the natural order of their names.
    """
    file = LightFile(path)
    table: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            table.append([parse_number(token) for token in line.split()])
        except ValueError as error:
            file.problems.append(Problem(f"{path.name} row {number}", str(error), "Write numbers only"))
    if file.problems:
        return file
    widths = {len(row) for row in table}
    if len(widths) != 1 or (len(table) != 3 and widths != {3}):
        shape = f"{len(table)} rows of {' or '.join(map(str, sorted(widths))) or 'no'} numbers"
        what = f"holds {shape}, expected 3 rows (x, y, z)"
        file.problems.append(Problem(path.name, what, "Write one column of x, y, z per light"))
        return file
    by_column = len(table) == 3
    columns = list(zip(*table, strict=True)) if by_column else [tuple(row) for row in table]
    word = "column" if by_column else "row"
    file.rows = [
        LightRow(f"{path.name} {word} {number}", None, (x, y, z))
        for number, (x, y, z) in enumerate(columns, start=1)
    ]
    return file
