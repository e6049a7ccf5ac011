"""Options that the subcommands of `experiment` share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from impasto.errors import OptionError, Problem

if TYPE_CHECKING:
    from impasto.psychophysics.experiment.manifest import Viewing

Experiment = Annotated[
    Path, typer.Argument(metavar="EXPERIMENT", help="The folder that impasto experiment create made.")
]
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL",
        help="postgresql://USER:PASSWORD@HOST/NAME; a file in the experiment's folder by default.",
        envvar="IMPASTO_DATABASE",
    ),
]
ViewingFile = Annotated[
    Path | None,
    typer.Option(
        "--viewing",
        metavar="FILE",
        help="TOML with the viewing conditions: display, profile, luminance_cd_m2, distance_mm, surround.",
    ),
]


def read_viewing(path: Path | None) -> Viewing | None:
    """Return the viewing conditions that a file states.

    Raises
    ------
    OptionError
        If it cannot be read, or listing everything in it that is not known or has no meaning.
    """
    if path is None:
        return None
    import tomllib

    from pydantic import ValidationError

    from impasto.psychophysics.experiment.manifest import Viewing, validation_problems

    do = "Write for example: display = 'EIZO CG2700X', and distance_mm = 700 in a line of its own"
    try:
        return Viewing.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        problem = Problem(f"--viewing {path}", f"cannot be read: {error.strerror}", do)
        raise OptionError(problem) from error
    except ValidationError as error:
        raise OptionError(validation_problems(f"--viewing {path}", error, do)) from error
    except ValueError as error:
        raise OptionError(Problem(f"--viewing {path}", f"is no TOML: {error}", do)) from error


def read_text(path: Path | None, option: str) -> str | None:
    """Return the text in a file.

    Raises
    ------
    OptionError
        If it cannot be read.
    """
    if path is None:
        return None
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8"
        raise OptionError(
            Problem(f"{option} {path}", f"cannot be read: {reason}", "Give a text file")
        ) from error
