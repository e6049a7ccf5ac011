"""Stack photographs: decode, linearise and write them into a store, in parallel and in bounded memory."""

from __future__ import annotations

import hashlib
import math
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.capture import Capture, Photograph, read_capture
from impasto.errors import CaptureError, Problem, StoreError, raise_problems
from impasto.progress import progress
from impasto.stack.brackets import Exposure, check_times, merge, merged_noise, read_brackets, sample
from impasto.stack.corrections import Corrections, read_corrections
from impasto.stack.digests import ALGORITHM, photograph_digest
from impasto.stack.light_colour import light_colour
from impasto.stack.linearise import Linearisation, linearisations
from impasto.stack.samples import Samples
from impasto.stack.shift import Shift

# Noise in relative radiance where the capture does not state it, by the type of the photographs: an 8-bit
# encoding rounds to half a per cent of the radiance and to 0.001 near black; see docs/store.md.
_NOISE = {
    "uint8": {"read": 1e-3, "photon": 1e-5, "relative": 5e-3},
    "uint16": {"read": 1e-4, "photon": 0.0, "relative": 5e-3},
    "float32": {"read": 1e-4, "photon": 0.0, "relative": 5e-3},
}

# Stored size over raw size: noise does not shrink, decoded 8-bit values do.
_STORED_SHARE = {"uint8": 0.6, "uint16": 1.0, "float32": 1.0}

# What the program needs before the first photograph is decoded.
_BASE_BYTES = 0.3e9


Result = TypeVar("Result")


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
    job = _Job(capture, corrections, exposures, memory_bytes, show_progress)
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


def _compare(store: Path, job: _Job, overwrite: bool) -> tuple[bool, bool]:
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


def _room(store: Path, job: _Job) -> list[Problem]:
    """Return a problem if the disk cannot hold the stack beside what is there of it already."""
    raw = float(np.prod(job.header.shape, dtype=np.float64)) * job.header.dtype.itemsize
    there = stores.size_on_disk(store / stores.STACK)
    share = _STORED_SHARE[job.capture.photographs[0].dtype.name]
    if any("shift_px" in entry for entry in job.header.inputs):
        share = 1.0  # no decoded 8-bit values any more
    return stores.no_room(store, int(raw * share) - there)


class _StoppedError(Exception):
    """A thread was told to stop; nobody sees this."""


