"""Pixels per second of processor time: impasto's core and scipy, each alone in a process of its own.

`python -m benchmarks.speed core|trf|lm PIXELS FILE` measures one of them, fits the first pixels of the fixed
problem and writes timings and results to FILE (.npz); `measure` runs that with its threads pinned.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.problem import INDEX, MODEL, NOISE, VIEW_DIRECTION, Problem, simulate

# The core takes the first pixels twice: the first call starts its threads.
WARM_UP = 4096


def fit_core(problem: Problem) -> dict[str, Any]:
    """Return impasto's joint fit of the fixed problem."""
    from impasto.fit.procedure import FitOptions
    from impasto.fit.tile import fit_tile
    from impasto.geometry import Camera, Lights
    from impasto.models import parse_model

    lights = Lights(tuple(str(i) for i in range(len(problem.light_direction))), problem.light_direction)
    fitted = fit_tile(
        parse_model(MODEL),
        problem.radiance,
        lights=lights,
        camera=Camera(np.array(VIEW_DIRECTION)),
        light_rgb=np.ones(problem.radiance.shape[-1]),
        clip_level=np.full(problem.radiance.shape[-1], np.inf),
        noise=NOISE,
        options=FitOptions(index=INDEX),
    )
    return {**fitted, "shape": fitted["c"][:, None]}


def fit_scipy(problem: Problem, method: str) -> dict[str, Any]:
    """Return scipy's fit of the fixed problem, pixel by pixel, in the core's form."""
    from benchmarks.scipy_fit import PixelFit

    pixel_fit = PixelFit(problem.light_direction, method)
    found = [pixel_fit.fit(problem.radiance[:, i]) for i in range(problem.radiance.shape[1])]
    return {
        "normal": np.array([solution.normal for solution in found]),
        "diffuse": np.array([solution.diffuse for solution in found]),
        "specular": np.array([solution.specular for solution in found]),
        "shape": np.array([[solution.c] for solution in found]),
        "chi2_reduced": np.array([solution.chi2_reduced for solution in found]),
    }


def measure(what: str, pixels: int, threads: int = 1) -> dict[str, Any]:
    """Measure ``core``, ``trf`` or ``lm`` in a fresh process.

    Returns
    -------
    dict
        `cpu_s`, `wall_s`, and the maps that the fit returned.
    """
    counts = {name: str(threads) for name in ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "measured.npz"
        command = [sys.executable, "-m", "benchmarks.speed", what, str(pixels), str(out)]
        subprocess.run(command, check=True, env=os.environ | counts)
        with np.load(out) as measured:
            arrays = {name: measured[name] for name in measured.files}
    return {name: value.item() if value.ndim == 0 else value for name, value in arrays.items()}


def same_solution(core: dict[str, Any], scipy: dict[str, Any]) -> dict[str, float]:
    """Say how far two fits of the same pixels are the same fit.

    Returns
    -------
    dict
        Share of pixels where chi-square agrees to 1 %, where the core's or scipy's is lower by more than
        that, and of the agreeing pixels the 99th percentile of the differences of normal (degrees) and c
        (relative).
    """
    count = len(scipy["chi2_reduced"])
    core = {name: np.asarray(core[name][:count], float) for name in ("normal", "shape", "chi2_reduced")}
    ratio = core["chi2_reduced"] / scipy["chi2_reduced"]
    same = np.abs(ratio - 1) < 0.01
    angle = np.degrees(np.linalg.norm(core["normal"] - scipy["normal"], axis=1))
    c = np.abs(core["shape"][:, 0] / scipy["shape"][:, 0] - 1)
    return {
        "agreeing": float(same.mean()),
        "core_better": float((ratio <= 0.99).mean()),
        "scipy_better": float((ratio >= 1.01).mean()),
        "normal_difference_deg": float(np.percentile(angle[same], 99)),
        "c_difference_relative": float(np.percentile(c[same], 99)),
    }


def _main(what: str, pixels: int, out: Path) -> None:
    problem = simulate(pixels)
    if what == "core":
        fit_core(simulate(WARM_UP))
    cpu, wall = time.process_time(), time.perf_counter()
    fitted = fit_core(problem) if what == "core" else fit_scipy(problem, what)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    np.savez(out, cpu_s=cpu, wall_s=wall, **fitted)


if __name__ == "__main__":
    _main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
