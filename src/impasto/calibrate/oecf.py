"""Measure a camera's response from a photograph of a grey scale."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from impasto.calibrate.files import subject_of, write_calibration
from impasto.calibrate.patches import Array, Patches, read_parts, read_patches
from impasto.calibrate.response import Response, fit_response
from impasto.calibrate.response_plot import draw_response
from impasto.calibrate.shots import Shot, one_by_one, read_shot
from impasto.errors import CaptureError, Problem, raise_problems

# Share of a patch's samples that may be clipped, or black.
_CLIPPED = 1e-3
_BLACK = 0.02
_LEAST_PATCHES = 5
# Correlation of the logarithms of code and radiance that the patches of a grey scale reach at least.
_LEAST_CORRELATION = 0.8
# Share of full scale that the card reads at least.
_DIM = 0.02
# Residual of the best straight line below which a camera counts as linear.
_LINEAR = 0.01
# Patches whose radiance differs by less than this factor may trade places: tables are not that exact.
_ALIKE = 1.02
_LARGEST_ROUND = 60
_EVEN = 1e-5
_UNBENDING = 2


@dataclass(frozen=True)
class Oecf:
    """What `calibrate.oecf` found.

    Parameters
    ----------
    file, plot : Path
    response : Response
    linear : bool
        Whether the camera needs no such function.
    nonlinearity : float
        Largest relative residual of the best straight line through black, over all channels.
    residual : float
        Root mean square relative residual of the function itself.
    decades : float
        Range of radiance that was measured.
    noise : dict of str to float
        ``read``, ``photon`` and ``relative`` of the variance of relative radiance Y, read² + photon · Y +
        (relative · Y)².
    patches : int
        Patches used, over all photographs.
    notes : tuple of str
    """

    file: Path
    plot: Path
    response: Response
    linear: bool
    nonlinearity: float
    residual: float
    decades: float
    noise: dict[str, float]
    patches: int
    notes: tuple[str, ...]


def oecf(
    photos: str | PathLike[str] | Sequence[str | PathLike[str]],
    patches: str | PathLike[str],
    out: str | PathLike[str],
    *,
    card: str | PathLike[str] | None = None,
    dark: str | PathLike[str] | None = None,
    exposures_s: Sequence[float] = (),
    without: Iterable[str] = (),
) -> Oecf:
    """Measure how a camera's codes follow radiance, from photographs of a grey scale.

    Parameters
    ----------
    photos : path or sequence of path
        Photographs of the grey scale. Several of different exposure time extend the range.
    patches : path
        CSV with a row per patch: ``patch``, its box ``column0_px``, ``row0_px``, ``column1_px``, ``row1_px``,
        and ``reflectance`` or ``density``.
    out : path
        The calibration file to write, such as ``oecf.json``; a plot is written beside it.
    card : path, optional
        Photograph of an even card in the place of the grey scale, which tells how even the light is.
    dark : path, optional
        Photograph with the cap on, which tells the code of no light; 0 without.
    exposures_s : sequence of float, optional
        Exposure time of each photograph, where the files do not say it.
    without : iterable of str, optional
        Patches to leave out.

    Returns
    -------
    Oecf

    Raises
    ------
    CaptureError
        If photographs or the table cannot be used, if a patch is clipped or black in every photograph, or if
        codes do not rise with radiance, naming the patches.
    OutputError
        If a file cannot be written.

    References
    ----------
    [ISO14524]_
    """
    paths = [photos] if isinstance(photos, str | PathLike) else list(photos)
    target = read_patches(Path(patches), ("reflectance",), ("density",)).without(list(without))
    shots: list[Shot] = []
    parts: list[list[Shot]] = []
    problems: list[Problem] = []
    # One photograph at a time is in memory; of the others, the patches are kept.
    for shot in one_by_one(Path(path) for path in paths):
        if not shots:
            problems += _target_problems(shot, target)
        shots.append(shot.without_pixels)
        parts.append(_parts(shot, target))
    extra: list[Shot] = []
    even: list[Shot] | None = None
    if card is not None:
        shot = read_shot(Path(card))
        extra.append(shot.without_pixels)
        even = _parts(shot, target)
    black = np.zeros(shots[0].photograph.channels)
    if dark is not None:
        shot = read_shot(Path(dark))
        extra.append(shot.without_pixels)
        black = np.median(shot.codes, axis=(0, 1))
    problems += _differing(extra, shots[0])
    raise_problems(CaptureError, problems + _exposure_problems(shots, exposures_s))
    reflectance = target.known.get(
        "reflectance", 10 ** -target.known.get("density", np.zeros(len(target.names)))
    )
    exposure = _exposures(shots, exposures_s)
    readings = _readings(parts, target, reflectance, exposure)
    largest = float(np.iinfo(shots[0].codes.dtype).max)
    card_codes = None if even is None else read_parts([part.codes for part in even])[0]
    raise_problems(CaptureError, _reading_problems(readings, shots, extra, black, largest, card_codes))
    response, radiance = _fit(readings, black, largest, card_codes)
    # The mean of codes is not the code of the mean where noise meets a bent response.
    for _ in range(_UNBENDING):
        readings = _unbent(readings, response, parts)
        response, radiance = _fit(readings, black, largest, card_codes)
    _check_rising(readings, radiance, target)
    notes = _clipped_notes(readings, target)
    if card_codes is not None and (card_codes > response.measured[:, 1]).any():
        notes.append(
            "the card is brighter than the brightest patch, where the response is not known; expose it less"
        )
    scale = np.exp(np.mean(np.log(response(readings.code) / radiance), axis=0))
    residual = response(readings.code) / (radiance * scale) - 1
    nonlinearity = _nonlinearity(readings, radiance, black)
    linear = nonlinearity < _LINEAR
    if linear:
        notes.append(f"the camera is linear within {nonlinearity:.2%}: its photographs need no such function")
    noise = _noise(readings, response)
    file = Path(out)
    plot = file.with_suffix(".png")
    found = Oecf(
        file=file,
        plot=plot,
        response=response,
        linear=linear,
        nonlinearity=nonlinearity,
        residual=float(np.sqrt(np.mean(residual**2))),
        decades=float(np.log10(radiance.max() / radiance.min())),
        noise=noise,
        patches=len(readings.patch),
        notes=tuple(notes),
    )
    content = {
        "dtype": shots[0].codes.dtype.name,
        "response": response.as_json(),
        "linear": linear,
        "nonlinearity": nonlinearity,
        "residual": found.residual,
        "noise": noise,
        "patches": list(target.names),
        "boxes_px": [list(box) for box in target.boxes],
    }
    made_from = [*(shot.provenance for shot in shots + extra), target.source]
    write_calibration(file, "oecf", content, subject=subject_of(shots, iso=True), made_from=made_from)
    draw_response(plot, response, readings.code, radiance * scale, residual, readings.variance, noise)
    return found


@dataclass(frozen=True)
class _Readings:
    """Patches that are neither clipped nor black, over all photographs; shape (N,) or (N, C)."""

    patch: NDArray[np.intp]
    shot: NDArray[np.intp]
    radiance: Array
    code: Array
    sd: Array
    variance: Array
    unusable: dict[int, str]


def _fit(readings: _Readings, black: Array, largest: float, codes: Array | None) -> tuple[Response, Array]:
    """Return the response and the radiance of the patches read, shape (N, C).

    `codes`, of shape (P, C), are what the card reads in the patches' places.
    """
    radiance = np.repeat(readings.radiance[:, None], len(black), axis=1)
    if codes is None:
        return fit_response(readings.code, readings.sd, radiance, black, largest), radiance
    light = (codes - black) / (codes - black).mean(axis=0)
    # How even the light is can be told only once the response is known, and the other way round.
    for _ in range(_LARGEST_ROUND):
        response = fit_response(readings.code, readings.sd, radiance * light[readings.patch], black, largest)
        before, light = light, response(codes)
        light = light / light.mean(axis=0)
        if np.abs(light / before - 1).max() < _EVEN:
            break
    return response, radiance * light[readings.patch]


def _parts(shot: Shot, target: Patches) -> list[Shot]:
    """Return what a photograph shows of each patch."""
    return [shot.part(target.inner(row)) for row in range(len(target.names))]


def _target_problems(first: Shot, target: Patches) -> list[Problem]:
    problems = target.problems(*first.codes.shape[:2])
    if len(target.names) < _LEAST_PATCHES:
        what = f"holds {len(target.names)} patches, expected at least {_LEAST_PATCHES}"
        problems.append(Problem(target.source["file"], what, "Use a longer grey scale"))
    dark = np.flatnonzero(target.known.get("reflectance", np.ones(1)) <= 0)
    problems += [
        Problem(f"patch {target.names[row]}", "has a reflectance that is not above 0", "Correct the table")
        for row in dark
    ]
    if first.codes.dtype.kind == "f":
        do = "Photographs that hold floats need no such function"
        problems.append(Problem(first.path.name, "holds linear floats, expected codes of 8 or 16 bits", do))
    return problems


def _differing(shots: Sequence[Shot], first: Shot) -> list[Problem]:
    """Return a problem for each photograph that is not like the grey scale's."""
    expected = f"expected {first.layout} as the grey scale's photograph"
    return [
        Problem(shot.path.name, f"has {shot.layout}, {expected}", "Export both alike")
        for shot in shots
        if shot.layout != first.layout
    ]


