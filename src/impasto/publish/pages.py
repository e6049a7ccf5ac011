"""The built pages that the package carries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from impasto.errors import OutputError, Problem

_WEB = Path(__file__).resolve().parents[1] / "web"
_ENTRIES = ("index.html", "src/impasto-viewer.ts")


def page_files() -> dict[str, Path]:
    """Return the files of the viewer's page, by their path in a published folder.

    Raises
    ------
    OutputError
        If the package was installed without its pages.
    """
    try:
        manifest: dict[str, dict[str, Any]] = json.loads((_WEB / "manifest.json").read_text(encoding="utf-8"))
    except OSError:
        raise OutputError(
            Problem(
                where=str(_WEB),
                what="has no page: this installation was made from the sources without building it",
                do="Run make src/impasto/web/.built in the sources, which needs Node 20.19 or newer",
            )
        ) from None
    names = {"index.html"}
    waiting, seen = list(_ENTRIES), set()
    while waiting:
        key = waiting.pop()
        if key not in seen:
            seen.add(key)
            entry = manifest[key]
            names.update([entry["file"], *entry.get("css", ()), *entry.get("assets", ())])
            waiting += [*entry.get("imports", ()), *entry.get("dynamicImports", ())]
    return {name: _WEB / name for name in sorted(names)}
