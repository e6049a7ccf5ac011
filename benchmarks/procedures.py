"""Processor time per pixel of the joint and of the paper procedure: the fit alone, and from store to store.

`python -m benchmarks.procedures STORE PROCEDURE` fits one and prints processor seconds.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from benchmarks.photographs import write_capture
from benchmarks.problem import LIGHTS, MODEL, light_directions
from benchmarks.whole import wake_memory

import impasto
from impasto.fit import PROCEDURES, FitOptions
from impasto.models import parse_model
from impasto.store import STACK_CHUNK, Stack, open_stack

# Of the process, and of the maps that it writes.
_MEMORY = 2 << 30


def arm_directions() -> np.ndarray:
    """Return as many lights as the dome has, on an arm from −80° to 80°; shape (L, 3)."""
    angle = np.radians(np.linspace(-80, 80, LIGHTS))
    return np.stack([np.sin(angle), np.zeros(LIGHTS), np.cos(angle)], axis=-1)


def measure(folder: Path, side_px: int) -> dict[str, dict[str, float]]:
    """Return pixels per second of processor time of each procedure, on the lights that it is for.

    ``fit`` is of pixels in memory, ``store to store`` includes what a procedure first looks for in the whole
    stack, reading it, and writing the maps; all on one core.
    """
    speeds = {}
    for procedure, lights in (("joint", light_directions()), ("paper", arm_directions())):
        capture = write_capture(folder / procedure, lights, side_px, side_px)
        store = folder / f"{procedure}.zarr"
        impasto.stack(capture.folder, store, show_progress=False)
        command = [sys.executable, "-m", "benchmarks.procedures", str(store), procedure]
        wake_memory(_MEMORY)
        environment = os.environ | {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
        speeds[procedure] = json.loads(done.stdout)
    return speeds


def _fit(stack: Stack, procedure: str) -> float:
    """Return pixels per second of processor time, the better of two fits of a tile in memory."""
    fitter = PROCEDURES[procedure](stack, parse_model(MODEL), FitOptions())
    fitter.prepare(show_progress=False)
    tile = slice(0, min(STACK_CHUNK, stack.shape[1]))
    radiance = stack.read(tile, tile)
    speeds = []
    for _ in range(2):
        started = time.process_time()
        fitter.fit(radiance, tile, tile)
        speeds.append(tile.stop**2 / (time.process_time() - started))
    return max(speeds)


def _store_to_store(stack: Stack, procedure: str) -> float:
    """Return pixels per second of processor time, with everything but the start of the program."""
    started = time.process_time()
    impasto.fit(stack.store, models=[MODEL], procedure=procedure, show_progress=False)
    return float(np.prod(stack.shape[1:3])) / (time.process_time() - started)


if __name__ == "__main__":
    fitted = open_stack(sys.argv[1])
    whole = _store_to_store(fitted, sys.argv[2])
    print(json.dumps({"store to store": whole, "fit": _fit(fitted, sys.argv[2])}))
