"""Files of a store below Zarr: atomic metadata, leftovers of a kill, room on the disk, one run at a time."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

from impasto.errors import Problem, StoreError

# EFBIG is what a limit on the size of files (ulimit -f) gives.
_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

# Names of files being written: by `whole_file` with a process number, by zarr-python with a UUID.
_PARTIAL = re.compile(r".+\.(\d+|[0-9a-f]{32})\.partial")

# What decoders raise on a chunk with a wrong checksum, cut off, or empty.
DAMAGE = (OSError, RuntimeError, ValueError, IndexError)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write `value` to `path`, whole or not at all.

    Raises
    ------
    ValueError
        If `value` holds NaN or an infinity, which JSON has no word for.
    """
    write_whole(path, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False).encode())


def write_whole(path: Path, *parts: bytes | memoryview) -> None:
    """Write `parts`, one after the other; a kill leaves the old file or the new one, never a part of it."""
    with whole_file(path) as file:
        file.writelines(parts)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a file to write, which takes the place of what is at `path` when the block ends without error."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}.partial")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with temporary.open("wb") as file:
            yield file
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def digest(value: Any) -> str:
    """Return the SHA-256 of `value` as canonical JSON, in hexadecimal."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def sweep_partial(store: Path) -> int:
    """Remove what a killed run left half-written under `store`; return how many files that were."""
    leftovers = [path for path in store.rglob("*.partial") if is_partial(path)]
    for path in leftovers:
        path.unlink(missing_ok=True)
    return len(leftovers)


def is_partial(path: Path) -> bool:
    """Return whether `path` is named like a file that impasto or zarr was writing when it was killed."""
    return _PARTIAL.fullmatch(path.name) is not None


def no_room(store: Path, needed: int) -> list[Problem]:
    """Return a problem if the disk that holds `store` has less than `needed` bytes free."""
    folder = store.absolute()
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    if free >= needed:
        return []
    return [
        Problem(
            where=str(store),
            what=f"needs about {_size(needed)}, and the disk has {_size(free)} free",
            do="Make room or choose another place for the store",
        )
    ]


def _size(count: int) -> str:
    return f"{count / 1e9:.2f} GB" if count >= 1e8 else f"{count / 1e6:.2f} MB"


def size_on_disk(path: Path) -> int:
    """Return the bytes of all files under `path`, 0 if it is not there."""
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


@contextmanager
def writing(store: Path, what: str) -> Iterator[None]:
    """Turn faults of the disk while `what` is written into a `StoreError`.

    Raises
    ------
    StoreError
        If the disk is full, a quota is used up, or the file system refuses.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _NO_ROOM:
            cause = "there is no room left on the disk, or a quota is used up"
            do = "Make room and run the same command again: what was finished is kept"
        else:
            cause = f"cannot be written: {error}"
            do = "Check the disk and the permissions, then run the same command again: it goes on from there"
        raise StoreError(Problem(where=f"{store}: {what}", what=cause, do=do)) from error


@contextmanager
def reading(store: Path, what: str, do: str) -> Iterator[None]:
    """Turn damage found while `what` is read into a `StoreError` that advises `do`.

    Every chunk carries a checksum.
    """
    try:
        yield
    except DAMAGE as error:
        if isinstance(error, OSError) and error.errno is not None:
            cause = f"cannot be read: {error.strerror}"
        else:
            cause = f"is damaged: {error}".rstrip(".")
        raise StoreError(Problem(where=f"{store}: {what}", what=cause, do=do)) from error


class RunLog:
    """The log beside a store: one JSON object per line, only ever appended to.

    What differs from run to run (times, process, speed) goes here and not into the store, so that the store
    depends on its inputs alone.
    """

    def __init__(self, descriptor: int, command: str) -> None:
        self._descriptor = descriptor
        self._command = command

    def write(self, event: str, **fields: Any) -> None:
        """Append one line."""
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = {"time": time, "command": self._command, "event": event, "process": os.getpid(), **fields}
        # The log is a witness, not a result: a full disk is reported where the data are written.
        with suppress(OSError):
            os.write(self._descriptor, (json.dumps(line, ensure_ascii=False) + "\n").encode())


def log_path(store: Path) -> Path:
    """Return where the log of `store` lies: beside it, because a store holds nothing but its result."""
    return store.with_name(store.name + ".log.jsonl")


@contextmanager
def run(store: Path, command: str) -> Iterator[RunLog]:
    """Hold `store` for one run that writes, and yield its log.

    Leftovers of a killed run are swept, which is safe only while no other run writes: hence the lock. The
    lock goes with the process, however that ends.

    Raises
    ------
    StoreError
        If another run is writing to the same store, or if the log cannot be written.
    """
    path = log_path(store)
    with writing(store, f"the log {path.name}"):
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        if not _lock(descriptor):
            raise StoreError(
                Problem(
                    where=str(store),
                    what="another run of impasto is writing to this store",
                    do="Wait until it ends, or stop it",
                )
            )
        swept = sweep_partial(store)
        log = RunLog(descriptor, command)
        log.write("start", swept_partial_files=swept)
        try:
            yield log
        except BaseException as error:
            log.write("interrupted" if isinstance(error, KeyboardInterrupt) else "failed", error=str(error))
            raise
        log.write("end")
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Take the lock of an open file; return False if another process has it."""
    try:
        import fcntl
    except ImportError:  # Windows: two runs at once are the user's to avoid.
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # some network file systems have no locks
        return True
    return True
