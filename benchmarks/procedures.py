"""Processor time per pixel of the joint and of the paper procedure, from store to store.

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


def arm_directions() -> np.ndarray:
    """Return as many lights as the dome has, on an arm from −80° to 80°; shape (L, 3)."""
    angle = np.radians(np.linspace(-80, 80, LIGHTS))
    return np.stack([np.sin(angle), np.zeros(LIGHTS), np.cos(angle)], axis=-1)


def measure(folder: Path, side_px: int) -> dict[str, float]:
    """Return pixels per second of processor time of each procedure, on the lights that it is for.

    Reading the stack and writing the maps count, on one core.
    """
    import impasto

    speeds = {}
    for procedure, lights in (("joint", light_directions()), ("paper", arm_directions())):
        capture = write_capture(folder / procedure, lights, side_px, side_px)
        store = folder / f"{procedure}.zarr"
        impasto.stack(capture.folder, store, show_progress=False)
        command = [sys.executable, "-m", "benchmarks.procedures", str(store), procedure]
        environment = os.environ | {"RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
        speeds[procedure] = capture.pixels / json.loads(done.stdout)["cpu_s"]
    return speeds


if __name__ == "__main__":
    import impasto

    started = time.process_time()
    impasto.fit(sys.argv[1], models=[MODEL], procedure=sys.argv[2], show_progress=False)
    print(json.dumps({"cpu_s": time.process_time() - started}))
