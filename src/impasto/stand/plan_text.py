"""Write a plan as TOML that a person can read and edit."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from impasto.capture.toml_tables import PhotographsTable
from impasto.stand.steps import shutter

_HEAD = """\
# A plan of impasto capture. Edit what you like: impasto capture run checks all of it before it begins.
# docs/copy-stand.md says what each key means.
"""


def plan_text(content: Mapping[str, Any], remarks: Iterable[str]) -> str:
    """Return a plan as TOML.

    Parameters
    ----------
    content : mapping
        As `PlanFile` reads it, with the drivers' settings as tables in ``camera`` and ``light``.
    remarks : iterable of str
        For the head of the file.
    """
    lines = [*_HEAD.splitlines(), *(f"# {remark}" for remark in remarks), ""]
    lines += [f"{key} = {toml(value)}" for key, value in content.items() if not _is_table(value)]
    for key, value in content.items():
        if isinstance(value, Mapping):
            lines += ["", *_table(key, value)]
        elif _is_table(value):
            for entry in value:
                lines += ["", f"[[{key}]]", *_entries(entry)]
    return "\n".join(lines) + "\n"


def photograph_lines(table: PhotographsTable) -> list[str]:
    """Return the lines of ``[photographs]`` of a manifest that says what a plan does."""
    given = table.model_dump(exclude_none=True, exclude_defaults=True)
    return [f"{key} = {toml(value)}" for key, value in given.items()]


def toml(value: Any) -> str:
    """Return a value in TOML, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _table(name: str, table: Mapping[str, Any]) -> Iterator[str]:
    yield f"[{name}]"
    # Where the camera looks from reads better on one line.
    inner = {key: value for key, value in table.items() if isinstance(value, Mapping) and key != "view"}
    yield from _entries({key: value for key, value in table.items() if key not in inner})
    for key, value in inner.items():
        yield ""
        yield from _table(f"{name}.{key}", value)


def _entries(table: Mapping[str, Any]) -> Iterator[str]:
    for key, value in table.items():
        times = key == "times_s" and isinstance(value, list | tuple)
        remark = "  # " + ", ".join(shutter(time) for time in value) if times else ""
        yield f"{key} = {toml(value)}{remark}"


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (
        isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)
    )