def _exposure_problems(shots: Sequence[Shot], exposures_s: Sequence[float]) -> list[Problem]:
    if exposures_s and len(exposures_s) != len(shots):
        what = f"were given for {len(exposures_s)} of {len(shots)} photographs"
        return [Problem("--exposure-s", what, "Give one exposure time per photograph")]
    problems = [
        Problem(f"--exposure-s {time:g}", "is not above 0", "Give it in seconds")
        for time in exposures_s
        if not time > 0
    ]
    if exposures_s or len(shots) == 1:
        return problems
    return [
        Problem(shot.path.name, "does not say its exposure time", "Give it for each with --exposure-s")
        for shot in shots
        if shot.photograph.exposure_s is None
    ]


def _exposures(shots: Sequence[Shot], given: Sequence[float]) -> Array:
    if len(shots) == 1:
        return np.ones(1)
    told = [shot.photograph.exposure_s or 0.0 for shot in shots]
    times = np.array(given or told, np.float64)
    return np.asarray(times / times.max())


def _readings(
    parts: Sequence[Sequence[Shot]], target: Patches, reflectance: Array, exposure: Array
) -> _Readings:
    rows = []
    unusable: dict[int, str] = {}
    usable = set()
    for number, shown in enumerate(parts):
        mean, variance, pixels = read_parts([part.codes for part in shown])
        for patch, part in enumerate(shown):
            clipped = float(part.clipped.mean(axis=(0, 1)).max())
            black = float((part.codes == 0).mean(axis=(0, 1)).max())
            if clipped > _CLIPPED or black > _BLACK:
                how = f"clipped in {clipped:.1%}" if clipped > _CLIPPED else f"black in {black:.1%}"
                unusable[patch] = f"is {how} of its samples"
                continue
            usable.add(patch)
            sd = np.sqrt(variance[patch] / pixels[patch])
            radiance = reflectance[patch] * exposure[number]
            rows.append((patch, number, radiance, mean[patch], sd, variance[patch]))
    problems = []
    for patch in sorted(set(unusable) - usable):
        name, told = target.names[patch], unusable[patch]
        do = "Expose for less time" if "clipped" in told else "Expose for longer"
        do += f", add a photograph of another exposure, or leave it out with --without '{name}'"
        problems.append(Problem(f"patch {name}", told, do))
    raise_problems(CaptureError, problems)
    patches, numbers, radiances, codes, sds, variances = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    return _Readings(patches, numbers, radiances, codes, sds, variances, unusable)