class _Job:
    """The photographs of one call, and how they are decoded.

    Parameters
    ----------
    capture : Capture
    corrections : Corrections
    exposures : list of list of Exposure
        Per light.
    memory_bytes : float
    show_progress : bool or None
    """

    def __init__(
        self,
        capture: Capture,
        corrections: Corrections,
        exposures: list[list[Exposure]],
        memory_bytes: float,
        show_progress: bool | None,
    ) -> None:
        self.capture = capture
        self._corrections = corrections
        self._exposures = exposures
        self._notes: dict[int, list[str]] = {}
        self._show = show_progress
        self._linearisations = linearisations(capture.photographs, capture.clip_level, corrections)
        self.header = _header(capture, self._linearisations, corrections, exposures)
        self.decoders = _decoders(
            capture.photographs,
            self._linearisations[0],
            memory_bytes,
            len(exposures[0]),
            shifted="steadiness" in corrections.files,
        )
        self._samples = Samples(self.header.shape, self.header.dtype)
        self._stop = threading.Event()

    def difference(self, found: dict[str, Any]) -> str:
        """Return in words how a stack with attributes `found` differs from this one, "" if it does not."""
        photographs = self.capture.photographs
        names = {entry["name"] for entry in found["inputs"]}
        more = len({photograph.name for photograph in photographs} - names)
        fewer = len(names) - len(photographs) + more
        if more or fewer:
            return f"{fewer} of its photographs are not given now, and {more} are new"
        if found["settings_sha256"] != self.header.attributes()["settings_sha256"]:
            return "its lights, camera or settings were others"
        count = len(photographs)
        changed = set()
        with progress("Comparing photographs", count, show=self._show) as advance:
            # Earlier versions noted SHA-256.
            algorithm = ALGORITHM if ALGORITHM in found["inputs"][0] else "sha256"
            for light, future in self._in_parallel(lambda light: self._digest_of(light, algorithm)):
                advance(1)
                if found["inputs"][light][algorithm] not in (future.result(), None):
                    changed.add(photographs[light].name)
        some = ", ".join(sorted(changed)[:5])
        return f"{len(changed)} of its photographs have changed ({some})" if changed else ""

    def write(self, writer: stores.StackWriter) -> int:
        """Decode and write what the store lacks; return how many photographs it had.

        Raises
        ------
        CaptureError
            Listing every photograph that cannot be decoded; the others are kept.
        StoreError
            If the store cannot be written.
        """
        count, height = self.header.shape[:2]
        problems: dict[int, list[Problem]] = {}
        kept = 0
        with progress("Stacking photographs", count * height, show=self._show) as advance:
            for light, future in self._in_parallel(lambda light: self._write_one(writer, light, advance)):
                try:
                    kept += future.result()
                except CaptureError as error:
                    problems[light] = error.problems
        raise_problems(CaptureError, [problem for light in sorted(problems) for problem in problems[light]])
        writer.finish(self._light_colour(writer))
        return kept

    def _light_colour(self, writer: stores.StackWriter) -> dict[str, Any]:
        """Return what the highlights of the photographs, all written, tell about the light."""
        said = [
            *self.header.more["notes"],
            *dict.fromkeys(note for notes in self._notes.values() for note in notes),
        ]
        if (reference := self._corrections.light_colour()) is not None:
            return {**reference, "notes": said}
        if not self._samples.whole:  # an earlier run wrote a part
            self._samples.complete(stores.Stack(writer.store, writer.attributes))
        colour = light_colour(self._samples, self.header)
        notes = [*said, *([colour.note] if colour.note else [])]
        return {"light_rgb": list(colour.rgb), "light_rgb_source": colour.source, "notes": notes}

    def _in_parallel(self, function: Callable[[int], Result]) -> Iterator[tuple[int, Future[Result]]]:
        """Call `function` with each photograph's number in threads; yield number and outcome as they come.

        When the consumer stops early, by an error or Ctrl-C, the threads stop within a band.
        """
        with ThreadPoolExecutor(self.decoders, thread_name_prefix="decode") as pool:
            futures = {pool.submit(function, light): light for light in range(len(self.capture.photographs))}
            try:
                for future in as_completed(futures):
                    yield futures[future], future
            except BaseException:
                self._stop.set()
                pool.shutdown(cancel_futures=True)
                raise

    def _digest_of(self, light: int, algorithm: str = ALGORITHM) -> str:
        files = [exposure.photograph.path for exposure in self._exposures[light]]
        return photograph_digest(files, algorithm, self._check_stop)

    def _check_stop(self) -> None:
        if self._stop.is_set():
            raise _StoppedError

    def _write_one(self, writer: stores.StackWriter, light: int, advance: Callable[[int], None]) -> bool:
        """Write one photograph; return whether it was there already."""
        photograph = self.capture.photographs[light]
        digest = self._digest_of(light)
        if writer.digests[light] == digest:
            advance(photograph.height)
            return True
        merged = len(self._exposures[light]) > 1
        bands = self._merged_bands(light) if merged else self._bands(light)
        if (shift := self._corrections.shift(photograph.name)) is not None:
            bands = self._shift(shift).bands((row, stored) for row, stored, _ in bands)
        clipped = 0

        def stored() -> Iterator[tuple[int, NDArray[Any]]]:
            nonlocal clipped
            for row, band, more in bands:
                self._check_stop()
                clipped += more
                self._samples.take(light, row, band)
                yield row, band
                advance(len(band))

        writer.write_light(light, stored())
        writer.finish_light(light, digest, clipped)
        return False

    def _shift(self, shift_px: tuple[float, float]) -> Shift:
        levels = [math.inf if level is None else level for level in self.header.clip_level]
        return Shift(shift_px, self.header.shape[1], np.array(levels) / self.header.scale)

    def _bands(self, light: int) -> Iterator[tuple[int, NDArray[Any], int]]:
        """Yield the first row of each band of a photograph, its stored values, and how many are clipped."""
        for row, band in self.capture.photographs[light].bands(stores.STACK_CHUNK):
            yield (row, *self._linearisations[light].stored(band, row))

    def _merged_bands(self, light: int) -> Iterator[tuple[int, NDArray[Any], int]]:
        """Yield the same of a light's merged exposures: samples count that are clipped in all of them."""
        exposures, linearise = self._exposures[light], self._linearisations[light]
        decoded = []
        for exposure in exposures:
            self._check_stop()
            decoded.append(
                [(row, np.array(band)) for row, band in exposure.photograph.bands(stores.STACK_CHUNK)]
            )
        step = sample([band for _, band in decoded[0]])
        levels = [
            np.concatenate([
                linearise.radiance(band, row)[step, step].reshape(-1) for row, band in bands
            ])
            for bands in decoded
        ]  # fmt: skip
        times, notes = check_times(exposures, levels)
        self._notes[light] = notes
        read, photon = (self.header.noise[name] * self._read_scale for name in ("read", "photon"))
        beyond = np.float32(max(level for level in self.header.clip_level if level is not None) * 1.01)
        for number, (row, _) in enumerate(decoded[0]):
            parts = [linearise.radiance(bands[number][1], row) for bands in decoded]
            merged = merge(parts, times, read, photon)
            lost = np.isposinf(merged)
            merged[lost] = beyond / np.float32(self.header.scale)
            yield row, merged, int(np.count_nonzero(lost))

    @property
    def _read_scale(self) -> float:
        """From the noise of the stack's relative radiance to that of an exposure's full scale."""
        return self._corrections.white_level * max(exposure.time for exposure in self._exposures[0])


