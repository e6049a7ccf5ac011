"""Merge several exposures of one light into one radiance."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture import Capture, Photograph
from impasto.capture.light_files import find_light_file, read_light_file
from impasto.capture.photographs import find_photographs, read_photograph, without_previews
from impasto.errors import CaptureError, Problem, raise_problems

# Samples between these shares of full scale say what the ratio of two exposures is.
_FROM, _TO = 0.02, 0.9
_SAMPLES = 200_000
_LEAST_SAMPLES = 300
# A ratio that the photographs contradict by more than the first is worth a word, by more than the second an
# error: a shutter is not that far from its nominal times.
_NOTE, _WRONG = 0.02, 0.12
# Mantissa bits that are rounded away: the step is 0.05 %, below any sensor's noise.
_ROUNDED_BITS = 12


@dataclass(frozen=True)
class Exposure:
    """One of the exposures of a light.

    Parameters
    ----------
    photograph : Photograph
    time : float
        Exposure relative to that of the photograph in the capture itself.
    """

    photograph: Photograph
    time: float


def read_brackets(capture: Capture, folders: Iterable[str | PathLike[str]]) -> list[list[Exposure]]:
    """Read the headers of further exposures, which lie in folders and have the names of the photographs.

    Parameters
    ----------
    capture : Capture
    folders : iterable of path
        Exposure times come from the light file in each, if there is one, or from the EXIF data.

    Returns
    -------
    list of list of Exposure
        Per light, its own photograph first.

    Raises
    ------
    CaptureError
        Listing every photograph that is missing, differs in size, or whose exposure time nobody knows.
    """
    problems: list[Problem] = []
    own = _times(capture.light_file.parent, capture.light_file)
    lights = [[Exposure(photograph, 1.0)] for photograph in capture.photographs]
    for folder in map(Path, folders):
        if not folder.is_dir():
            problems.append(Problem(str(folder), "is not a folder", "Give the folder of further exposures"))
            continue
        if folder.resolve() == capture.photographs[0].path.parent.resolve():
            do = "Give the folder of further exposures, or leave the option out"
            problems.append(Problem(str(folder), "holds the photographs themselves", do))
            continue
        found = {path.stem: path for path in without_previews(find_photographs(folder))[0]}
        times = _times(folder, None)
        for exposures in lights:
            first = exposures[0].photograph
            if first.name not in found:
                problems.append(Problem(str(folder), f"holds no exposure of {first.name}", "Add it"))
                continue
            photograph, _ = read_photograph(found[first.name], first.transfer)
            photograph = photograph.halved() if first.half_size else photograph
            where = f"{folder.name}/{photograph.path.name}"
            layout = (photograph.height, photograph.width, photograph.channels, photograph.dtype)
            if layout != (first.height, first.width, first.channels, first.dtype):
                problems.append(
                    Problem(where, f"has another size or type than {first.path.name}", "Export both alike")
                )
            long, short = _exposure(first, own), _exposure(photograph, times)
            if long is None or short is None:
                do = "Give exposure_s in a light file beside the photographs, or restore the EXIF data"
                problems.append(Problem(where, "has no exposure time, or its long exposure has none", do))
                continue
            exposures.append(Exposure(photograph, short / long))
    raise_problems(CaptureError, problems)
    return lights


def _times(folder: Path, light_file: Path | None) -> Mapping[str, float]:
    """Return the exposure times that a light file states, by the photographs' names."""
    try:
        file = read_light_file(light_file or find_light_file(folder))
    except CaptureError:
        return {}
    return {Path(row.file).stem: row.exposure_s for row in file.rows if row.file and row.exposure_s}


def _exposure(photograph: Photograph, times: Mapping[str, float]) -> float | None:
    """Return time x ISO / f-number² of a photograph, None where the time is unknown."""
    time = times.get(photograph.name) or photograph.exposure_s
    if not time:
        return None
    return time * (photograph.iso or 1.0) / (photograph.f_number or 1.0) ** 2


