"""Which model describes which measured material: the paper's question on materials that nobody here chose.

`python -m benchmarks.measured_materials FOLDER` fits every model to every material of FOLDER's
measured_brdf.npz, by the protocol of its measured_rms.json, and prints tables in Markdown. Light in a plane
every 2.5° over ±75°, view 5° out of that plane, flat sample, luminance, unweighted; RMS over mean radiance.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Ours: name in measured_rms.json.
MODELS = {
    "phong": "phong",
    "phong-no-ambient": "phong_noambient",
    "torrance-sparrow-gaussian": "ts_gauss",
    "torrance-sparrow": "ts",
    "torrance-sparrow-ambient": "ts_amb",
    "gtr": "gtr",
    "gtr-ambient": "gtr_amb",
    "ward": None,
}
BASE = "torrance-sparrow"
TOLERANCE = 0.01
VIEW_DEG = 5.0
# c and the exponent of gtr share a long curved valley, in which the usual 60 steps often end.
_STEPS = 600
ANGLES_DEG = np.arange(-75.0, 75.1, 2.5)
PEAK_CLASSES = {"below 2": (0, 2), "2 to 20": (2, 20), "above 20": (20, np.inf)}
GLOSS_CLASSES = {"below 10 GU": (0, 10), "10 to 70 GU": (10, 70)}


def read_luminance(folder: Path, names: list[str]) -> tuple[Array, Array]:
    """Return radiance (lights, materials) of the protocol, and each material's gloss at 60°."""
    from impasto.capture.simulate.measured import read_measured
    from impasto.evaluate.glossmeter import GLOSSMETERS
    from impasto.geometry import arm_direction
    from impasto.pixels import luminance

    measured = read_measured(folder / "measured_brdf.npz")
    light = arm_direction(np.radians(ANGLES_DEG))
    view = _view()

    def radiance(name: str, light: Array, view: Array) -> Array:
        normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
        view = np.broadcast_to(view, light.shape)
        return np.asarray(luminance(measured.brdf(name, normal, light, view)) * light[:, 2])

    seen = np.stack([radiance(name, light, view) for name in names], axis=1)
    gloss = [
        GLOSSMETERS[1].measure(
            lambda light, view, name=name: np.pi * radiance(name, light, view), log2_rays=13
        )
        for name in names
    ]
    return seen, np.array(gloss)


def fit_rms(model: str, radiance: Array) -> Array:
    """Return RMS over mean of a model fitted to flat samples, shape (materials,)."""
    from impasto.fit.procedure import FitOptions
    from impasto.fit.tile import fit_tile
    from impasto.geometry import Camera, Lights, arm_direction
    from impasto.models import parse_model

    peak = radiance.max(axis=0)
    scaled = (radiance / peak).astype(np.float32)[..., None]
    fitted = fit_tile(
        parse_model(model),
        scaled,
        lights=Lights(tuple(f"{angle:g}" for angle in ANGLES_DEG), arm_direction(np.radians(ANGLES_DEG))),
        camera=Camera(_view()),
        light_rgb=np.ones(1),
        clip_level=np.full(1, np.inf),
        noise=(1.0, 0.0, 0.0),
        options=FitOptions(max_steps=_STEPS),
        normal=(0.0, 0.0, 1.0),
    )
    rms: Array = fitted["residual_rms"] / scaled[..., 0].mean(axis=0)
    return rms


def _view() -> Array:
    tilt = np.radians(VIEW_DEG)
    return np.array([0.0, np.sin(tilt), np.cos(tilt)])


def study(folder: Path) -> dict[str, Any]:
    """Return names, classes, and RMS over mean per model, ours and the reference's."""
    known = json.loads((folder / "measured_rms.json").read_text(encoding="utf-8"))["materials"]
    names = list(known)
    radiance, gloss = read_luminance(folder, names)
    return {
        "names": names,
        "peak": np.array([known[name]["peak_over_diffuse"] for name in names]),
        "gloss": gloss,
        "rms": {model: fit_rms(model, radiance) for model in MODELS},
        "reference": {
            model: np.array([known[name]["models"][key]["rms_over_mean"] for name in names])
            for model, key in MODELS.items()
            if key
        },
    }


def tables(found: dict[str, Any]) -> str:
    """Return the tables in Markdown."""
    lines = ["| materials | n | " + " | ".join(MODELS) + " |", "|---" * (2 + len(MODELS)) + "|"]
    classes = [
        *((f"peak/diffuse {name}", found["peak"], limits) for name, limits in PEAK_CLASSES.items()),
        *((f"60° gloss {name}", found["gloss"], limits) for name, limits in GLOSS_CLASSES.items()),
        ("all", found["peak"], (0, np.inf)),
    ]
    base = found["rms"][BASE]
    for title, value, (low, high) in classes:
        inside = (value >= low) & (value < high)
        ratios = [np.exp(np.log(found["rms"][model] / base)[inside].mean()) for model in MODELS]
        cells = " | ".join(f"{ratio:.2f}" for ratio in ratios)
        lines.append(f"| {title} | {inside.sum()} | {cells} |")
    lines += ["", "| model | within 1 % of the reference or below | further off |", "|---|---|---|"]
    for model, reference in found["reference"].items():
        excess = found["rms"][model] / reference - 1
        worse = [
            f"{found['names'][index]} ({excess[index]:+.1%})"
            for index in np.argsort(-excess)
            if excess[index] > TOLERANCE
        ]
        count = len(excess) - len(worse)
        lines.append(f"| {model} | {count} of {len(excess)} | {', '.join(worse) or 'none'} |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with measured_brdf.npz and measured_rms.json")
    print(tables(study(parser.parse_args().folder)))