def _unbent(readings: _Readings, response: Response, parts: Sequence[Sequence[Shot]]) -> _Readings:
    """Return the readings with the code of each patch's mean radiance instead of its mean code."""
    table = response.table(parts[0][0].codes.dtype)
    means = np.array([read_parts([part.linear(table) for part in shown])[0] for shown in parts])
    return replace(readings, code=response.codes(means[readings.shot, readings.patch]))


def _reading_problems(
    readings: _Readings,
    shots: Sequence[Shot],
    extra: Sequence[Shot],
    black: Array,
    largest: float,
    card: Array | None,
) -> list[Problem]:
    """Return what shows that a photograph is not what it is given as."""
    if (readings.code <= black).any():
        what = f"reads a code of {black.max():.0f}, and the darkest patch {readings.code.min():.0f}"
        return [Problem(extra[-1].path.name, what, "Photograph with the cap on, as long as the grey scale")]
    problems = []
    if card is not None and (card - black).min() < _DIM * largest:
        what = f"reads {(card - black).min() / largest:.1%} of full scale in a patch's place"
        what += f", expected more than {_DIM:.0%}"
        do = "Photograph an even card in the grey scale's place"
        problems.append(Problem(extra[0].path.name, what, do))
    for number, shot in enumerate(shots):
        of = readings.shot == number
        if np.count_nonzero(of) < _LEAST_PATCHES:
            continue
        rise = np.log(readings.radiance[of]), np.log((readings.code[of] - black).mean(axis=1))
        if np.ptp(rise[1]) == 0 or np.corrcoef(*rise)[0, 1] < _LEAST_CORRELATION:
            what = "shows patches that do not become brighter as the table has them"
            do = "Check the boxes, which way up the grey scale lies, and that the table is of this photograph"
            problems.append(Problem(shot.path.name, what, do))
    return problems


