"""Stack photographs: decode, linearise and write them into a store, in parallel and in bounded memory."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impasto import store as stores
from impasto.capture import Capture, read_capture
from impasto.errors import CaptureError, Problem, StoreError, raise_problems
from impasto.stack.brackets import read_brackets
from impasto.stack.corrections import read_corrections
from impasto.stack.job import Job

# Stored size over raw size: noise does not shrink, decoded 8-bit values do.
_STORED_SHARE = {"uint8": 0.6, "uint16": 1.0, "float32": 1.0}


@dataclass(frozen=True)
class StackSummary:
    """What `stack` did.

    Parameters
    ----------
    store : Path
    photographs : int
    height, width, channels : int
    transfer : str
        How the photographs were decoded to linear light.
    decoded, kept : int
        Photographs decoded by this run, and those that an earlier run had finished.
    already : bool
        Whether the store held all of it before, so that nothing was done.
    clipped_samples : dict of str to int
        Per photograph.
    decoders : int
        Photographs decoded at a time.
    seconds : float
    notes : tuple of str
        What was assumed, left out or normalised.
    """

    store: Path
    photographs: int
    height: int
    width: int
    channels: int
    transfer: str
    decoded: int
    kept: int
    already: bool
    clipped_samples: dict[str, int]
    decoders: int
    seconds: float
    notes: tuple[str, ...]


def stack(
    photos: str | os.PathLike[str],
    store: str | os.PathLike[str],
    *,
    lights: str | os.PathLike[str] | None = None,
    exclude: Iterable[str] = (),
    brackets: Iterable[str | os.PathLike[str]] = (),
    oecf: str | os.PathLike[str] | None = None,
    dark: str | os.PathLike[str] | None = None,
    flat: str | os.PathLike[str] | None = None,
    white: str | os.PathLike[str] | None = None,
    colour: str | os.PathLike[str] | None = None,
    steadiness: str | os.PathLike[str] | None = None,
    half_size: bool = False,
    overwrite: bool = False,
    memory_bytes: float = 1.6e9,
    show_progress: bool | None = None,
) -> StackSummary:
    """Put the photographs of a folder into a store, as linear radiance.

    A run that was interrupted is continued by calling again with the same arguments: photographs that are
    in the store whole are not decoded again. The store depends on the inputs alone, not on how often it was
    interrupted.

    Parameters
    ----------
    photos : path
        Folder with the photographs.
    store : path
        Folder to make.
    lights : path, optional
        File with the lights; found in `photos` if there is one.
    exclude : iterable of str, optional
        Names of photographs to leave out.
    brackets : iterable of path, optional
        Folders with further exposures of the same names, which are merged with those in `photos`; by default
        those that the light file names.
    oecf, dark, flat, white, colour, steadiness : path, optional
        Calibration files, as `impasto.calibrate` makes them. By the last, photographs that moved are shifted
        back.
    half_size : bool, optional
        Whether raw files are read at half size, which is faster.
    overwrite : bool, optional
        Whether to replace a stack made from other inputs, and with it the fits that were made from it.
    memory_bytes : float, optional
        Memory that the whole process may use; the number of photographs decoded at a time follows from it.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    StackSummary

    Raises
    ------
    CaptureError
        If photographs, lights or calibration files cannot be used, listing everything that is wrong.
    StoreError
        If the store cannot be written, is not one, is from a newer version, or holds something else.
    """
    started = time.perf_counter()
    path = Path(store)
    capture = _read(Path(photos), path, lights, exclude, half_size)
    named = {
        "oecf": oecf,
        "dark": dark,
        "flat": flat,
        "white": white,
        "colour": colour,
        "steadiness": steadiness,
    }
    corrections = read_corrections(named, capture)
    exposures = read_brackets(capture, list(brackets) or capture.brackets)
    job = Job(capture, corrections, exposures, memory_bytes, show_progress)
    with stores.run(path, "stack") as log:
        fresh, already = _compare(path, job, overwrite)
        kept = len(capture.photographs)
        if not already:
            raise_problems(StoreError, _room(path, job))
            kept = job.write(stores.StackWriter(path, job.header, fresh=fresh))
        log.write("summary", decoded=len(capture.photographs) - kept, decoders=job.decoders)
    written = stores.open_stack(path).attributes
    _, height, width, channels = job.header.shape
    return StackSummary(
        store=path,
        photographs=len(capture.photographs),
        height=height,
        width=width,
        channels=channels,
        transfer=capture.photographs[0].transfer,
        decoded=len(capture.photographs) - kept,
        kept=kept,
        already=already,
        clipped_samples={entry["name"]: entry["clipped_samples"] for entry in written["inputs"]},
        decoders=job.decoders,
        seconds=time.perf_counter() - started,
        notes=tuple(written["notes"]),
    )


def _read(
    photos: Path,
    store: Path,
    lights: str | os.PathLike[str] | None,
    exclude: Iterable[str],
    half_size: bool,
) -> Capture:
    """Read the capture; report its problems and the store's together."""
    problems = stores.target_problems(store)
    try:
        capture = read_capture(photos, lights, exclude, half_size=half_size)
    except CaptureError as error:
        raise CaptureError([*error.problems, *problems]) from error
    raise_problems(StoreError, problems)
    return capture


def _compare(store: Path, job: Job, overwrite: bool) -> tuple[bool, bool]:
    """Compare the store with what is to be put into it.

    Returns
    -------
    fresh : bool
        Whether a complete stack is to be replaced.
    already : bool
        Whether everything is there.
    """
    found = stores.read_group(store / stores.STACK)
    complete = found is not None and bool(found.get("complete"))
    fits = stores.fitted_models(store)
    if overwrite or not (complete or fits):
        return complete, False
    if found is not None:
        raise_problems(StoreError, stores.stack_problems(store, found))
    difference = "its photographs were removed" if found is None else job.difference(found)
    if not difference:
        return False, complete
    lost = f"; the fits in it ({', '.join(fits)}) would go with it" if fits else ""
    raise StoreError(
        Problem(
            where=str(store),
            what=f"holds another stack: {difference}{lost}",
            do="Choose another name for the store, or replace what is there with --overwrite",
        )
    )


def _room(store: Path, job: Job) -> list[Problem]:
    """Return a problem if the disk cannot hold the stack beside what is there of it already."""
    raw = float(np.prod(job.header.shape, dtype=np.float64)) * job.header.dtype.itemsize
    there = stores.size_on_disk(store / stores.STACK)
    share = _STORED_SHARE[job.capture.photographs[0].dtype.name]
    if any("shift_px" in entry for entry in job.header.inputs):
        share = 1.0  # no decoded 8-bit values any more
    return stores.no_room(store, int(raw * share) - there)