def check_times(
    exposures: Sequence[Exposure], levels: Sequence[NDArray[np.float32]]
) -> tuple[list[float], list[str]]:
    """Compare exposure times with what the photographs show.

    Parameters
    ----------
    exposures : sequence of Exposure
    levels : sequence of ndarray
        A sample of each exposure's relative radiance, of the same pixels, infinite where clipped.

    Returns
    -------
    times : list of float
        Relative exposures: as the photographs show them, where enough of their samples are well exposed in
        two, and else as stated.
    notes : list of str

    Raises
    ------
    CaptureError
        Naming exposures whose stated time the photographs contradict.
    """
    order = sorted(range(len(exposures)), key=lambda number: -exposures[number].time)
    stated = [exposure.time for exposure in exposures]
    times = list(stated)
    notes, problems = [], []
    for longer, shorter in pairwise(order):
        nominal = stated[shorter] / stated[longer]
        a, b = levels[longer].ravel(), levels[shorter].ravel()
        both = (a > _FROM) & (a < _TO) & (b > _FROM * min(1.0, nominal)) & (b < _TO)
        times[shorter] = times[longer] * nominal
        if np.count_nonzero(both) < _LEAST_SAMPLES:
            continue
        seen = float(b[both].sum(dtype=np.float64) / a[both].sum(dtype=np.float64))
        off = seen / nominal - 1
        name, other = (_where(exposures[one].photograph) for one in (shorter, longer))
        if abs(off) > _WRONG:
            what = (
                f"is stated to be exposed {nominal:.4g} times as long as {other}; its pixels say {seen:.4g}"
            )
            do = "Correct exposure_s in the light file of one of them, or take the photograph again"
            problems.append(Problem(name, what, do))
        elif abs(off) > _NOTE:
            notes.append(f"{name} is exposed {off:+.1%} from its stated time; its pixels were followed")
        times[shorter] = times[longer] * seen
    raise_problems(CaptureError, problems)
    return [time / times[0] for time in times], notes


def merge(
    radiance: Sequence[NDArray[np.float32]], times: Sequence[float], read: float, photon: float
) -> NDArray[np.float32]:
    """Merge exposures of the same pixels, weighted by their noise.

    Parameters
    ----------
    radiance : sequence of ndarray of shape (rows, W, C)
        Relative radiance as each exposure shows it, infinite where it is clipped.
    times : sequence of float
        Relative exposures.
    read, photon : float
        Noise of an exposure: variance = read² + photon · Y.

    Returns
    -------
    ndarray of shape (rows, W, C), float32
        Relative radiance of an exposure of time 1; infinite where all are clipped.

    References
    ----------
    [Granados2010]_, section 3: the weights of least variance.
    """
    total = np.zeros(radiance[0].shape, np.float32)
    weights = np.zeros(radiance[0].shape, np.float32)
    for level, time in zip(radiance, times, strict=True):
        usable = np.isfinite(level)
        level = np.where(usable, level, 0)
        variance = np.float32(read**2 + 1e-12) + np.float32(photon) * np.maximum(level, 0)
        weight = np.float32(time**2) / variance
        weight = np.where(usable, weight, 0)
        total += weight * (level / np.float32(time))
        weights += weight
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(weights > 0, _rounded(total / weights), np.float32(np.inf))


def merged_noise(noise: dict[str, float], times: Sequence[float]) -> dict[str, float]:
    """Return the noise model of merged exposures.

    Notes
    -----
    Near black it is the longest exposure's. Above, each radiance is at worst just clipped in the next longer
    one, where its photon noise is that of full scale over the ratio of the two: a relative noise of
    √(photon · ratio), which is counted for all.
    """
    ordered = sorted(times, reverse=True)
    ratio = max((a / b for a, b in pairwise(ordered)), default=1.0)
    relative = float(np.hypot(noise["relative"], np.sqrt(noise["photon"] * ratio)))
    return {"read": noise["read"] / ordered[0], "photon": noise["photon"] / ordered[0], "relative": relative}


def sample(bands: Sequence[NDArray[Any]]) -> slice:
    """Return the step at which the pixels of a photograph are sampled for `check_times`, as a slice."""
    pixels = sum(band.shape[0] * band.shape[1] for band in bands)
    return slice(None, None, max(1, round((pixels / _SAMPLES) ** 0.5)))


def _rounded(values: NDArray[np.float32]) -> NDArray[np.float32]:
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    half = np.uint32(1 << (_ROUNDED_BITS - 1))
    return ((bits + half) & ~np.uint32((1 << _ROUNDED_BITS) - 1)).view(np.float32)


def _where(photograph: Photograph) -> str:
    return f"{photograph.path.parent.name}/{photograph.path.name}"
