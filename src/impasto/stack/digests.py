"""Digests of photographs, by which a stack knows whether they are the same as before."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

from blake3 import blake3

from impasto.errors import CaptureError, Problem


class _Hash(Protocol):
    def update(self, data: Any, /) -> Any: ...

    def hexdigest(self) -> str: ...


ALGORITHM = "blake3"
"""It takes a quarter of the time of SHA-256, which was a quarter of that of a whole stack."""

_HASHES: dict[str, Callable[[], _Hash]] = {ALGORITHM: blake3, "sha256": hashlib.sha256}

# Of a file at a time, so that it stays in the processor's cache.
_BLOCK = 1 << 18


def photograph_digest(files: Sequence[Path], algorithm: str, check_stop: Callable[[], None]) -> str:
    """Return the digest of a photograph's file, in hexadecimal; of several exposures, of their digests.

    Parameters
    ----------
    files : sequence of Path
    algorithm : str
        `ALGORITHM`, or ``sha256``, which earlier versions noted.
    check_stop : callable
        Called every few milliseconds; may raise to end the work.

    Raises
    ------
    CaptureError
        If a file cannot be read.
    """
    digests = [_file_digest(file, algorithm, check_stop) for file in files]
    if len(digests) == 1:
        return digests[0]
    together = _HASHES[algorithm]()
    together.update(" ".join(digests).encode())
    return together.hexdigest()


def _file_digest(path: Path, algorithm: str, check_stop: Callable[[], None]) -> str:
    digest = _HASHES[algorithm]()
    block = memoryview(bytearray(_BLOCK))
    try:
        with path.open("rb", buffering=0) as file:
            while count := file.readinto(block):
                check_stop()
                digest.update(block[:count])
    except OSError as error:
        what = f"cannot be read: {error.strerror}"
        raise CaptureError(Problem(path.name, what, "Copy it again, or leave it out by name")) from error
    return digest.hexdigest()
