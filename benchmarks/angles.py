"""Time the whole study of 72 photographs: `impasto angles` on a dome."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from benchmarks.photographs import write_capture

LIGHTS = 72
PIXELS, SIZES, STRATEGIES = 20_000, 10, 4
_ZENITH_DEG = (10.0, 72.0)


def dome(lights: int = LIGHTS) -> np.ndarray:
    """Return lights on a spiral dome, shape (L, 3)."""
    top, bottom = np.cos(np.radians(_ZENITH_DEG))
    z = top + (bottom - top) * (np.arange(lights) + 0.5) / lights
    azimuth = np.pi * (3 - np.sqrt(5.0)) * np.arange(lights)
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=-1)


def measure(folder: Path, side_px: int, pixels: int) -> dict[str, float]:
    """Return the seconds that a study takes, and how many sizes and strategies it looked at."""
    import impasto

    capture = write_capture(folder / "angles", dome(), side_px, side_px)
    store = folder / "angles.zarr"
    impasto.stack(capture.folder, store, show_progress=False)
    started = time.perf_counter()
    found = impasto.angles(store, pixels=pixels, out=folder / "study", show_progress=False)
    seconds = time.perf_counter() - started
    study = found.models[0]
    return {
        "seconds": seconds,
        "sizes": len(study.random),
        "strategies": 1 + len({point.strategy for point in study.points}),
    }
