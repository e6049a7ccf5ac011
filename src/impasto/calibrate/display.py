"""Fit a model of a display to measured colours."""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares, minimize

from impasto.calibrate.colour_fit import ciede2000, lab
from impasto.calibrate.files import read_calibration, write_calibration
from impasto.calibrate.patches import Array
from impasto.colour.displays import AdditiveDisplay, GainOffsetGamma, LookUpTables
from impasto.errors import CaptureError, OptionError, Problem, raise_problems

MODELS = ("gain-offset-gamma", "tables")
_LEAST_COLOURS = 12
_COLUMNS = ("R", "G", "B", "X", "Y", "Z")
_TABLE_NODES = 256
# Colours of one primary alone, on which its curve is built, at least this many of each.
_LEAST_RAMP = 4


@dataclass(frozen=True)
class DisplayCalibration:
    """What `calibrate.display` found.

    Parameters
    ----------
    file : Path
    display : AdditiveDisplay
    model : str
    difference : ndarray of shape (N,)
        CIEDE2000 between the model and each colour measured.
    """

    file: Path
    display: AdditiveDisplay
    model: str
    difference: Array


def display(
    measured: str | PathLike[str],
    out: str | PathLike[str],
    *,
    model: str = "tables",
    name: str | None = None,
) -> DisplayCalibration:
    """Fit a display's model to measured colours.

    Parameters
    ----------
    measured : path
        CSV with a row per colour: the drive ``R``, ``G``, ``B`` (0 to 255, or 0 to 1), and what was measured,
        ``X``, ``Y``, ``Z``, in any unit. With black, white, ramps of each primary, and greys or mixtures.
    out : path
        The calibration file to write, such as ``display.json``.
    model : {'tables', 'gain-offset-gamma'}
        A table per primary and a matrix of 3 x 4 with the light at black [Day2004]_, or a gain, an offset
        and a gamma per primary [Berns1996]_ and the same matrix.
    name : str, optional
        What summaries call the display; the file's name by default.

    Returns
    -------
    DisplayCalibration

    Raises
    ------
    CaptureError
        If the table cannot be used.
    OptionError
        If the model is not known.
    OutputError
        If the file cannot be written.

    Notes
    -----
    The matrix and the light at black are those of least mean CIEDE2000 over all colours; XYZ is relative to
    the display's white.
    """
    if model not in MODELS:
        raise OptionError(Problem(f"--model {model}", "is not known", f"Choose {' or '.join(MODELS)}"))
    path = Path(measured)
    drive, xyz, sha256 = _read(path)
    whites = xyz[(drive > 0.999).all(axis=1)]
    white = whites.mean(axis=0)
    xyz = xyz / white[1]
    start = _start(drive, xyz, white / white[1], model, name or path.stem)
    fitted = _optimise(start, drive, xyz, white / white[1])
    difference = ciede2000(fitted.decode(drive), xyz, white / white[1])
    content = {
        "name": fitted.name,
        "model": model,
        "matrix": fitted.matrix.tolist(),
        "black": fitted.black.tolist(),
        "curves": {key: np.asarray(value).tolist() for key, value in vars(fitted.curves).items()},
        "ciede2000": difference.tolist(),
    }
    write_calibration(Path(out), "display", content, made_from=[{"file": path.name, "sha256": sha256}])
    return DisplayCalibration(Path(out), fitted, model, difference)


def read_display(path: Path) -> AdditiveDisplay:
    """Return the display of a calibration file.

    Raises
    ------
    CaptureError
        If it is none.
    """
    content = read_calibration(path, "display").content
    kind = GainOffsetGamma if content["model"] == "gain-offset-gamma" else LookUpTables
    curves = kind(**{key: np.array(value, np.float64) for key, value in content["curves"].items()})
    return AdditiveDisplay(content["name"], np.array(content["matrix"]), np.array(content["black"]), curves)


