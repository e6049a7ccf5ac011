"""A bar with the time left, for a person at a terminal and for nobody else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress(
    title: str, total: int, *, done: int = 0, show: bool | None = None
) -> Iterator[Callable[[int], None]]:
    """Show how far a long stage is while the block runs.

    Parameters
    ----------
    title : str
        What is being done.
    total : int
        Amount of work, in any unit.
    done : int, optional
        How much of it an earlier run has done; it does not count for the time left.
    show : bool, optional
        Whether to show anything; by default, if standard error is a terminal.

    Yields
    ------
    callable
        To be called with the amount of work just finished, from any thread.
    """
    if not (sys.stderr.isatty() if show is None else show):
        yield lambda amount: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=total, completed=done)
        yield lambda amount: bar.advance(task, amount)
