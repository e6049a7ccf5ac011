"""The light files of a simulated capture: the TOML manifest and the .lp file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impasto.capture.simulate.camera import Sensor
from impasto.geometry import Camera, Lights


def manifest(
    files: Sequence[str],
    lights: Lights,
    camera: Camera,
    sensor: Sensor,
    *,
    ev: float = 0.0,
    exposure_s: float,
) -> str:
    """Return the TOML manifest of a folder of photographs.

    Parameters
    ----------
    files : sequence of str, length L
        The photographs' file names, in the order of the lights.
    lights : Lights
    camera : Camera
    sensor : Sensor
    ev : float
        Exposure of these photographs in stops relative to the sensor's.
    exposure_s : float
        Their exposure time.

    Notes
    -----
    ``gain`` is the image value of a perfect white diffuser that faces the light, so that a fit's diffuse
    magnitudes come out as albedo whatever the exposure was.
    """
    lines = ["[camera]", f"view = {_list(camera.view_direction)}"]
    if camera.distance_mm is not None:
        lines.append(f"distance_mm = {_number(camera.distance_mm)}")
    if camera.mm_per_px is not None:
        lines.append(f"mm_per_px = {_number(camera.mm_per_px)}")
    lines += ["", "[photographs]", *_photographs(sensor)]
    for row, file in enumerate(files):
        lines += ["", "[[light]]", f'file = "{file}"']
        if np.isfinite(lights.position_mm[row]).all():
            lines.append(f"position_mm = {_list(lights.position_mm[row])}")
        else:
            lines.append(f"direction = {_list(lights.direction[row])}")
        gain = lights.intensity[row] * sensor.exposure * 2.0**ev
        lines.append(f"gain = {_list(gain) if gain.size > 1 else _number(gain[0])}")
        if np.isfinite(lights.angular_size_deg[row]):
            lines.append(f"angular_size_deg = {_number(lights.angular_size_deg[row])}")
        lines.append(f"exposure_s = {_number(exposure_s)}")
    return "\n".join(lines) + "\n"


def _photographs(sensor: Sensor) -> list[str]:
    lines = []
    if sensor.response == "tone":
        lines.append("# The response is a curve of its own: measure it from calibration/grey_scale.")
    else:
        lines.append(f'transfer = "{sensor.response}"')
    if np.isfinite(sensor.full_scale):
        # As stored in the files; just below full scale, part of the noise is already cut off.
        lines.append(f"clip_level = {_number(np.floor(0.99 * sensor.full_scale))}")
    if sensor.noisy:
        # Eight bits round, and JPEG blurs, more than the sensor scatters.
        read, relative = (max(sensor.read, 1e-3), 5e-3) if sensor.dtype == "uint8" else (sensor.read, 0.0)
        photon = _number(sensor.photon)
        lines.append(
            f"noise = {{ read = {_number(read)}, photon = {photon}, relative = {_number(relative)} }}"
        )
    return lines


def light_positions(files: Sequence[str], lights: Lights) -> str:
    """Return the lights' directions as an .lp file: a count, then file x y z per line."""
    rows = [
        f"{file} {x:.9f} {y:.9f} {z:.9f}" for file, (x, y, z) in zip(files, lights.direction, strict=True)
    ]
    return "\n".join([str(len(rows)), *rows]) + "\n"


def _list(numbers: np.ndarray) -> str:
    return "[" + ", ".join(_number(number) for number in numbers) + "]"


def _number(number: float) -> str:
    """Return a float that TOML reads back as a float, shortest form that keeps it exactly."""
    return repr(float(number))