def _read(path: Path) -> tuple[Array, Array, str]:
    try:
        data = path.read_bytes()
        rows = list(csv.DictReader(data.decode("utf-8-sig").splitlines()))
        values = np.array([[float(row[column]) for column in _COLUMNS] for row in rows])
    except OSError as error:
        raise CaptureError(
            Problem(str(path), f"cannot be read: {error.strerror}", "Correct its name")
        ) from error
    except (KeyError, TypeError, ValueError) as error:
        what = f"cannot be used: {error}"
        raise CaptureError(Problem(path.name, what, "Write columns R,G,B,X,Y,Z of numbers")) from error
    problems = []
    if len(values) < _LEAST_COLOURS:
        what = f"holds {len(values)} colours, expected at least {_LEAST_COLOURS}"
        problems.append(Problem(path.name, what, "Measure black, white, ramps of each primary, and mixtures"))
        raise CaptureError(problems)
    drive, xyz = values[:, :3], values[:, 3:]
    if drive.max() > 1:
        drive = drive / (255 if drive.max() <= 255 else 65535)
    if drive.min() < 0 or not (drive > 0.999).all(axis=1).any() or not (drive < 1e-3).all(axis=1).any():
        what = "lacks white or black: all of R, G, B at their largest, and all at 0"
        problems.append(Problem(path.name, what, "Measure both"))
    for primary in range(3):
        alone = np.delete(drive, primary, axis=1).max(axis=1) < 1e-3
        if np.unique(drive[alone, primary]).size < _LEAST_RAMP or not (drive[alone, primary] > 0.999).any():
            what = f"holds fewer than {_LEAST_RAMP} colours of {'RGB'[primary]} alone, up to its largest"
            problems.append(Problem(path.name, what, "Measure a ramp of each primary"))
    raise_problems(CaptureError, problems)
    return drive, xyz, hashlib.sha256(data).hexdigest()


def _start(drive: Array, xyz: Array, white: Array, model: str, name: str) -> AdditiveDisplay:
    """Return a display with the curves of the ramps, and the matrix of the primaries at full drive."""
    black = xyz[(drive < 1e-3).all(axis=1)].mean(axis=0)
    columns, tables = [], []
    at = np.linspace(0, 1, _TABLE_NODES)
    ramps = []
    for primary in range(3):
        alone = np.delete(drive, primary, axis=1).max(axis=1) < 1e-3
        levels = np.unique(drive[alone, primary])
        light = np.array(
            [(xyz[alone & (drive[:, primary] == level)] - black).mean(axis=0) for level in levels]
        )
        full = light[-1]
        # How far along the primary's own direction a colour lies, whatever the noise across it.
        share = np.maximum.accumulate(np.clip(light @ full / (full @ full), 0, None))
        if levels[0] > 0:
            levels, share = np.append(0.0, levels), np.append(0.0, share)
        share[0] = 0.0
        ramps.append((levels, share))
        tables.append(np.clip(PchipInterpolator(levels, share)(at), 0, 1))
        columns.append(full)
    matrix = np.column_stack(columns)
    if model == "tables":
        return AdditiveDisplay(name, matrix, black, LookUpTables(at, np.array(tables)))
    parameters = []
    for levels, share in ramps:

        def off(values: Array, levels: Array = levels, share: Array = share) -> Array:
            base = np.maximum(values[0] * levels + 1 - values[0], 0)
            return np.asarray(np.cbrt(base ** values[1]) - np.cbrt(share))

        gain, gamma = least_squares(off, [1.0, 2.2], bounds=([0.5, 0.5], [2.0, 5.0])).x
        parameters.append((gain, 1 - gain, gamma))
    gains, offsets, gammas = np.array(parameters).T
    return AdditiveDisplay(name, matrix, black, GainOffsetGamma(gains, offsets, gammas))


def _optimise(start: AdditiveDisplay, drive: Array, xyz: Array, white: Array) -> AdditiveDisplay:
    """Return the display with matrix, black and, where they are numbers, curves of least mean CIEDE2000."""

    def build(values: Array) -> AdditiveDisplay:
        curves = start.curves
        if isinstance(start.curves, GainOffsetGamma):
            gain, gamma = values[12:15], values[15:18]
            curves = GainOffsetGamma(gain, 1 - gain, gamma)
        return AdditiveDisplay(start.name, values[:9].reshape(3, 3), values[9:12], curves)

    first = np.concatenate([start.matrix.ravel(), start.black])
    if isinstance(start.curves, GainOffsetGamma):
        first = np.concatenate([first, start.curves.gain, start.curves.gamma])
    wanted = lab(xyz, white)
    near = least_squares(
        lambda values: (lab(np.maximum(build(values).decode(drive), 0), white) - wanted).ravel(), first
    ).x

    def mean(values: Array) -> float:
        shown = np.maximum(build(values).decode(drive), 0)
        return float(ciede2000(shown, xyz, white).mean())

    best = min((first, near), key=mean)
    fine = minimize(mean, best, method="Powell", options={"maxiter": 2, "xtol": 1e-4, "ftol": 1e-5})
    chosen = np.asarray(fine.x) if fine.fun < mean(best) else best
    return build(chosen)
