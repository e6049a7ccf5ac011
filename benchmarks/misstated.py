"""What self-calibration and the residual term make of lights whose strengths and directions are misstated.

`python -m benchmarks.misstated MEASURED` simulates still lifes of the measured materials of MEASURED
(measured_brdf.npz), which cast shadows, under 64 lights. Five, spread in elevation, are held out and stated
as they were; of the others the strengths are misstated by 10 % and the directions by 2°. It prints how far
both are off before and after, how close the held-out photographs are met, by this fit and by the best method
without a model, and how far normals are off, beside those of least-squares photometric stereo.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import zarr
from numpy.typing import NDArray

import impasto
from impasto.evaluate.held_out import spread_lights
from impasto.fit import FitOptions
from impasto.geometry import degrees_between
from impasto.store import open_fit, open_stack

MODEL = "torrance-sparrow-ambient"
LIGHTS = 64
SIZE = (256, 192)
SCENES = ((0, 1), (0, 2), (1, 3))
"""Seeds of the painting and of the errors."""

Array = NDArray[np.float64]


def measure(measured: Path, folder: Path, painting: int, errors: int) -> dict[str, float]:
    """Simulate a scene in `folder` and return the figures of it."""
    photos, store = folder / "photos", folder / "painting.zarr"
    impasto.simulate(photos, dome=True, lights=LIGHTS, size=SIZE, seed=painting, measured=measured)
    impasto.stack(photos, store)
    stack = open_stack(store)
    held = spread_lights(stack.lights, 5)
    others = np.setdiff1d(np.arange(LIGHTS), held)
    true_direction, true_strength = _misstate(store, others, np.random.default_rng(errors))
    names = tuple(stack.lights.names[index] for index in held)
    impasto.fit(store, models=[MODEL], options=FitOptions(residual=True, exclude=names))
    fit, stated = open_fit(store, MODEL), open_stack(store).lights
    found = fit.attributes["self_calibration"]
    directions = found["directions"]
    used = np.array(directions["corrected"]) if directions["used"] else stated.direction[others]
    departure = np.log(np.array(found["gain"]) / np.array(found["trend"])).mean(axis=1)
    strength = stated.intensity[others].mean(axis=1) * np.exp(departure)
    off = np.log(strength / true_strength[others])
    off -= np.median(off)
    judged = impasto.evaluate(store, models=[MODEL], held_out_lights=names)
    normal = _normals(photos)
    height, width = fit.shape
    rows, columns = slice(0, height), slice(0, width)
    fitted = fit.read(rows, columns, ["normal"])["normal"].astype(np.float64)
    stereo = _photometric_stereo(store, others)
    return {
        "directions stated, deg rms": _rms(degrees_between(stated.direction[others], true_direction[others])),
        "directions found, deg rms": _rms(degrees_between(used, true_direction[others])),
        "strengths off, % median": 100 * float(np.median(np.abs(off))),
        "strengths off, % rms": 100 * _rms(off),
        "held out, dB": judged.models[0].mean.psnr_db,
        "best without a model, dB": max(method.mean.psnr_db for method in judged.baselines),
        "normals off, deg mean": float(np.nanmean(degrees_between(fitted, normal))),
        "photometric stereo, deg mean": float(np.nanmean(degrees_between(stereo, normal))),
    }


def _misstate(store: Path, which: NDArray[np.intp], rng: np.random.Generator) -> tuple[Array, Array]:
    """Change what the stack says of lights; return direction (L, 3) and strength (L,) as they were."""
    direction = zarr.open_array(store / "stack" / "light_direction", mode="r+")
    intensity = zarr.open_array(store / "stack" / "light_intensity", mode="r+")
    true = np.asarray(direction[...]), np.asarray(intensity[...])
    stated = true[0] + np.radians(2.0 / np.sqrt(2.0)) * rng.standard_normal(true[0].shape) * _mask(which)
    direction[...] = stated / np.linalg.norm(stated, axis=1, keepdims=True)
    intensity[...] = true[1] * np.exp(0.1 * rng.standard_normal((LIGHTS, 1)) * _mask(which))
    return true[0], true[1].mean(axis=1)


def _mask(which: NDArray[np.intp]) -> Array:
    mask = np.zeros((LIGHTS, 1))
    mask[which] = 1.0
    return mask


def _normals(photos: Path) -> Array:
    """Return the simulated painting's true normals, (height, width, 3)."""
    image = oiio.ImageInput.open(str(photos / "truth" / "normal.exr"))
    return np.asarray(image.read_image("float"), np.float64)


def _photometric_stereo(store: Path, lights: NDArray[np.intp]) -> Array:
    """Return the normals of least squares over all lights, as stated, on the mean of the channels."""
    stack = open_stack(store)
    height, width = stack.shape[1:3]
    chosen = stack.lights.select(lights)
    grey = stack.radiance(slice(0, height), slice(0, width), lights).mean(axis=3)
    grey /= chosen.intensity.mean(axis=1)[:, None, None]
    scaled = np.linalg.lstsq(chosen.direction, grey.reshape(len(lights), -1), rcond=None)[0].T
    normal: Array = (scaled / np.linalg.norm(scaled, axis=1, keepdims=True)).reshape(height, width, 3)
    return normal


def _rms(values: Array) -> float:
    return float(np.sqrt(np.square(values).mean()))


if __name__ == "__main__":
    for painting, errors in SCENES:
        with tempfile.TemporaryDirectory() as folder:
            figures = measure(Path(sys.argv[1]), Path(folder), painting, errors)
        print(f"painting {painting}, errors {errors}")
        for name, value in figures.items():
            print(f"  {name:30s} {value:.2f}")
