"""Publish a painting: a folder with the page and its data, for any web server."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import islice
from os import PathLike
from pathlib import Path

from impasto.errors import OutputError, Problem
from impasto.output import prepare_folder, remove_partial, write_json, written_whole
from impasto.progress import progress
from impasto.publish.pages import page_files
from impasto.publish.publication import SMALL, Publication
from impasto.publish.residual import ROUNDING
from impasto.store import is_published, size_on_disk
from impasto.store.packing import QUANTISATION

STORE_NAME = "painting.zarr"
_AT_A_TIME = 64


@dataclass(frozen=True)
class PublishSummary:
    """What `publish` wrote.

    Parameters
    ----------
    out : Path
        The folder.
    models : tuple of str
        The models, in the order in which the page offers them.
    with_residual : tuple of str
        Those of them that have a residual term.
    photographs : int
        How many photographs are there for comparison.
    size : (int, int)
        Width and height in pixels.
    levels : int
        How many sizes of the picture there are, each half of the one before.
    files, bytes : int
        How many files the folder has, and how large they are together.
    parameter_error : float
        Largest relative error of a parameter by quantisation.
    normal_error : float
        Largest error of a normal's components x and y by quantisation.
    residual_error : float
        Root mean square error of a residual term by quantisation where the term is small, on the scale in
        which it is added; docs/store.md says what it is elsewhere.
    seconds : float
    """

    out: Path
    models: tuple[str, ...]
    with_residual: tuple[str, ...]
    photographs: int
    size: tuple[int, int]
    levels: int
    files: int
    bytes: int
    parameter_error: float
    normal_error: float
    residual_error: float
    seconds: float


def publish(
    store: str | PathLike[str],
    out: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    photographs: int = 0,
    title: str | None = None,
    shards: bool = False,
    overwrite: bool = False,
    show_progress: bool | None = None,
) -> PublishSummary:
    """Write a folder with a page that relights the painting, and all that the page needs.

    Any web server can serve the folder as it lies. The parameters are packed into 16 bits each.

    Parameters
    ----------
    store : path
        Store with at least one complete fit.
    out : path
        Folder to make.
    models : sequence of str, optional
        Which fits, the first to be shown first; all by default.
    photographs : int, optional
        How many photographs to keep for comparison, those with lights furthest apart; none by default.
    title : str, optional
        Title of the page; by default, the store's name.
    shards : bool, optional
        Whether to put many chunks into one file; the server must answer range requests.
    overwrite : bool, optional
        Whether to replace what was published in the folder before.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    PublishSummary

    Raises
    ------
    OptionError
        If there is no such model, or no fit to publish.
    StoreError
        If the store, its stack or a fit cannot be used.
    OutputError
        If the folder holds something else, or cannot be written.
    """
    started = time.perf_counter()
    publication = Publication(Path(store), models=models, photographs=photographs, title=title)
    pages = page_files()
    folder = _empty_folder(out, overwrite)
    target = folder / STORE_NAME
    for name, source in pages.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as temporary:
            shutil.copyfile(source, temporary)
    pieces = list(_pieces(publication, shards))
    with (
        progress("publish", len(pieces), show=show_progress) as advance,
        ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="publish") as pool,
    ):

        def write(piece: tuple[str, Callable[[], bytes]]) -> None:
            path = target / piece[0]
            path.parent.mkdir(parents=True, exist_ok=True)
            with written_whole(path) as temporary:
                temporary.write_bytes(piece[1]())
            advance(1)

        # A part at a time, so that an error ends the work.
        waiting = iter(pieces)
        while part := list(islice(waiting, _AT_A_TIME)):
            list(pool.map(write, part))
    for name, document in publication.documents(shards=shards):
        (target / name).mkdir(parents=True, exist_ok=True)
        write_json(target / name / "zarr.json", document)
    kept = publication.attributes["photographs"]
    height, width = publication.size
    return PublishSummary(
        out=folder,
        models=tuple(entry["name"] for entry in publication.attributes["models"]),
        with_residual=tuple(entry["name"] for entry in publication.attributes["models"] if entry["residual"]),
        photographs=len(kept["lights"]) if kept else 0,
        size=(width, height),
        levels=publication.levels,
        files=sum(1 for path in folder.rglob("*") if path.is_file()),
        bytes=size_on_disk(folder),
        parameter_error=QUANTISATION["log"],
        normal_error=QUANTISATION["normal"],
        residual_error=ROUNDING,
        seconds=time.perf_counter() - started,
    )


def _pieces(publication: Publication, shards: bool) -> Iterator[tuple[str, Callable[[], bytes]]]:
    """Yield the path of each file with pixels, and what makes its bytes."""
    for path, array in publication.arrays.items():
        if shards:
            for number, make in publication.shards(path):
                yield f"{path}/c/{'/'.join(map(str, number))}", make
        else:
            for number in array.numbers():
                name = f"{path}/c/{'/'.join(map(str, number))}"
                yield name, partial(publication.chunk, path, number, SMALL)


def _empty_folder(out: str | PathLike[str], overwrite: bool) -> Path:
    """Return the folder `out`, without what an earlier run published there.

    Raises
    ------
    OutputError
        If it holds something, and that may not be replaced.
    """
    folder = prepare_folder(out)
    remove_partial(folder)
    target = folder / STORE_NAME
    left = [path for path in folder.iterdir() if path.name != ".DS_Store"]
    if not left:
        return folder
    unfinished = target.is_dir() and not (target / "zarr.json").exists()
    if not (is_published(target) or unfinished):
        what = "is not empty, and what is there was not published by impasto"
        raise OutputError(Problem(str(folder), what, "Choose another folder"))
    if not (overwrite or unfinished):
        what = "holds a published painting already"
        raise OutputError(Problem(str(folder), what, "Choose another folder, or add --overwrite"))
    (target / "zarr.json").unlink(missing_ok=True)  # first, so that it does not look whole meanwhile
    shutil.rmtree(target)
    return folder
