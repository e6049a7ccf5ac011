"""The journal of a capture: what happened, one line of JSON each, written to the disk before it counts."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from impasto.errors import CaptureError, Problem
from impasto.output import output_error

# A wall clock that differs by more than this from the time that has passed was set in between.
_STEP_S = 2.0


class Journal:
    """An append-only file of numbered entries.

    The order of entries is that of their numbers; the wall clock is noted and never relied on. A line that a
    power cut left unfinished is skipped.

    Parameters
    ----------
    path : Path
        Made if it is not there.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.entries: list[dict[str, Any]] = []
        self.broken_lines = 0
        try:
            # Without a buffer, so that nothing is left in one that a full disk did not take.
            self._file = path.open("ab+", buffering=0)
            self._file.seek(0)
            data = self._file.readall()
            if data and not data.endswith(b"\n"):
                self._append(b"\n")
        except OSError as error:
            raise output_error(path, error.strerror or str(error)) from error
        for line in data.splitlines():
            try:
                self.entries.append(json.loads(line))
            except ValueError:
                self.broken_lines += 1
        self._clock = (time.time(), time.monotonic())

    def write(self, event: str, **content: Any) -> dict[str, Any]:
        """Add an entry; when this returns, it is on the disk.

        Raises
        ------
        OutputError
            If it cannot be written; no entry was added then.
        """
        number = self.entries[-1]["number"] + 1 if self.entries else 1
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        entry = {"number": number, "time": now, "event": event, **content}
        line = json.dumps(entry, ensure_ascii=False).encode() + b"\n"
        size = self._file.seek(0, os.SEEK_END)
        try:
            self._append(line)
        except OSError as error:
            self._file.truncate(size)
            raise output_error(self.path, error.strerror or str(error)) from error
        self.entries.append(entry)
        return entry

    def clock_step_s(self) -> float:
        """Return by how many seconds the wall clock was set since this was last asked, 0 if it was not."""
        wall, steady = time.time(), time.monotonic()
        step = (wall - self._clock[0]) - (steady - self._clock[1])
        self._clock = (wall, steady)
        return step if abs(step) > _STEP_S else 0.0

    def of(self, *events: str) -> Iterator[dict[str, Any]]:
        """Yield the entries of some events, oldest first."""
        return (entry for entry in self.entries if entry["event"] in events)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _append(self, data: bytes) -> None:
        left = memoryview(data)
        while left:
            left = left[self._file.write(left) :]
        os.fsync(self._file.fileno())


@contextmanager
def alone(path: Path, doing: str) -> Iterator[None]:
    """Hold a lock file while the block runs; it goes with the process, however that ends.

    Raises
    ------
    CaptureError
        If another process holds it.
    """
    with path.open("a") as file:
        try:
            import fcntl
        except ImportError:  # Windows has no such locks
            yield
            return
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            do = "Wait until it has ended, or end it"
            raise CaptureError(Problem(str(path.parent.parent), f"another process is {doing}", do)) from None
        except OSError:  # some network file systems have no locks
            pass
        yield
