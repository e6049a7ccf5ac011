"""The application, and the options that several subcommands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import impasto
from impasto.errors import OptionError, Problem


class _InOrder(TyperGroup):
    """Lists commands and groups of commands in the order of the pipeline."""

    def list_commands(self, ctx: Any) -> list[str]:
        from impasto.cli import COMMANDS

        return sorted(self.commands, key=COMMANDS.index)


_CONTEXT = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="impasto",
    cls=_InOrder,
    help="Measure how a painted surface reflects light, from photographs under a moving light, and show it "
    "under any light.\n\nPHOTOS is a folder of photographs with their light directions; STORE is the folder "
    "that holds everything measured from them, by custom named after the painting: painting.zarr.",
    epilog="Start with: impasto stack photos/ painting.zarr && impasto fit painting.zarr",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    context_settings=_CONTEXT,
)


def group(name: str, help: str) -> typer.Typer:
    """Return a new group of subcommands, such as `impasto calibrate`, to which they are added.

    Parameters
    ----------
    name : str
    help : str
        What the group is for.
    """
    commands = typer.Typer(no_args_is_help=True, rich_markup_mode=None, context_settings=_CONTEXT)
    app.add_typer(commands, name=name, help=help)
    return commands


Json = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write what is printed to FILE, as data.")
]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an unexpected error.")]
Store = Annotated[Path, typer.Argument(metavar="STORE", help="The folder that impasto stack made.")]
Model = Annotated[str, typer.Option("--model", metavar="NAME", help="Reflectance model; see impasto models.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; made if needed.")]
Regions = Annotated[
    Path | None,
    typer.Option("--regions", metavar="FILE", help="Picture with a colour per region, black outside."),
]
Clusters = Annotated[
    int | None,
    typer.Option("--clusters", metavar="K", help="Find K regions of like paint instead of drawn ones."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")]


def _tell_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"impasto {impasto.__version__}")
        raise typer.Exit


@app.callback()
def _impasto(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", is_eager=True, callback=_tell_version),
    ] = False,
) -> None:
    pass


def pixels(texts: list[str] | None) -> list[tuple[int, int]]:
    """Return the values of --pixel as (column, row)."""
    return [pair(text, "--pixel", "Write column and row: --pixel 120,80") for text in texts or ()]


def pair(text: str, option: str, do: str) -> tuple[int, int]:
    """Return the two whole numbers that the value of an option holds.

    Parameters
    ----------
    text : str
    option : str
        As the error names it.
    do : str
        What the error says to do.

    Returns
    -------
    tuple of int

    Raises
    ------
    OptionError
        If it does not.
    """
    try:
        first, second = (int(part) for part in text.split(","))
    except ValueError:
        raise OptionError(Problem(f"{option} {text}", "is not two whole numbers", do)) from None
    return first, second


def numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    """Return the numbers, separated by commas, that the value of an option holds.

    Raises
    ------
    OptionError
        If they are not as many as `count`.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        what = f"is not {count} numbers separated by commas"
        raise OptionError(Problem(f"{option} {text}", what, "See --help for what each is"))
    return values


def corners(text: str, option: str) -> tuple[int, int, int, int]:
    """Return a box as first column, first row, end column and end row; errors as for `numbers`."""
    left, top, right, bottom = (round(number) for number in numbers(text, 4, option))
    return left, top, right, bottom
