"""The whole way from photographs to maps, against what cannot be avoided: decoding and fitting, each alone.

`python -m benchmarks.whole decode|memory FOLDER` measures one of the two floors, `frame STORE` a rendering
from a store; each prints seconds.
"""

from __future__ import annotations

import compileall
import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.photographs import WHITE, Capture
from benchmarks.problem import INDEX, MODEL, NOISE, VIEW_DIRECTION, light_directions

# Pixels held in memory for the fit alone, in tiles; a larger picture is the same blocks again.
MEMORY_PX = 1 << 20
TILE_PX = 1 << 16


# Linux counts to a process's peak memory what the process it was forked from held. This one is small; the
# benchmarks hold gigabytes by now.
_LAUNCH = """
import json, os, subprocess, sys, time
started = time.perf_counter()
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(process.pid, 0)
code = process.returncode = os.waitstatus_to_exitcode(status)
result = {"wall_s": time.perf_counter() - started, "cpu_s": used.ru_utime + used.ru_stime}
# Linux counts kilobytes.
print(json.dumps({**result, "peak_gb": used.ru_maxrss * 1024 / 1e9}))
sys.exit(code)
"""


# Of each part, and of what it is measured against, the fastest run counts.
_RUNS = 3

# ext4 makes files more slowly in the first seconds after many were deleted.
_AFTER_DELETION_S = 6

# Writes to a byte of each page of so many bytes of memory, and gives it back.
_TOUCH = "import sys, numpy as np; np.empty(int(sys.argv[1]), np.uint8)[::4096] = 1"


