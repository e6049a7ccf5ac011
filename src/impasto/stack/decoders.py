"""How many photographs are decoded at a time, in the memory that there is."""

from __future__ import annotations

import os
from collections.abc import Sequence

from impasto import store as stores
from impasto.capture import Photograph
from impasto.stack.linearise import Linearisation

# What the program needs before the first photograph is decoded.
_BASE_BYTES = 0.3e9


def affordable_decoders(
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