def _check_rising(readings: _Readings, radiance: Array, target: Patches) -> None:
    """Refuse codes that fall, or stay, where radiance rises, naming the patches.

    Raises
    ------
    CaptureError
        If there are any.
    """
    problems = {}
    for channel in range(radiance.shape[1]):
        order = np.argsort(radiance[:, channel])
        level, code = radiance[order, channel], readings.code[order, channel]
        above = np.searchsorted(level, _ALIKE * level)
        for low, high in enumerate(above[above < len(order)]):
            if code[high] <= code[low]:
                darker, brighter = (target.names[readings.patch[order[row]]] for row in (low, high))
                problems[brighter] = Problem(
                    f"patch {brighter}",
                    f"reads {code[high]:.0f}, not above the {code[low]:.0f} of the darker patch {darker}",
                    "Check the table and that the light is even (--card), or leave one out with --without",
                )
    raise_problems(CaptureError, problems.values())


def _clipped_notes(readings: _Readings, target: Patches) -> list[str]:
    if not readings.unusable:
        return []
    names = ", ".join(target.names[patch] for patch in sorted(readings.unusable))
    return [f"clipped or black in some photographs, and taken from the others: {names}"]


def _nonlinearity(readings: _Readings, radiance: Array, black: Array) -> float:
    above = readings.code - black
    weight = 1 / np.hypot(readings.sd / above, 1e-3)
    # A straight line through black is a constant ratio.
    ratio = np.log(above / radiance)
    line = (ratio * weight**2).sum(axis=0) / (weight**2).sum(axis=0)
    off = np.abs(np.expm1(ratio - line))
    sure = readings.sd / above < _LINEAR / 3
    return float(off[sure].max()) if sure.any() else float(off.max())


def _noise(readings: _Readings, response: Response) -> dict[str, float]:
    """Fit the photon transfer: variance of relative radiance against relative radiance."""
    level = response(readings.code)
    step = 0.5 + np.sqrt(readings.variance)
    slope = (response(readings.code + step) - response(np.maximum(readings.code - step, 0))) / (2 * step)
    variance = (readings.variance * slope**2).ravel()
    level = level.ravel()
    weight = 1 / np.maximum(variance, variance.max() * 1e-12)
    terms = np.column_stack([np.ones_like(level), level, level**2])
    found, _ = nnls(terms * weight[:, None], variance * weight)
    read2, photon, relative2 = (float(value) for value in found)
    return {"read": read2**0.5, "photon": photon, "relative": relative2**0.5}