def wake_memory(size: int) -> None:
    """Have `size` bytes of memory ready, or as many as are free, for what is timed next.

    Firecracker and other virtual machines give memory that has been free for some seconds back to their host,
    and get it again, when it is used, at 2 ms per MB: 25 times what the copying takes that they are used for,
    and as much as a fit takes. How much of it a run meets depends on what ran before it.
    """
    free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    subprocess.run([sys.executable, "-c", _TOUCH, str(min(size, free * 3 // 4))], check=True)


def run(command: list[str]) -> dict[str, float]:
    """Run a command to its end and return its wall time, processor time and peak memory.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    launched = subprocess.run(
        [sys.executable, "-c", _LAUNCH, *command], check=True, stdout=subprocess.PIPE, text=True
    )
    result: dict[str, float] = json.loads(launched.stdout)
    return result


def impasto(*arguments: str) -> dict[str, float]:
    """Run the command line as a user would; see `run`."""
    return run([str(Path(sys.executable).with_name("impasto")), *arguments])


def measure(capture: Capture, store: Path) -> dict[str, Any]:
    """Time the way from a capture to maps, without and with a residual, a rendering, and the two floors."""
    # As it lies after a first use, or in an installed package.
    compileall.compile_dir(Path(find_spec("impasto").origin).parent, quiet=1)
    # Of a process of its own, and of the files that it writes.
    memory = int(1.5 * capture.pixels * len(capture.files) * 6) + (1 << 30)
    floors = {what: _alone(what, capture.folder, memory) for what in ("decode", "memory")}
    fit_alone = floors["memory"]["seconds"] * capture.pixels / floors["memory"]["pixels"]
    ways = [_way(capture.folder, store, memory) for _ in range(_RUNS)]
    stack, fit = (min(runs, key=lambda run: run["wall_s"]) for runs in zip(*ways, strict=True))
    report = impasto("report", str(store), str(store.with_suffix(".html")))
    with_residual = ("fit", str(store), "--model", MODEL, "--residual", "--overwrite")
    residual = min((_timed(memory, *with_residual) for _ in range(_RUNS)), key=lambda run: run["wall_s"])
    frame = _alone("frame", store, 0)
    alone = floors["decode"]["seconds"] + fit_alone
    return {
        "megapixels": capture.pixels / 1e6,
        "photographs": len(capture.files),
        "stack": stack,
        "fit": fit,
        "residual": residual,
        "residual_ratio": residual["wall_s"] / fit["wall_s"],
        "frame_s": frame["seconds"],
        "report": report,
        "decode_alone_s": floors["decode"]["seconds"],
        "fit_alone_s": fit_alone,
        "ratio": (stack["wall_s"] + fit["wall_s"]) / alone,
        "peak_gb": max(run["peak_gb"] for run in (stack, fit, residual)),
    }


def _way(photos: Path, store: Path, memory: int) -> tuple[dict[str, float], dict[str, float]]:
    """Stack and fit, where nothing is."""
    if store.exists():
        shutil.rmtree(store)
        time.sleep(_AFTER_DELETION_S)
    os.sync()  # what was written before is not part of the way
    stack = _timed(memory, "stack", str(photos), str(store))
    return stack, _timed(memory, "fit", str(store), "--model", MODEL)


def _timed(memory: int, *arguments: str) -> dict[str, float]:
    wake_memory(memory)
    return impasto(*arguments)


def _alone(what: str, path: Path, memory: int) -> dict[str, float]:
    """Return the fastest of the runs, each in a process of its own."""

    def once() -> dict[str, float]:
        wake_memory(memory)
        command = [sys.executable, "-m", "benchmarks.whole", what, str(path)]
        result: dict[str, float] = json.loads(
            subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
        )
        return result

    return min((once() for _ in range(_RUNS)), key=lambda result: result["seconds"])


def _decode(files: list[Path]) -> dict[str, float]:
    """Decode every file on all cores by tifffile, and throw the pixels away."""
    import tifffile

    started = time.perf_counter()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        sizes = list(pool.map(lambda file: tifffile.imread(file, maxworkers=1).size, files))
    return {"seconds": time.perf_counter() - started, "pixels": sizes[0] / 3}


def _fit_memory(files: list[Path]) -> dict[str, float]:
    """Fit the first rows of the photographs from memory, tile by tile, on all cores."""
    import tifffile

    from impasto.fit.procedure import FitOptions
    from impasto.fit.tile import fit_tile
    from impasto.geometry import Camera, Lights
    from impasto.models import parse_model

    rows = []
    for file in files:
        image = tifffile.imread(file)
        rows.append(image[: max(1, MEMORY_PX // image.shape[1])].reshape(-1, 3))
    radiance = np.stack(rows)
    pixels = radiance.shape[1]
    starts = range(0, pixels, TILE_PX)
    tiles = [np.ascontiguousarray(radiance[:, start : start + TILE_PX]) for start in starts]
    white = 65535 / WHITE
    settings: dict[str, Any] = {
        "lights": Lights(tuple(file.stem for file in files), light_directions()),
        "camera": Camera(np.array(VIEW_DIRECTION)),
        "light_rgb": np.ones(3),
        "clip_level": np.full(3, 0.99),
        "noise": (NOISE[0] / white, NOISE[1] / white, NOISE[2]),
        "scale": 1 / 65535,
        "options": FitOptions(index=INDEX),
    }
    model = parse_model(MODEL)
    fit_tile(model, tiles[0][:, :4096], **settings)
    started = time.perf_counter()
    for tile in tiles:
        fit_tile(model, tile, **settings)
    return {"seconds": time.perf_counter() - started, "pixels": pixels}


def _frame(store: Path) -> dict[str, float]:
    """Render one light from the store, with what the model leaves over; once more than is timed."""
    from impasto.geometry import Lights, dome_direction
    from impasto.render import render_bands
    from impasto.store import open_fit, open_stack

    fit, camera = open_fit(store, MODEL), open_stack(store).camera
    light = Lights(("between",), dome_direction(np.radians([30.0]), np.radians([45.0])))
    seconds = []
    for _ in range(4):
        started = time.perf_counter()
        for _ in render_bands(fit, light, camera):
            pass
        seconds.append(time.perf_counter() - started)
    return {"seconds": float(np.median(seconds[1:])), "pixels": fit.shape[0] * fit.shape[1]}


if __name__ == "__main__":
    what, path = sys.argv[1], Path(sys.argv[2])
    if what == "frame":
        result = _frame(path)
    else:
        result = {"decode": _decode, "memory": _fit_memory}[what](sorted(path.glob("*.tif")))
    print(json.dumps(result))
