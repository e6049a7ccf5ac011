"""One page about a store: what was captured, measured and found, with its errors, warnings and settings."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.errors import OutputError, Problem
from impasto.evaluate.compare import ordered_fits
from impasto.models import parse_models
from impasto.page import Page
from impasto.progress import progress
from impasto.report.sections import SECTIONS, section_of
from impasto.report.subject import Subject
from impasto.store import open_fit


@dataclass(frozen=True)
class ReportSummary:
    """What `report` wrote.

    Parameters
    ----------
    store, page : Path
    models : tuple of str
        The models reported, the one whose maps are shown first.
    sections : tuple of str
        The titles of the sections.
    sampled_pixels, pixels : int
        How many pixels the statistics are from, and how many the painting has.
    bytes : int
        Size of the page.
    seconds : float
    """

    store: Path
    page: Path
    models: tuple[str, ...]
    sections: tuple[str, ...]
    sampled_pixels: int
    pixels: int
    bytes: int
    seconds: float


def report(
    store: str | PathLike[str],
    out: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    show_progress: bool | None = None,
) -> ReportSummary:
    """Write a page about a store that opens without a network and reads on paper.

    Nothing is fitted for it. Held-out errors are those that `evaluate` has kept in the store; other
    statistics are from about 16,000 pixels spread over the painting, as the page says.

    Parameters
    ----------
    store : path
        Store with fits.
    out : path
        HTML file to write; one that is there is replaced.
    models : sequence of str, optional
        Models to report, by default all that are fitted. The maps of the first are shown.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    ReportSummary

    Raises
    ------
    OptionError
        If there is no such model, or nothing is fitted.
    StoreError
        If there is no such store, or a fit is missing, not finished or damaged.
    OutputError
        If the page cannot be written.
    """
    started = time.perf_counter()
    path, page_path = Path(store), Path(out)
    names = tuple([spec.name for spec in parse_models(models)] or ordered_fits(path))
    for name in names:
        open_fit(path, name)
    _check_target(page_path)
    subject = Subject(path, names)
    lights, height, width, _ = subject.stack.shape
    page = Page(
        f"{path.resolve().stem}: how its surface reflects light",
        f"Measured by impasto from {lights} photographs of {width} x {height} pixels under a moving light.",
        contents=True,
    )
    written = []
    with progress("report", len(SECTIONS), show=show_progress) as advance:
        for name in SECTIONS:
            if section := section_of(name, subject):
                written.append(page.add(section).title)
            advance(1)
    page.write(page_path)
    return ReportSummary(
        store=path,
        page=page_path,
        models=names,
        sections=tuple(written),
        sampled_pixels=len(subject.sample),
        pixels=height * width,
        bytes=page_path.stat().st_size,
        seconds=time.perf_counter() - started,
    )


def _check_target(page: Path) -> None:
    """Refuse a page that cannot be written, before the work."""
    if page.is_dir():
        raise OutputError(
            Problem(
                str(page), "is a folder, and a file is needed", "Give the page a name, such as report.html"
            )
        )
    if not page.parent.is_dir():
        raise OutputError(
            Problem(str(page), "its folder does not exist", "Make the folder, or choose another")
        )
