"""Write light files: the TOML manifest and the .lp file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from impasto.geometry import Camera, Lights


def manifest(
    files: Sequence[str],
    lights: Lights,
    camera: Camera,
    photographs: Iterable[str] = (),
    *,
    exposure_s: float | Sequence[float] | None = None,
) -> str:
    """Return the TOML manifest of a folder of photographs.

    Parameters
    ----------
    files : sequence of str, length L
        The photographs' file names, in the order of the lights.
    lights : Lights
        Their `intensity` becomes ``gain``.
    camera : Camera
    photographs : iterable of str, optional
        Lines of the table ``[photographs]``.
    exposure_s : float or sequence of float, optional
        The photographs' exposure time, or that of each.
    """
    lines = ["[camera]", f"view = {toml_list(camera.view_direction)}"]
    if camera.distance_mm is not None:
        lines.append(f"distance_mm = {toml_number(camera.distance_mm)}")
    if camera.mm_per_px is not None:
        lines.append(f"mm_per_px = {toml_number(camera.mm_per_px)}")
    if about := list(photographs):
        lines += ["", "[photographs]", *about]
    for row, file in enumerate(files):
        lines += ["", "[[light]]", f'file = "{file}"']
        if np.isfinite(lights.position_mm[row]).all():
            lines.append(f"position_mm = {toml_list(lights.position_mm[row])}")
        else:
            lines.append(f"direction = {toml_list(lights.direction[row])}")
        gain = lights.intensity[row]
        lines.append(f"gain = {toml_list(gain) if gain.size > 1 else toml_number(gain[0])}")
        if np.isfinite(lights.angular_size_deg[row]):
            lines.append(f"angular_size_deg = {toml_number(lights.angular_size_deg[row])}")
        if exposure_s is not None:
            time = exposure_s if isinstance(exposure_s, int | float) else exposure_s[row]
            lines.append(f"exposure_s = {toml_number(time)}")
    return "\n".join(lines) + "\n"


def light_positions(files: Sequence[str], lights: Lights) -> str:
    """Return the lights' directions as an .lp file: a count, then file x y z per line."""
    rows = [
        f"{file} {x:.9f} {y:.9f} {z:.9f}" for file, (x, y, z) in zip(files, lights.direction, strict=True)
    ]
    return "\n".join([str(len(rows)), *rows]) + "\n"


def toml_list(numbers: ArrayLike) -> str:
    """Return numbers as TOML."""
    return "[" + ", ".join(toml_number(number) for number in np.ravel(numbers)) + "]"


def toml_number(number: float) -> str:
    """Return a float that TOML reads back as a float, shortest form that keeps it exactly."""
    return repr(float(number))
