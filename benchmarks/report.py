"""One table of everything measured, with the bar that each figure has to reach."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Row:
    """One figure.

    Parameters
    ----------
    what : str
    measured : float
    bar : float or None
        None for a figure that is only reported.
    at_least : bool
        Whether larger is better.
    note : str
    """

    what: str
    measured: float
    bar: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def met(self) -> bool | None:
        if self.bar is None:
            return None
        return self.measured >= self.bar if self.at_least else self.measured <= self.bar


def machine() -> dict[str, Any]:
    """Return what the figures depend on besides the program."""
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.is_file():
        names = [line for line in information.read_text().splitlines() if line.startswith("model name")]
        processor = names[0].split(":", 1)[1].strip() if names else processor
    packages = ("impasto", "numpy", "scipy", "zarr", "tifffile", "imagecodecs")
    return {
        "processor": processor,
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in packages},
    }


def write(rows: dict[str, list[Row]], folder: Path, name: str) -> str:
    """Write NAME.json and NAME.md; return the table as Markdown.

    Parameters
    ----------
    rows : dict of str to list of Row
        By section.
    folder : Path
    name : str
    """
    data = {
        "machine": machine(),
        "sections": {
            title: [asdict(row) | {"met": row.met} for row in section] for title, section in rows.items()
        },
    }
    (folder / f"{name}.json").write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", "utf-8")
    about = data["machine"]
    lines = [
        f"Measured by `make bench` on {about['cores']} cores of {about['processor']}, "
        f"Python {about['python']}, impasto {about['versions']['impasto']}.",
        "",
    ]
    for title, section in rows.items():
        lines += [f"**{title}**", "", "| what | measured | bar | | |", "|---|---|---|---|---|"]
        for row in section:
            sign = "≥" if row.at_least else "≤"
            bar = "" if row.bar is None else f"{sign} {_number(row.bar)}"
            met = {None: "", True: "met", False: "**missed**"}[row.met]
            lines.append(f"| {row.what} | {_number(row.measured)} | {bar} | {met} | {row.note} |")
        lines.append("")
    text = "\n".join(lines)
    (folder / f"{name}.md").write_text(text, "utf-8")
    return text


def _number(value: float) -> str:
    if value == 0 or 1e-5 <= abs(value) < 1000:
        return f"{value:.4g}"
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.1e}"
