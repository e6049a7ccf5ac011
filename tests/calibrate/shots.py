"""Calibration shots of a simulated camera, without a painting."""

import numpy as np

from impasto.capture.simulate.calibration import Studio, write_calibration
from impasto.capture.simulate.camera import Sensor
from impasto.capture.simulate.lamps import named
from impasto.geometry import Camera, Lights


def take_shots(
    folder, *, size=(360, 480), distance_mm=None, directions=((0.1, 0.2, 0.97),), seed=1, **sensor
):
    """Photograph cards, charts and spheres; return the studio. The frame is 100 mm high."""
    lights = named(np.array(directions, float))
    if distance_mm is not None:
        lights = Lights(lights.names, lights.direction, distance_mm * lights.direction)
    camera = Camera(mm_per_px=100 / size[0])
    studio = Studio(lights, camera, Sensor(**sensor), size, ".tif", "none", seed)
    write_calibration(folder, studio)
    return studio
