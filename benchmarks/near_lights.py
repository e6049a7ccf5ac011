"""What self-calibration makes of lamps near the painting that are stated as distant.

`python -m benchmarks.near_lights MEASURED` simulates a still life of the measured materials of MEASURED
(measured_brdf.npz), which casts shadows, under 64 lamps at several distances, in units of the painting's
longer side. Five, spread in elevation, are held out; no position is stated, and in the last two scenes the
directions of the others are misstated by 1°. It prints how far the distances found are off, how normals are
off, among that from one side of the painting to the other (the bowl that near light makes of a flat
painting), and how close the held-out photographs are met; first with lights taken for distant, then with
distances sought.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import zarr
from numpy.typing import NDArray

import impasto
from impasto.capture.simulate.lamps import dome_lights
from impasto.evaluate.held_out import spread_lights
from impasto.fit import FitOptions
from impasto.geometry import Lights, degrees_between
from impasto.store import open_fit, open_stack

MODEL = "torrance-sparrow-ambient"
LIGHTS = 64
SIZE = (256, 192)
EXTENT_MM = 100 * SIZE[0] / SIZE[1]

Array = NDArray[np.float64]


def scenes() -> dict[str, tuple[Lights, float]]:
    """Return the lamps of each scene, and by how many degrees their directions are misstated."""
    lights = dome_lights(LIGHTS)
    uneven = np.exp(0.2 * np.random.default_rng(7).standard_normal((LIGHTS, 1)))
    beside = 2.0 * lights.direction + [0.6, 0.3, 0.0]

    def at(position: Array) -> Lights:
        direction = position / np.linalg.norm(position, axis=1, keepdims=True)
        return replace(lights, direction=direction, position_mm=position * EXTENT_MM)

    return {
        "distant": (lights, 0.0),
        **{f"all at {far:g}": (at(far * lights.direction), 0.0) for far in (10.0, 6.0, 3.0, 1.5)},
        "3, each off by 20 %": (at(3.0 * uneven * lights.direction), 1.0),
        "around a place beside the painting": (at(beside), 1.0),
    }


def simulate(measured: Path, folder: Path, lights: Lights, error_deg: float) -> tuple[Path, Lights]:
    """Return a store of photographs whose lights are stated as distant, and the lights as they are."""
    store = folder / "painting.zarr"
    impasto.simulate(folder / "photos", lights=lights, size=SIZE, measured=measured)
    impasto.stack(folder / "photos", store)
    true = open_stack(store).lights
    held = spread_lights(true, 5)
    error = np.radians(error_deg / np.sqrt(2.0)) * np.random.default_rng(3).standard_normal((LIGHTS, 3))
    error[held] = 0.0
    stated = true.direction + error
    zarr.open_array(store / "stack" / "light_direction", mode="r+")[...] = stated / np.linalg.norm(
        stated, axis=1, keepdims=True
    )
    zarr.open_array(store / "stack" / "light_position_mm", mode="r+")[...] = np.full((LIGHTS, 3), np.nan)
    return store, true


def measure(store: Path, true: Lights, normal: Array, *, sought: bool) -> str:
    """Fit without the lights held out, and return the figures as a line."""
    held = spread_lights(true, 5)
    names = tuple(true.names[index] for index in held)
    options = FitOptions(residual=True, exclude=names, calibrate_distances=sought)
    impasto.fit(store, models=[MODEL], options=options, overwrite=True)
    fit = open_fit(store, MODEL)
    found = fit.attributes["self_calibration"].get("distances", {"used": "stated"})
    off = ""
    if found["used"] != "stated":
        distance = np.linalg.norm(np.delete(true.position_mm, held, axis=0), axis=1) / EXTENT_MM
        error = np.log(np.array(found[found["used"]]) / distance)
        off = f", off by {100 * np.sqrt(np.square(error).mean()):.1f} % (rms)"
    fitted = fit.read(slice(0, SIZE[1]), slice(0, SIZE[0]), ["normal"])["normal"].astype(np.float64)
    across = np.degrees(np.nanmean((fitted - normal)[..., 0], axis=0))
    bowl = np.polyfit(np.linspace(-0.5, 0.5, SIZE[0]), across, 1)[0]
    judged = impasto.evaluate(store, models=[MODEL], held_out_lights=names, baselines=False).models[0]
    alone = judged.without_residual.psnr_db if judged.without_residual else judged.mean.psnr_db
    return (
        f"{found['used']}{off}; normals off by {float(np.nanmean(degrees_between(fitted, normal))):.2f}°, "
        f"from side to side {bowl:.2f}°; held out {judged.mean.psnr_db:.1f} dB, model alone {alone:.1f} dB"
    )


if __name__ == "__main__":
    for scene, (lamps, misstated_deg) in scenes().items():
        with tempfile.TemporaryDirectory() as temporary:
            made, as_they_are = simulate(Path(sys.argv[1]), Path(temporary), lamps, misstated_deg)
            truth = oiio.ImageInput.open(str(Path(temporary) / "photos" / "truth" / "normal.exr"))
            normals = np.asarray(truth.read_image("float"), np.float64)
            print(scene)
            for sought in (False, True):
                print("  ", measure(made, as_they_are, normals, sought=sought))
