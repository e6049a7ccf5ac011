"""Measure what the camera reads without light."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.files import read_calibration, subject_of, write_calibration
from impasto.calibrate.response_file import mismatches, response_table
from impasto.calibrate.shots import Shot, read_shot
from impasto.calibrate.surface import GRID, over_frame, smooth_surface
from impasto.errors import CaptureError, Problem, raise_problems

# More light than this is no dark frame, as a share of full scale.
_LIT = 0.05
# A hot pixel differs by this many standard deviations, and this share of full scale.
_HOT = 8.0
_HOT_LEVEL = 2e-3


@dataclass(frozen=True)
class Dark:
    """What `calibrate.dark` found.

    Parameters
    ----------
    file : Path
    level : tuple of float
        Mean per channel, as shares of full scale.
    noise : float
        Standard deviation of a sample, likewise.
    hot : int
        Number of hot pixels.
    """

    file: Path
    level: tuple[float, ...]
    noise: float
    hot: int


def dark(
    photo: str | PathLike[str], out: str | PathLike[str], *, oecf: str | PathLike[str] | None = None
) -> Dark:
    """Measure what the camera reads with the cap on.

    Parameters
    ----------
    photo : path
        Photograph with the cap on, exposed as long as the painting's.
    out : path
        The calibration file to write, such as ``dark.json``.
    oecf : path, optional
        Calibration file of the camera's response.

    Returns
    -------
    Dark

    Raises
    ------
    CaptureError
        If the photograph cannot be read, or shows light.
    OutputError
        If the file cannot be written.
    """
    shot = read_shot(Path(photo))
    image = shot.linear(response_table(oecf, [shot])).astype(np.float64)
    raise_problems(CaptureError, _lit(shot, image))
    grid, _ = smooth_surface(image)
    raise_problems(CaptureError, _leak(shot, grid))
    middle = np.median(image, axis=(0, 1))
    noise = float(np.median(np.abs(image - middle)) / 0.6745) or float(image.std())
    hot = int((np.abs(image - middle) > max(_HOT * noise, _HOT_LEVEL)).any(axis=2).sum())
    level = tuple(float(value) for value in image.mean(axis=(0, 1)))
    write_calibration(
        Path(out),
        "dark",
        {"grid": np.round(grid, 8).tolist(), "level": level, "noise": noise, "hot_pixels": hot},
        subject=subject_of([shot], iso=True, size=True),
        made_from=[shot.provenance],
    )
    return Dark(Path(out), level, noise, hot)


def dark_grid(
    dark: str | PathLike[str] | None, shot: Shot, table: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return the level of no light on the grid of `surface`, from a photograph or a calibration file.

    Parameters
    ----------
    dark : path or None
        Without, the level is 0.
    shot : Shot
        A photograph that it is taken off.
    table : ndarray of shape (codes, C) or None
        The camera's response.

    Returns
    -------
    ndarray of shape (rows, columns, C)

    Raises
    ------
    CaptureError
        If it cannot be read, or is not for this photograph.
    """
    if dark is None:
        return np.zeros((*GRID, shot.photograph.channels))
    path = Path(dark)
    if path.suffix.lower() == ".json":
        calibration = read_calibration(path, "dark")
        problems = mismatches(path, calibration.subject, subject_of([shot], iso=True, size=True))
        raise_problems(CaptureError, problems)
        return np.array(calibration.content["grid"])
    capped = read_shot(path)
    if capped.layout != shot.layout:
        what = f"has {capped.layout}, expected {shot.layout} as {shot.path.name}"
        raise CaptureError(Problem(path.name, what, "Export both alike"))
    image = capped.linear(table)
    raise_problems(CaptureError, _lit(capped, image))
    grid, _ = smooth_surface(image)
    raise_problems(CaptureError, _leak(capped, grid))
    return grid


def dark_image(
    dark: str | PathLike[str] | None, shot: Shot, table: NDArray[np.float64] | None
) -> NDArray[np.float32]:
    """Return the same over the whole frame, ndarray of shape (H, W, C)."""
    photograph = shot.photograph
    return over_frame(dark_grid(dark, shot, table), photograph.height, photograph.width)


def _leak(shot: Shot, grid: NDArray[np.float64]) -> list[Problem]:
    """Return a problem if a part of the frame is lit."""
    above = (grid - np.median(grid, axis=(0, 1))).max(axis=2)
    if above.max() < _LIT:
        return []
    row, column = np.unravel_index(above.argmax(), above.shape)
    photograph = shot.photograph
    y = row * (photograph.height - 1) / (GRID[0] - 1)
    x = column * (photograph.width - 1) / (GRID[1] - 1)
    what = f"is brighter by {above.max():.1%} of full scale about column {x:.0f}, row {y:.0f}: light leaks in"
    return [
        Problem(shot.path.name, what, "Cover the viewfinder and the room, and photograph with the cap on")
    ]


def _lit(shot: Shot, image: NDArray[np.floating]) -> list[Problem]:
    level = float(image.mean())
    if level < _LIT:
        return []
    what = f"reads {level:.1%} of full scale, expected less than {_LIT:.0%}"
    return [Problem(shot.path.name, what, "Photograph with the cap on")]
