"""What leaving out cast shadows makes of a fit, on simulated paintings of which the shadows are known.

`python -m benchmarks.shadows MEASURED` simulates swatches and a still life, of the model that is fitted and
of the measured materials of MEASURED (measured_brdf.npz), under 40 lights. It prints, for least squares,
Cauchy's loss, `--shadows`, and shadows left out as the truth has them: how far normals and the logarithm of
c are off on average, the processor time over that of least squares, and how close photographs are met that
were held out in five folds, by the model and with the residual term. Of `--shadows` it prints how many of the
samples found lie in shadow, and how many are found of those that the light would reach from 10° above the
surface or more.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import impasto
from impasto.capture.simulate.capture import set_up
from impasto.capture.simulate.settings import Settings
from impasto.fit import FitOptions, fit_tile
from impasto.geometry import degrees_between
from impasto.models import parse_model
from impasto.store import Maps, open_stack

MODEL = "torrance-sparrow"
SCENES: dict[str, dict[str, Any]] = {
    "swatches, steep relief": {"preset": "swatches", "relief_scale": 3.0},
    "the same in 8 bits": {"preset": "swatches", "relief_scale": 3.0, "bits": 8, "format": "png"},
    "the same without shadows": {"preset": "swatches", "relief_scale": 3.0, "cast_shadows": False},
    "swatches": {"preset": "swatches"},
    "still life, measured materials": {"relief_scale": 2.5, "measured": None},
}
SEED = 21
METHODS: dict[str, FitOptions] = {
    "least squares": FitOptions(),
    "--loss cauchy": FitOptions(loss="cauchy"),
    "--shadows": FitOptions(shadows=True),
}
_GRAZING = np.sin(np.radians(10))
_REPEATS = 7


def measure(folder: Path, options: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Simulate a painting in `folder` and return the figures of each method."""
    options = {"dome": True, "lights": 40, "size": (96, 72), "seed": SEED, "calibration": False, **options}
    impasto.simulate(folder / "photos", **options)
    store = folder / "p.zarr"
    impasto.stack(folder / "photos", store)
    scene, lights = set_up(Settings(**options))
    stack = open_stack(store)
    count, height, width, channels = stack.shape
    radiance = stack.radiance(slice(0, height), slice(0, width)).reshape(count, -1, channels)
    shadowed = np.stack([scene.visible(lights, light).ravel() < 0.5 for light in range(count)])
    normal = scene.surface.normal.reshape(-1, 3).astype(np.float64)
    telling = shadowed & ((normal @ lights.direction.T).T > _GRAZING)

    def fitted(options: FitOptions, left_out: NDArray[np.bool_] | None = None) -> Maps:
        return fit_tile(
            parse_model(MODEL),
            radiance,
            lights=stack.lights,
            camera=stack.camera,
            light_rgb=stack.light_rgb,
            clip_level=stack.clip_level,
            noise=stack.noise,
            options=options,
            left_out=left_out,
        )

    def errors(maps: Maps) -> dict[str, float]:
        ratio = maps["c"] / scene.surface.alpha.ravel()
        return {
            "normals off, deg mean": float(degrees_between(maps["normal"], normal).mean()),
            "|ln c| off, mean": float(np.abs(np.log(ratio)).mean()),
        }

    figures = {"known shadows": errors(fitted(FitOptions(), shadowed))}
    seconds = _processor_seconds({name: lambda o=chosen: fitted(o) for name, chosen in METHODS.items()})
    for name, chosen in METHODS.items():
        maps = fitted(chosen)
        figures[name] = errors(maps) | {"time": seconds[name] / seconds["least squares"]}
        if chosen.shadows:
            found = maps["shadowed"].T > 0
            figures[name] |= {
                "samples found, %": 100 * float(found.mean()),
                "precision": float(shadowed[found].mean()) if found.any() else float("nan"),
                "recall": float(found[telling].mean()) if telling.any() else float("nan"),
            }
        figures[name] |= _held_out(store, chosen)
    return figures


def _processor_seconds(jobs: dict[str, Callable[[], Maps]]) -> dict[str, float]:
    """Return the least processor time of each job, run in turn."""
    least = dict.fromkeys(jobs, np.inf)
    for _ in range(_REPEATS):
        for name, job in jobs.items():
            started = time.process_time()
            job()
            least[name] = min(least[name], time.process_time() - started)
    return least


def _held_out(store: Path, options: FitOptions) -> dict[str, float]:
    """Return how close photographs are met that were held out in five folds, in dB."""
    options = FitOptions(loss=options.loss, shadows=options.shadows, residual=True, self_calibrate=False)
    impasto.fit(store, models=[MODEL], options=options, overwrite=True)
    (found,) = impasto.evaluate(store, models=[MODEL], folds=5, baselines=False).models
    assert found.without_residual is not None
    return {
        "held out, dB": found.without_residual.psnr_db,
        "held out with residual, dB": found.mean.psnr_db,
    }


if __name__ == "__main__":
    for title, options in SCENES.items():
        chosen = {key: sys.argv[1] if key == "measured" else value for key, value in options.items()}
        with tempfile.TemporaryDirectory() as folder:
            figures = measure(Path(folder), chosen)
        print(title)
        for method, row in figures.items():
            print(f"  {method:14s} " + ", ".join(f"{name} {value:.3g}" for name, value in row.items()))
