"""What the person at the keyboard sees: results, problems, exit codes, and the same as data."""

from __future__ import annotations

import dataclasses
import errno
import json
import math
import os
import platform
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import typer

from impasto.errors import ImpastoError, Problem

EXIT_PROBLEM = 1
EXIT_INTERRUPTED = 130

_FAULTS_OF_THE_DISK = {
    errno.ENOSPC: "there is no room left on the disk",
    errno.EDQUOT: "the disk quota is used up",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "this account may not write or read here",
    errno.EPERM: "this account may not write or read here",
    errno.ENAMETOOLONG: "the name is longer than the disk allows",
    errno.ENOTDIR: "a part of the path is a file, and a folder is needed",
    errno.EISDIR: "is a folder, and a file is needed",
    errno.EIO: "the disk fails",
}


class Report:
    """Collect what a subcommand has to say, in words and as data.

    Parameters
    ----------
    command : str
        The subcommand.

    Attributes
    ----------
    exit_code : int
        What the subcommand ends with if nothing fails.
    """

    def __init__(self, command: str) -> None:
        self.command = command
        self.data: dict[str, Any] = {}
        self.exit_code = 0

    def say(self, text: str = "") -> None:
        """Print a line of the result."""
        typer.echo(text)

    def say_all(self, lines: Iterable[str]) -> None:
        """Print lines of the result."""
        for line in lines:
            self.say(line)

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Print rows in aligned columns: the first flush left, the others flush right."""
        widths = [max(len(row[index]) for row in [header, *rows]) for index in range(len(header))]
        for row in [header, *rows]:
            cells = [
                cell.ljust(width) if index == 0 else cell.rjust(width)
                for index, (cell, width) in enumerate(zip(row, widths, strict=True))
            ]
            self.say("  " + "   ".join(cells).rstrip())

    def done(self, result: Any) -> None:
        """Keep `result`, a dataclass or a mapping, as the data of the run."""
        self.data.update(as_data(result))


@contextmanager
def reporting(command: str, json_file: Path | None = None, debug: bool = False) -> Iterator[Report]:
    """Run a subcommand: show its problems, write its data, and leave with its exit code.

    Parameters
    ----------
    command : str
        The subcommand's name, for the messages.
    json_file : Path, optional
        Where to write, as data, what is printed; problems too.
    debug : bool, optional
        Whether to show the traceback of an unexpected exception.

    Yields
    ------
    Report

    Raises
    ------
    typer.Exit
        With code 1 after problems of the input or a fault of the program, 130 after an interruption.
    """
    report = Report(command)
    problems: list[Problem] = []
    code = 0
    if json_file is not None and (problem := _unwritable(json_file)):
        # Said before the work, which may take hours, and not after it.
        show_problems(command, [problem])
        raise typer.Exit(EXIT_PROBLEM)
    try:
        yield report
        code = report.exit_code
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
        typer.echo(
            f"\nimpasto {command}: interrupted. What is finished is whole; "
            "run the same command again to go on.",
            err=True,
        )
    except ImpastoError as error:
        code, problems = EXIT_PROBLEM, error.problems
        show_problems(command, problems)
    except BrokenPipeError:
        # Whoever reads the output, such as head, has seen enough; Python would complain again at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = EXIT_PROBLEM
    except OSError as error:
        if error.errno not in _FAULTS_OF_THE_DISK:
            code, problems = EXIT_PROBLEM, [show_fault(command, error, debug)]
        else:
            where = str(error.filename or "the disk")
            what = _FAULTS_OF_THE_DISK[error.errno]
            code = EXIT_PROBLEM
            problems = [Problem(where, what, "Make room or choose another place, then run the command again")]
            show_problems(command, problems)
    except BaseException as error:
        # A panic of the core is no Exception, so that nobody takes it for an error that can be ignored.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        code, problems = EXIT_PROBLEM, [show_fault(command, error, debug)]
    if json_file is not None:
        _write_json(json_file, report, problems, code)
    if code:
        raise typer.Exit(code)


def show_problems(command: str, problems: list[Problem]) -> None:
    """Print all `problems`, each with where it is, what it is, and what to do."""
    count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
    typer.secho(f"impasto {command}: {count}", err=True, fg=typer.colors.RED, bold=True)
    for problem in problems:
        typer.echo(f"\n  {problem.where}", err=True)
        typer.echo(f"    {problem.what}.", err=True)
        typer.echo(f"    → {problem.do}.", err=True)


def show_fault(command: str, error: BaseException, debug: bool) -> Problem:
    """Print an exception that nobody foresaw, and return it as a problem."""
    if debug:
        typer.echo("".join(traceback.format_exception(error)), err=True)
    problem = Problem(
        where=f"impasto {command}",
        what=f"a fault of the program: {type(error).__name__}: {error}",
        do="Report it with the command, the traceback that --debug shows, and this line: " + versions(),
    )
    show_problems(command, [problem])
    return problem


def versions() -> str:
    """Return one line with the versions that matter for a report."""
    from importlib.metadata import version

    parts = [f"{name} {version(name)}" for name in ("impasto", "numpy", "zarr", "OpenImageIO")]
    return ", ".join(
        [*parts, f"Python {platform.python_version()}", f"{platform.system()} {platform.machine()}"]
    )


def as_data(value: Any) -> Any:
    """Return `value` in the types that JSON knows; what is not finite becomes null.

    Parameters
    ----------
    value : object
        Dataclasses, mappings, sequences, arrays, paths and plain values, nested.

    Returns
    -------
    dict, list, str, float, int, bool or None
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: as_data(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): as_data(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return as_data(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [as_data(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    return str(value)


def _is_device(path: Path) -> bool:
    """Return whether `path` is a pipe, a terminal or the like, which a file must not take the place of."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _unwritable(path: Path) -> Problem | None:
    if _is_device(path):
        return None
    if path.is_dir():
        return Problem(f"--json {path}", "is a folder, and a file is needed", "Give the name of a file")
    if not path.parent.is_dir():
        return Problem(f"--json {path}", "its folder does not exist", "Make the folder, or choose another")
    if not os.access(path.parent, os.W_OK):
        return Problem(f"--json {path}", "this account may not write in its folder", "Choose another folder")
    return None


def _write_json(path: Path, report: Report, problems: list[Problem], code: int) -> None:
    data = {"command": report.command, "exit_code": code, "problems": as_data(problems), **report.data}
    text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    temporary = path.with_name(path.name + ".partial")
    try:
        if _is_device(path):
            path.write_text(text, encoding="utf-8")
            return
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        typer.echo(f"impasto {report.command}: could not write {path}: {error.strerror}", err=True)
        sys.exit(code or EXIT_PROBLEM)
