"""Photographs taken for a calibration: read as a whole, as linear relative radiance."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture import Photograph
from impasto.capture.photographs import READERS, find_photographs, read_photograph, without_previews
from impasto.colour import linearisation_table
from impasto.errors import CaptureError, Problem, raise_problems

Image = NDArray[np.float32]
Table = NDArray[np.float64]

# As in a capture: see impasto.capture.
_CLIP_LEVEL = {"uint8": 254, "uint16": int(0.99 * 65535)}

# Rows decoded, or made linear, at a time.
_SLAB_ROWS = 256


@dataclass(frozen=True)
class Shot:
    """One photograph of a calibration, decoded.

    Parameters
    ----------
    photograph : Photograph
    codes : ndarray of shape (H, W, C), uint8, uint16 or float32
        Values as the file holds them.
    """

    photograph: Photograph
    codes: NDArray[Any]

    @property
    def name(self) -> str:
        """The file name without its ending."""
        return self.photograph.name

    @property
    def path(self) -> Path:
        """The file."""
        return self.photograph.path

    @property
    def layout(self) -> str:
        """Size, channels and type in words."""
        photograph = self.photograph
        channels = f"{photograph.channels} channels of {photograph.dtype}"
        return f"{photograph.width} x {photograph.height} pixels, {channels}"

    @property
    def clipped(self) -> NDArray[np.bool_]:
        """Which samples are clipped, ndarray of shape (H, W, C)."""
        level = _CLIP_LEVEL.get(self.codes.dtype.name)
        return np.zeros(self.codes.shape, bool) if level is None else self.codes >= level

    def linear(self, table: Table | None = None) -> Image:
        """Return relative radiance, 1 for full scale, ndarray of shape (H, W, C).

        Parameters
        ----------
        table : ndarray of shape (codes, C), optional
            Relative radiance of every code, from a calibration of the camera's response; by default, what the
            file states or its type implies.
        """
        if self.codes.dtype.kind == "f":
            return np.asarray(self.codes, np.float32)
        if table is None:
            photograph = self.photograph
            table = linearisation_table(photograph.transfer, photograph.dtype, photograph.icc_profile)
        if table.ndim == 1:
            return np.asarray(table.astype(np.float32)[self.codes])
        channels = [table[:, c].astype(np.float32)[self.codes[..., c]] for c in range(self.codes.shape[2])]
        return np.stack(channels, axis=-1)

    def luminance(self) -> Image:
        """Return the mean over the channels of relative radiance, ndarray of shape (H, W)."""
        out = np.empty(self.codes.shape[:2], np.float32)
        for row in range(0, len(out), _SLAB_ROWS):
            slab = slice(row, row + _SLAB_ROWS)
            out[slab] = replace(self, codes=self.codes[slab]).linear().mean(axis=2)
        return out

    def part(self, where: tuple[slice, slice]) -> Shot:
        """Return the same with a copy of some rows and columns alone, so that the rest can be forgotten."""
        return replace(self, codes=self.codes[where].copy())

    @property
    def without_pixels(self) -> Shot:
        """The same without what takes memory."""
        return self.part((slice(0), slice(None)))

    @property
    def provenance(self) -> dict[str, Any]:
        """What a calibration file says about it."""
        photograph = self.photograph
        return {
            "file": self.path.name,
            "sha256": _sha256(self.path),
            "exposure_s": photograph.exposure_s,
        }


def read_shot(path: Path) -> Shot:
    """Read and decode one photograph.

    Raises
    ------
    CaptureError
        If it is not there, or cannot be read.
    """
    if not path.is_file():
        raise CaptureError(Problem(str(path), "is not a file", "Give the name of a photograph"))
    if path.suffix.lower() not in READERS:
        what = f"ends in '{path.suffix}', expected a TIFF, EXR, PNG, JPEG or raw file"
        raise CaptureError(Problem(str(path), what, "Give the name of a photograph"))
    photograph, _ = read_photograph(path)
    codes = np.empty((photograph.height, photograph.width, photograph.channels), photograph.dtype)
    for row, band in photograph.bands(_SLAB_ROWS):
        codes[row : row + len(band)] = band
    return Shot(photograph, codes)


def read_shots(paths: Iterable[Path]) -> list[Shot]:
    """Read photographs that belong together.

    Raises
    ------
    CaptureError
        Listing all that cannot be read, or that differ in size from the first.
    """
    return list(one_by_one(paths))


def one_by_one(paths: Iterable[Path]) -> Iterator[Shot]:
    """Read photographs that belong together, so that one at a time need be in memory.

    Raises
    ------
    CaptureError
        After the last, listing all that cannot be read, or that differ in size from the first.
    """
    problems: list[Problem] = []
    first: Shot | None = None
    for path in paths:
        try:
            shot = read_shot(path)
        except CaptureError as error:
            problems += error.problems
            continue
        first = first or shot.without_pixels
        if shot.layout == first.layout:
            yield shot
            continue
        what = f"has {shot.layout}, expected {first.layout} as {first.path.name}"
        problems.append(Problem(path.name, what, "Export all of them alike, or leave it out"))
    raise_problems(CaptureError, problems)


def photographs_in(folder: Path, exclude: Iterable[str] = ()) -> list[Path]:
    """Return the photographs in a folder, in natural order, or the one that `folder` itself is.

    Parameters
    ----------
    folder : Path
    exclude : iterable of str
        Names to leave out, with or without ending.

    Raises
    ------
    CaptureError
        If there are none, or a name to leave out is not there.
    """
    if folder.is_file():
        return [folder]
    if not folder.is_dir():
        raise CaptureError(Problem(str(folder), "does not exist", "Give the folder of the photographs"))
    found, _ = without_previews(find_photographs(folder))
    out = set(exclude)
    names = {name for path in found for name in (path.name, path.stem)}
    problems = [
        Problem(f"--exclude {name}", f"is no photograph in {folder}", "Correct the name")
        for name in sorted(out - names)
    ]
    kept = [path for path in found if path.name not in out and path.stem not in out]
    if not kept and not problems:
        problems.append(Problem(str(folder), "holds no photographs", "Give the folder of the photographs"))
    raise_problems(CaptureError, problems)
    return kept


def box_mean(image: NDArray[Any], box: Sequence[int]) -> NDArray[np.float64]:
    """Return the mean per channel over a box: first column, first row, end column, end row."""
    left, top, right, bottom = box
    return np.asarray(image[top:bottom, left:right].mean(axis=(0, 1), dtype=np.float64))


def box_problems(box: Sequence[int], shape: Sequence[int], where: str) -> list[Problem]:
    """Return what is wrong with a box for an image of a shape (H, W, …)."""
    left, top, right, bottom = box
    if 0 <= left < right <= shape[1] and 0 <= top < bottom <= shape[0]:
        return []
    what = f"is no box in an image of {shape[1]} x {shape[0]} pixels"
    return [Problem(where, what, "Give first column, first row, end column and end row in pixels")]


def common(shots: Sequence[Shot], what: Callable[[Photograph], Any]) -> Any:
    """Return what all the photographs say, None if they do not all say the same."""
    said = {what(shot.photograph) for shot in shots}
    return said.pop() if len(said) == 1 else None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
