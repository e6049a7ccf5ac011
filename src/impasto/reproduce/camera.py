"""The camera that photographs the samples: its response, measured from a grey scale, and its white."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from impasto import calibrate
from impasto.calibrate.oecf import Oecf
from impasto.capture import read_capture
from impasto.capture.simulate import simulate

RESPONSE = "tone"
"""A curve per channel that no standard formula decodes."""
SHORTER_EXPOSURES = 3
"""Of each photograph, two stops apart: the shortest takes in 250 times white."""
# So that the patches of the grey scale are large enough to be read.
_SIZE_PX = (360, 240)


@dataclass(frozen=True)
class CalibratedCamera:
    """What is known of the camera.

    Parameters
    ----------
    response : Oecf
    white : Path
        Calibration file of the white reference.
    """

    response: Oecf
    white: Path


def calibrate_camera(folder: Path, *, seed: int, show_progress: bool | None) -> CalibratedCamera:
    """Photograph a grey scale and a white card, and measure the response and the scale from them.

    Parameters
    ----------
    folder : Path
        Where photographs and calibration files go.
    seed : int
    show_progress : bool or None
    """
    photos = folder / "photos"
    simulate(photos, lights=1, size=_SIZE_PX, seed=seed, response=RESPONSE, show_progress=show_progress)
    shots = photos / "calibration"
    response = calibrate.oecf(
        shots / "grey_scale.tif",
        shots / "grey_scale.csv",
        folder / "oecf.json",
        card=shots / "grey_scale_card.tif",
        dark=shots / "dark.tif",
    )
    width, height = _SIZE_PX
    white = calibrate.white(
        shots / "white_card.tif",
        folder / "white.json",
        box=(width // 3, height // 3, 2 * width // 3, 2 * height // 3),
        lights=photos / "capture.toml",
        light=read_capture(photos).lights.names[0],
        reflectance=1.0,
        oecf=response.file,
    )
    return CalibratedCamera(response, white.file)
