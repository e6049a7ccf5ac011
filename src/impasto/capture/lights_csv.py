"""Read CSV files of lights: a header, then one row per photograph."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from impasto.capture.lights import LightFile, LightRow, parse_number, place
from impasto.errors import Problem

# The names under which each column is known; compared without case.
_COLUMNS = {
    "file": ("file", "name", "filename", "image", "photograph"),
    "arm_angle_deg": ("arm_angle_deg", "arm_angle", "arm", "angle", "angle_deg"),
    "zenith_deg": ("zenith_deg", "zenith"),
    "azimuth_deg": ("azimuth_deg", "azimuth"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
    "gain": ("gain", "intensity"),
    "angular_size_deg": ("angular_size_deg",),
    "exposure_s": ("exposure_s",),
}
_MEANING = {name: column for column, names in _COLUMNS.items() for name in names}
_FORMS = ({"arm_angle_deg"}, {"zenith_deg", "azimuth_deg"}, {"x", "y", "z"})
_EXPECTED = "file, and one of: arm_angle_deg; zenith_deg, azimuth_deg; x, y, z"


def read_csv(path: Path, text: str) -> LightFile:
    """Read a CSV file of lights, set apart by commas, semicolons or tabs; decimal commas are understood."""
    file = LightFile(path)
    lines = text.splitlines(keepends=True)
    skipped = next((number for number, line in enumerate(lines) if line.strip()), len(lines))
    header = lines[skipped] if skipped < len(lines) else ""
    delimiter = max(",;\t", key=lambda mark: sum(_meaning(cell) is not None for cell in header.split(mark)))
    rows = csv.reader(io.StringIO("".join(lines[skipped:])), delimiter=delimiter, skipinitialspace=True)
    names = [name.strip() for name in next(rows, [])]
    columns = [_meaning(name) for name in names]
    if not _check_header(file, names, columns):
        return file
    for cells in rows:
        if any(cell.strip() for cell in cells):
            _read_row(file, columns, cells, f"{path.name} row {skipped + rows.line_num}")
    if not file.rows and not file.problems:
        file.problems.append(Problem(path.name, "holds no lights", "Write one row per photograph"))
    return file


def _meaning(name: str) -> str | None:
    return _MEANING.get(name.strip().strip('"').casefold())


def _check_header(file: LightFile, names: list[str], columns: list[str | None]) -> bool:
    where = f"{file.path.name} header"
    known = [column for column in columns if column]
    for column in sorted({column for column in known if known.count(column) > 1}):
        file.problems.append(Problem(where, f"has more than one column for {column}", "Keep one of them"))
    forms = [form for form in _FORMS if form <= set(known)]
    if "file" not in known or len(forms) != 1:
        got = ", ".join(names) or "nothing"
        file.problems.append(
            Problem(
                where, f"has the columns {got}, expected {_EXPECTED}", "Name the columns in the first row"
            )
        )
    unknown = [name for name, column in zip(names, columns, strict=True) if column is None and name]
    if unknown:
        file.notes.append(f"{file.path.name}: columns not used: {', '.join(unknown)}")
    return not file.problems


def _read_row(file: LightFile, columns: list[str | None], cells: list[str], where: str) -> None:
    values: dict[str, float] = {}
    problems = []
    named = dict(zip((column or "" for column in columns), (cell.strip() for cell in cells), strict=False))
    if len(cells) != len(columns) and any(cell.strip() for cell in cells[len(columns) :]):
        problems.append(f"has {len(cells)} fields, the header {len(columns)}")
    for column, cell in named.items():
        if column in ("", "file") or not cell:
            continue
        try:
            values[column] = parse_number(cell)
        except ValueError as error:
            problems.append(f"{column} {error}")
    if not named.get("file"):
        problems.append("names no photograph")
    if not problems:
        try:
            direction, _ = place(
                direction=_xyz(values),
                arm_angle_deg=values.get("arm_angle_deg"),
                zenith_deg=values.get("zenith_deg"),
                azimuth_deg=values.get("azimuth_deg"),
            )
        except ValueError as error:
            problems.append(str(error))
    if problems:
        file.problems += [Problem(where, problem, "Correct or remove this row") for problem in problems]
        return
    file.rows.append(
        LightRow(
            where,
            named["file"],
            direction,
            gain=(values.get("gain", 1.0),),
            angular_size_deg=values.get("angular_size_deg", float("nan")),
            exposure_s=values.get("exposure_s"),
        )
    )


def _xyz(values: dict[str, float]) -> list[float] | None:
    present = [values[axis] for axis in "xyz" if axis in values]
    return present or None
