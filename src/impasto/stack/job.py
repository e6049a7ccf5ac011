"""The photographs of one run: decoded in threads, linearised, and written into the store."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.capture import Capture
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.progress import progress
from impasto.stack.brackets import Exposure, check_times, merge, sample
from impasto.stack.corrections import Corrections
from impasto.stack.decoders import affordable_decoders
from impasto.stack.digests import ALGORITHM, photograph_digest
from impasto.stack.header import stack_header
from impasto.stack.light_colour import light_colour
from impasto.stack.linearise import linearisations
from impasto.stack.samples import Samples
from impasto.stack.shift import Shift

Result = TypeVar("Result")


class _StoppedError(Exception):
    """A thread was told to stop; nobody sees this."""


class Job:
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
        self.header = stack_header(capture, self._linearisations, corrections, exposures)
        self.decoders = affordable_decoders(
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
