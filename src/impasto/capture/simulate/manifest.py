"""The TOML manifest of a simulated capture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impasto.capture.manifest import manifest, toml_number
from impasto.capture.simulate.camera import Sensor
from impasto.geometry import Camera, Lights


def simulated_manifest(
    files: Sequence[str],
    lights: Lights,
    camera: Camera,
    sensor: Sensor,
    *,
    ev: float = 0.0,
    exposure_s: float,
) -> str:
    """Return the TOML manifest of a folder of simulated photographs.

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
    gain = lights.intensity * sensor.exposure * 2.0**ev
    exposed = Lights(lights.names, lights.direction, lights.position_mm, gain, lights.angular_size_deg)
    return manifest(files, exposed, camera, _photographs(sensor), exposure_s=exposure_s)


def _photographs(sensor: Sensor) -> list[str]:
    lines = []
    if sensor.response == "tone":
        lines.append("# The response is a curve of its own: measure it from calibration/grey_scale.")
    else:
        lines.append(f'transfer = "{sensor.response}"')
    if np.isfinite(sensor.full_scale):
        # As stored in the files; just below full scale, part of the noise is already cut off.
        lines.append(f"clip_level = {toml_number(np.floor(0.99 * sensor.full_scale))}")
    if sensor.noisy:
        # Eight bits round, and JPEG blurs, more than the sensor scatters.
        read, relative = (max(sensor.read, 1e-3), 5e-3) if sensor.dtype == "uint8" else (sensor.read, 0.0)
        photon = toml_number(sensor.photon)
        lines.append(
            f"noise = {{ read = {toml_number(read)}, photon = {photon}, relative = {toml_number(relative)} }}"
        )
    return lines
