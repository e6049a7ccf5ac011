"""Write files whole or not at all, and say why where that cannot be done."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from impasto.errors import OutputError, Problem

_ENDING = ".partial"
_FULL_DISK_BYTES = 1 << 16


def partial_path(path: Path) -> Path:
    """Return the name, beside `path`, that a file has while it is written."""
    return path.with_name(f".{path.name}{_ENDING}")


def remove_partial(folder: Path) -> None:
    """Remove the unfinished files that an interrupted run left in `folder` and below."""
    for path in folder.rglob(f".*{_ENDING}"):
        path.unlink()


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give the name to write to; rename the file to `path` when the block ends well, remove it otherwise.

    Raises
    ------
    OutputError
        If the block raises an OSError, or the file cannot be renamed.
    """
    temporary = partial_path(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise output_error(path, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def prepare_folder(out: str | os.PathLike[str]) -> Path:
    """Make the folder `out` if it is not there, and return it.

    Raises
    ------
    OutputError
        If it is a file or cannot be made.
    """
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise OutputError(
            Problem(str(folder), "is a file, and a folder is needed", "Choose another folder")
        ) from error
    except OSError as error:
        raise output_error(folder, error.strerror or str(error)) from error
    return folder


def output_error(path: Path, reason: str) -> OutputError:
    """Return the error for a file that cannot be written; a full disk is named, which libraries seldom do."""
    folder = next((parent for parent in path.absolute().parents if parent.exists()), Path("/"))
    if shutil.disk_usage(folder).free < _FULL_DISK_BYTES:
        reason = "there is no room left on the disk"
    return OutputError(
        Problem(
            where=str(path),
            what=f"cannot be written: {reason.rstrip('.')}",
            do="Make room or choose another folder, then run the same command again",
        )
    )
