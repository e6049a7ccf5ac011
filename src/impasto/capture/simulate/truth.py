"""Ground truth beside a simulated capture: maps as EXR, everything else as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.manifest import light_positions
from impasto.capture.simulate.files import write_image
from impasto.capture.simulate.illumination import Scene
from impasto.capture.simulate.lamps import named
from impasto.capture.simulate.materials import SHAPES
from impasto.capture.simulate.surface import Surface
from impasto.colour import encode_srgb, quantise
from impasto.geometry import Lights, dome_direction
from impasto.images import write_png
from impasto.output import write_json, write_text


def write_truth(
    folder: Path, scene: Scene, lights: Lights, files: Sequence[str], asked: dict[str, Any]
) -> None:
    """Write the painting's true maps, a preview, the lights as an .lp file, and truth.json.

    Parameters
    ----------
    folder : Path
    scene : Scene
    lights : Lights
    files : sequence of str, length L
        The photographs' file names.
    asked : dict
        What the simulation was asked for, and which program did it.
    """
    for name, image in _maps(scene.surface).items():
        write_image(folder / f"{name}.exr", image)
    write_png(folder / "preview.png", preview(scene))
    write_text(folder / "lights.lp", light_positions(files, lights))
    write_json(folder / "truth.json", asked | describe(scene, lights, files))


def _maps(surface: Surface) -> dict[str, NDArray[np.float32]]:
    """Return the maps by name; besides c, the shape that the models have if it is another."""
    maps = {
        "height": surface.height_mm,
        "normal": surface.normal,
        "diffuse": surface.diffuse,
        "specular": surface.specular,
        "c": surface.alpha,
        "material": surface.material.astype(np.float32),
    }
    shapes = {SHAPES[entry.model] for entry in surface.materials} - {""}
    if shapes - {"c"}:
        maps[shapes.pop() if len(shapes) == 1 else "shape"] = surface.shape
    return maps


def preview(scene: Scene) -> NDArray[np.uint8]:
    """Return the painting under a lamp at the upper left and a weaker one near the camera, sRGB, 8 bits."""
    key = named(dome_direction(np.radians([58.0, 22.0]), np.radians([142.0, 70.0])))
    image = 0.95 * scene.radiance(key, 0) + 0.35 * scene.radiance(key, 1)
    return quantise(encode_srgb(image), np.uint8)


def describe(scene: Scene, lights: Lights, files: Sequence[str]) -> dict[str, Any]:
    """Return all that is known about a simulation besides its maps, ready for JSON."""
    surface, camera = scene.surface, scene.camera
    tilt = np.degrees(np.arccos(np.clip(surface.normal[..., 2], -1, 1)))
    counts = np.bincount(surface.material.ravel(), minlength=len(surface.materials))
    return {
        "camera": {
            "view_direction": camera.view_direction.tolist(),
            "distance_mm": camera.distance_mm,
            "mm_per_px": surface.mm_per_px,
        },
        "lights": [
            {
                "file": file,
                "direction": lights.direction[row].tolist(),
                "position_mm": lights.position_mm[row].tolist()
                if np.isfinite(lights.position_mm[row]).all()
                else None,
                "intensity": lights.intensity[row].tolist(),
                "angular_size_deg": float(np.nan_to_num(lights.angular_size_deg[row])),
            }
            for row, file in enumerate(files)
        ],
        "materials": [
            {
                "index": number,
                "name": entry.name,
                "model": entry.model,
                "specular_tint": list(entry.tint),
                "measured": entry.measured,
                "share": float(counts[number] / surface.material.size),
            }
            for number, entry in enumerate(surface.materials)
        ],
        "relief": {
            "height_range_mm": [float(surface.height_mm.min()), float(surface.height_mm.max())],
            "tilt_deg_percentiles": {
                str(percent): float(value)
                for percent, value in zip((50, 90, 99), np.percentile(tilt, (50, 90, 99)), strict=True)
            },
        },
    }