def _header(
    capture: Capture,
    decoding: list[Linearisation],
    corrections: Corrections,
    exposures: list[list[Exposure]],
) -> stores.StackHeader:
    """Return what the capture says about the stack before anything is decoded."""
    first = capture.photographs[0]
    clip_level = np.min([each.clip_level for each in decoding], axis=0)
    scale, dtype = decoding[0].scale, decoding[0].dtype
    noise = {
        **_NOISE[first.dtype.name],
        **(corrections.content("oecf") or {}).get("noise", {}),
        **capture.noise,
    }
    white = corrections.white_level
    # The variance of radiance that is divided by the white's.
    noise |= {"read": noise["read"] / white, "photon": noise["photon"] / white}
    times = [exposure.time for exposure in exposures[0]]
    if len(times) > 1:
        noise = merged_noise(noise, times)
        scale, dtype = 1 / white, np.dtype(np.float32)
        # What the shortest exposure just shows, wherever a flat field lifts it most.
        clip_level = np.full(first.channels, corrections.largest_gain / min(times) / white)
    shifts = [corrections.shift(photograph.name) for photograph in capture.photographs]
    if any(shifts) and dtype.kind == "u":
        # The largest value stands for samples beyond the border of a photograph that is shifted.
        clip_level = np.minimum(clip_level, (np.iinfo(np.uint16).max - 0.5) * scale)
    said = (corrections.uncalibrated(capture.photographs), corrections.movement(capture.photographs))
    notes = [*capture.notes, *filter(None, said)]
    if (oecf := corrections.content("oecf")) is not None and oecf["linear"]:
        notes.append("the camera is linear, as its calibration found: its response is not changed")
    return stores.StackHeader(
        shape=(len(capture.photographs), first.height, first.width, first.channels),
        dtype=dtype,
        lights=capture.lights,
        camera=capture.camera,
        scale=scale,
        offset=0.0,
        clip_level=tuple(float(level) if np.isfinite(level) else None for level in clip_level),
        noise=noise,
        inputs=[
            {
                "name": photograph.name,
                "file": photograph.path.name,
                "dtype": photograph.dtype.name,
                "transfer": photograph.transfer,
                "exposure_s": photograph.exposure_s,
                "f_number": photograph.f_number,
                "iso": photograph.iso,
                **{
                    name: value
                    for name in ("camera", "lens", "taken")
                    if (value := getattr(photograph, name)) is not None
                },
                **({} if shift is None else {"shift_px": list(shift)}),
                **(
                    {"brackets": [[str(one.photograph.path.name), one.time] for one in merged[1:]]}
                    if len(merged) > 1
                    else {}
                ),
            }
            for photograph, merged, shift in zip(capture.photographs, exposures, shifts, strict=True)
        ],
        more={
            "quantisation_step": max(each.step for each in decoding),
            "light_file": {
                "file": capture.light_file.name,
                "sha256": hashlib.sha256(capture.light_file.read_bytes()).hexdigest(),
            },
            "notes": notes,
            **(corrections.attributes() if corrections.files else {}),
        },
    )


def _decoders(
    photographs: Sequence[Photograph],
    linearisation: Linearisation,
    memory_bytes: float,
    exposures: int = 1,
    *,
    shifted: bool = False,
) -> int:
    """Return how many photographs to decode at a time: as many as there are cores, if memory allows."""
    rows = stores.STACK_CHUNK
    largest = max(
        photograph.width
        * photograph.channels
        * (
            # a band, and what the format makes a reader decode at once
            (rows + max(rows, photograph.unit_rows)) * photograph.dtype.itemsize
            # the band as stored, its chunks, and the chunks compressed
            + 3 * rows * linearisation.dtype.itemsize
            # bands that a shift holds, with the one that it makes
            + 3 * shifted * rows * linearisation.dtype.itemsize
            # exposures to be merged, all of each, and some bands of floats
            + (exposures > 1) * exposures * (photograph.height * photograph.dtype.itemsize + 16 * rows)
        )
        # compressed data on their way to the decoder
        + photograph.path.stat().st_size
        for photograph in photographs
    )
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    affordable = int((memory_bytes - _BASE_BYTES) // largest)
    return max(1, min(cores, affordable, len(photographs)))
