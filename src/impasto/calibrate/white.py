"""Find the absolute scale and the light's colour from a white reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.files import subject_of, write_calibration
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import Shot, box_mean, box_problems, one_by_one, photographs_in
from impasto.capture.light_files import read_light_file
from impasto.capture.lights import LightFile, LightRow
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.geometry import Array, position_mm

# Lights that reach the reference more slantingly tell little.
_LEAST_COSINE = 0.2
_CLIPPED = 1e-3
# Lights of one strength agree within a few per cent, those of unknown strengths within their differences.
_LARGEST_SPREAD = 0.5


@dataclass(frozen=True)
class White:
    """What `calibrate.white` found.

    Parameters
    ----------
    file : Path
    radiance : ndarray of shape (C,)
        What a perfect white diffuser reads, in shares of full scale, that a light of intensity 1 meets
        along its normal.
    light_rgb : ndarray of shape (C,)
        The same with mean 1: the colour of the light in the camera's space.
    spread : float
        Relative standard deviation over the lights.
    lights : int
        Lights that were used.
    """

    file: Path
    radiance: Array
    light_rgb: Array
    spread: float
    lights: int


def white(
    photos: str | PathLike[str],
    out: str | PathLike[str],
    *,
    box: Sequence[int],
    lights: str | PathLike[str],
    light: str | None = None,
    reflectance: float = 0.99,
    normal: Sequence[float] = (0.0, 0.0, 1.0),
    height_mm: float = 0.0,
    oecf: str | PathLike[str] | None = None,
) -> White:
    """Find what a perfect white diffuser reads, from a white reference in the photographs.

    Parameters
    ----------
    photos : path
        Folder of photographs, or one of them, in which the reference lies; of the same exposure as the
        painting's.
    out : path
        The calibration file to write, such as ``white.json``.
    box : (int, int, int, int)
        First column, first row, end column and end row of the reference in pixels.
    lights : path
        Light file of the photographs.
    light : str, optional
        Name of the light of a single photograph that has another name.
    reflectance : float, optional
        Of the reference, which is matte.
    normal : sequence of 3 float, optional
        Of the reference in the painting's frame; by default it lies flat.
    height_mm : float, optional
        Of the reference above the painting's plane; counts for near lights only.
    oecf : path, optional
        Calibration file of the camera's response.

    Returns
    -------
    White

    Raises
    ------
    CaptureError
        If photographs or lights cannot be used, or the reference is clipped or lit by none of them.
    OptionError
        If box, reflectance or normal cannot be used.
    OutputError
        If the file cannot be written.
    """
    paths = photographs_in(Path(photos))
    file = read_light_file(Path(lights))
    tilt = np.asarray(normal, np.float64)
    problems = _light_problems(light, len(paths), file)
    if not 0 < reflectance <= 1.2:
        problems.append(
            Problem(f"--reflectance {reflectance:g}", "is not from 0 to 1", "Give it as a share of 1")
        )
    if tilt.shape != (3,) or not tilt[2] > 0:
        problems.append(Problem("--normal", "does not point up", "Give x,y,z with z above 0"))
    shots: list[Shot] = []
    found = []
    clipped = False
    # One photograph at a time is in memory; of the others, only what is said about them is kept.
    for shot in one_by_one(paths):
        if not shots:
            raise_problems(OptionError, [*box_problems(box, shot.codes.shape, "--box"), *problems])
            raise_problems(CaptureError, file.problems)
            tilt = tilt / np.linalg.norm(tilt)
            table = response_table(oecf, [shot])
        shots.append(shot.without_pixels)
        row = _row(light or shot.name, file)
        if row is None:
            continue
        left, top, right, bottom = box
        if shot.clipped[top:bottom, left:right].mean() > _CLIPPED:
            clipped = True
            continue
        irradiance = _irradiance(shot, row, file, box, tilt, height_mm)
        if irradiance is not None:
            gain = np.asarray(row.gain, np.float64)
            found.append(box_mean(shot.linear(table), box) / (reflectance * irradiance * gain))
    if not found:
        what = (
            "show the reference clipped" if clipped else "have no light in the light file that lights it well"
        )
        raise CaptureError(Problem(str(photos), what, "Check the box, the exposure and the names"))
    samples = np.array(found)
    radiance = np.median(samples, axis=0)
    spread = float(np.std(samples.mean(axis=1)) / samples.mean()) if len(samples) > 1 else 0.0
    if spread > _LARGEST_SPREAD:
        what = f"show the reference under {len(samples)} lights that differ by {spread:.0%}, "
        what += f"expected less than {_LARGEST_SPREAD:.0%}"
        do = "Check the box, --normal, and that the lights are those of these photographs"
        raise CaptureError(Problem(str(photos), what, do))
    light_rgb = radiance / radiance.mean()
    write_calibration(
        Path(out),
        "white",
        {
            "radiance": radiance.tolist(),
            "light_rgb": light_rgb.tolist(),
            "reflectance": reflectance,
            "normal": tilt.tolist(),
            "box": list(box),
            "spread": spread,
            "lights": len(samples),
            "exposure_s": shots[0].photograph.exposure_s,
        },
        subject=subject_of(shots, iso=True, f_number=True),
        made_from=[shot.provenance for shot in shots],
    )
    return White(Path(out), radiance, light_rgb, spread, len(samples))


def _row(name: str, file: LightFile) -> LightRow | None:
    return next((row for row in file.rows if Path(row.file or "").stem == name), None)


def _light_problems(light: str | None, shots: int, file: LightFile) -> list[Problem]:
    """Return what is wrong with the name of a single photograph's light."""
    if light is None:
        return []
    where, problems = f"--light {light}", []
    if shots > 1:
        what = f"names one light for {shots} photographs"
        problems.append(Problem(where, what, "Give one photograph, or name them like their lights"))
    if not file.problems and _row(light, file) is None:
        problems.append(Problem(where, f"is no light in {file.path.name}", "Correct the name"))
    return problems


def _irradiance(
    shot: Shot, row: LightRow, file: LightFile, box: Sequence[int], normal: Array, height_mm: float
) -> float | None:
    """Return the irradiance of the reference by a light of gain 1, None where it comes too slantingly."""
    direction = np.array(row.direction) / np.linalg.norm(row.direction)
    fall_off = 1.0
    if row.position_mm is not None and file.camera.mm_per_px is not None:
        height, width, _ = shot.codes.shape
        left, top, right, bottom = box
        x, y = position_mm(
            (top + bottom - 1) / 2, (left + right - 1) / 2, height, width, file.camera.mm_per_px
        )
        lamp = np.array(row.position_mm)
        towards = lamp - np.array([x, y, height_mm])
        direction = towards / np.linalg.norm(towards)
        fall_off = float(lamp @ lamp / (towards @ towards))
    cosine = float(direction @ normal)
    return cosine * fall_off if cosine > _LEAST_COSINE else None
