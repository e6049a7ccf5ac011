"""Read a capture: a folder of photographs and the file that says where the light stood for each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.capture import raw
from impasto.capture.exposure import relative_exposure
from impasto.capture.light_files import find_light_file, read_light_file
from impasto.capture.lights import LightFile, check_rows, make_lights
from impasto.capture.pairing import Pair, pair
from impasto.capture.photographs import (
    Photograph,
    find_photographs,
    read_photograph,
    without_previews,
)
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.geometry import Camera, Lights

__all__ = ["Capture", "Photograph", "read_capture"]

# Stored value from which on a sample is clipped. JPEG's ringing lets clipped areas read 254; the top per cent
# of 16 bits leaves room for a raw converter's rounding and white balance; floats say nothing about clipping.
CLIP_LEVEL = {"uint8": 254.0, "uint16": 0.99 * 65535, "float32": np.inf}


@dataclass(frozen=True)
class Capture:
    """A capture of which every header has been checked, and nothing decoded.

    Parameters
    ----------
    photographs : tuple of Photograph, length L
        In the order of the light file; all of one size, number of channels, type and transfer function.
    lights : Lights
        One per photograph, in the same order. `intensity` includes the photographs' relative exposures.
    camera : Camera
    light_file : Path
        The file that the lights were read from.
    notes : tuple of str
        What was assumed, left out or normalised, for the summary.
    clip_level : float
        Value, as stored in the photographs before any transfer function, from which on a sample is clipped;
        infinite where none is.
    noise : dict of str to float
        Overrides of the noise model's ``read``, ``photon`` and ``relative``; empty where none is given.
    brackets : tuple of Path
        Folders with further exposures of the same names that the light file knows of.
    """

    photographs: tuple[Photograph, ...]
    lights: Lights
    camera: Camera
    light_file: Path
    notes: tuple[str, ...]
    clip_level: float
    noise: dict[str, float]
    brackets: tuple[Path, ...] = ()


def read_capture(
    folder: str | PathLike[str],
    lights: str | PathLike[str] | None = None,
    exclude: Iterable[str] = (),
    *,
    half_size: bool = False,
) -> Capture:
    """Read the headers of a folder of photographs and their light file, and check that all fits together.

    Parameters
    ----------
    folder : path
        Folder of TIFF, EXR, PNG, JPEG or raw photographs; its subfolders are not looked at.
    lights : path, optional
        Light file: .lp, .csv, .toml, or .txt with a bare matrix. Found in the folder if it is the only one.
    exclude : iterable of str
        Names of photographs to leave out, with or without ending; ``*`` and ``?`` stand for any characters.
    half_size : bool
        Whether raw files are read at half size, one pixel per 2 x 2 photosites, which is faster.

    Returns
    -------
    Capture

    Raises
    ------
    CaptureError
        With everything that is wrong, if anything is.
    """
    folder = Path(folder)
    if not folder.is_dir():
        what = "is not a folder" if folder.exists() else "does not exist"
        raise CaptureError(Problem(str(folder), what, "Give the folder that holds the photographs"))
    problems: list[Problem] = []
    light_file = None
    try:
        light_file = read_light_file(_light_path(folder, lights))
        problems += light_file.problems
    except CaptureError as error:
        problems += error.problems
    paths, preview_notes = without_previews(find_photographs(folder))
    if not paths:
        problems.append(_no_photographs(folder))
    pairs: list[Pair] = []
    kept: Sequence[Path] = paths
    notes: list[str] = []
    if light_file and paths:
        pairs, kept, notes, pair_problems = pair(light_file, paths, list(exclude))
        problems += pair_problems
    if not kept and paths:
        problems.append(Problem(str(folder), "all photographs are left out", "Exclude fewer names"))
    photographs, header_notes, header_problems = _read_headers(
        kept, light_file.transfer if light_file else None
    )
    problems += header_problems
    if light_file:
        channels = Counter(photograph.channels for photograph in photographs.values())
        known = channels.most_common(1)[0][0] if channels else None
        row_problems, row_notes = check_rows(light_file.rows, known)
        problems += row_problems + _check_scale(light_file)
        notes = light_file.notes + row_notes + preview_notes + notes
    raise_problems(CaptureError, problems)
    assert light_file is not None
    rows = [row for row, _ in pairs]
    ordered = tuple(photographs[path] for _, path in pairs)
    exposure, exposure_notes, exposure_problems = relative_exposure(rows, ordered)
    raise_problems(CaptureError, exposure_problems)
    camera = light_file.camera
    if half_size:
        ordered, camera = _halved(ordered, camera)
    default_clip = CLIP_LEVEL[ordered[0].dtype.name]
    return Capture(
        photographs=ordered,
        lights=make_lights(rows, [photograph.name for photograph in ordered], exposure),
        camera=camera,
        light_file=light_file.path,
        notes=(*notes, *header_notes, *exposure_notes),
        clip_level=default_clip if light_file.clip_level is None else light_file.clip_level,
        noise=light_file.noise,
        brackets=tuple(light_file.path.parent / name for name in light_file.brackets),
    )


def _halved(photographs: Sequence[Photograph], camera: Camera) -> tuple[tuple[Photograph, ...], Camera]:
    """Return raw photographs as they are at half size, and the camera with pixels twice as large.

    Raises
    ------
    CaptureError
        If photographs are not raw files.
    """
    do = "Leave the option out"
    raise_problems(
        CaptureError,
        [
            Problem(photograph.path.name, "is no raw file, which alone can be read at half size", do)
            for photograph in photographs
            if photograph.path.suffix.lower() not in raw.ENDINGS
        ],
    )
    px = None if camera.mm_per_px is None else 2 * camera.mm_per_px
    halved = tuple(photograph.halved() for photograph in photographs)
    return halved, Camera(camera.view_direction, camera.distance_mm, px)


def _light_path(folder: Path, lights: str | PathLike[str] | None) -> Path:
    """Return the light file: the one named, there or in the folder, or else the only one in the folder."""
    if lights is None:
        return find_light_file(folder)
    inside = folder / lights
    return inside if inside.exists() and not Path(lights).exists() else Path(lights)


def _no_photographs(folder: Path) -> Problem:
    what = "holds no photographs, expected TIFF, EXR, PNG, JPEG or raw files"
    return Problem(str(folder), what, "Give the folder that holds them; subfolders are not looked at")


def _read_headers(
    paths: Sequence[Path], transfer: str | None
) -> tuple[dict[Path, Photograph], list[str], list[Problem]]:
    """Read all headers; return the photographs, notes shared between them, and all that is wrong."""
    photographs: dict[Path, Photograph] = {}
    problems: list[Problem] = []
    noted: dict[str, list[str]] = {}
    for path in paths:
        try:
            photographs[path], remarks = read_photograph(path, transfer)
        except CaptureError as error:
            problems += error.problems
            continue
        for remark in remarks:
            noted.setdefault(remark, []).append(path.name)
    problems += _disagreements(list(photographs.values()))
    notes = [f"{_whom(names, len(photographs))}: {remark}" for remark, names in noted.items()]
    return photographs, notes, problems


def _whom(names: Sequence[str], total: int) -> str:
    if len(names) == total:
        return f"all {total} photographs" if total > 1 else names[0]
    shown = ", ".join(names[:5]) + (", …" if len(names) > 5 else "")
    return f"{len(names)} of {total} photographs ({shown})"


def _disagreements(photographs: Sequence[Photograph]) -> list[Problem]:
    """Return one problem for each photograph that is not like most of the others."""

    def kind(photograph: Photograph) -> tuple[str, str]:
        size = f"{photograph.width} x {photograph.height} px"
        layout = (
            f"{photograph.channels} channel{'s' if photograph.channels > 1 else ''} of {photograph.dtype}"
        )
        return f"{size}, {layout}", photograph.transfer

    kinds = Counter(kind(photograph) for photograph in photographs)
    if len(kinds) < 2:
        return []
    (usual, usual_transfer), count = kinds.most_common(1)[0]
    problems = []
    for photograph in photographs:
        layout, transfer = kind(photograph)
        if layout != usual:
            what = f"has {layout}; {count} of {len(photographs)} photographs have {usual}"
            do = "Export all photographs alike, or leave it out with --exclude"
            problems.append(Problem(photograph.path.name, what, do))
        elif transfer != usual_transfer:
            what = f"is encoded as {transfer}; {count} of {len(photographs)} photographs as {usual_transfer}"
            do = "Export all photographs alike, or state transfer under [photographs] in a TOML light file"
            problems.append(Problem(photograph.path.name, what, do))
    return problems


def _check_scale(light_file: LightFile) -> list[Problem]:
    camera = light_file.camera
    if camera.mm_per_px is not None:
        return []
    near = sum(row.position_mm is not None for row in light_file.rows)
    needs = [f"{near} lights with position_mm"] if near else []
    needs += ["a camera with distance_mm"] if camera.distance_mm is not None else []
    if not needs:
        return []
    do = "Add mm_per_px, the size of a pixel on the painting, under [camera]"
    return [Problem(light_file.path.name, f"has {' and '.join(needs)}, but no mm_per_px", do)]
