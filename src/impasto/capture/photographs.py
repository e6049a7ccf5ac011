"""Photographs: find them in a folder, read their headers, and decode them in bands of rows."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import icc
from impasto.capture import raster, raw, tiff
from impasto.capture.header import Header, UnreadableError
from impasto.colour import linearisation_table
from impasto.errors import CaptureError, OptionError, Problem

READERS = {
    **dict.fromkeys((".tif", ".tiff"), tiff),
    **dict.fromkeys((".exr", ".png", ".jpg", ".jpeg"), raster),
    **dict.fromkeys(raw.ENDINGS, raw),
}
_STATE_TRANSFER = 'State transfer = "srgb" (or "linear", or a gamma) under [photographs] in a TOML light file'


@dataclass(frozen=True, kw_only=True)
class Photograph(Header):
    """One photograph of which the header has been read, and nothing decoded.

    Parameters
    ----------
    path : Path
        The file.
    transfer : str
        How its values become linear: ``linear``, ``srgb``, ``gamma:<number>`` or ``icc:<profile's name>``;
        `impasto.colour.linearisation_table` makes the table from it and `icc_profile`.
    """

    path: Path
    transfer: str

    @property
    def name(self) -> str:
        """The file name without its ending."""
        return self.path.stem

    def halved(self) -> Photograph:
        """Return the same raw file, to be read at half size."""
        header = raw.half_size(self)
        assert isinstance(header, Photograph)  # of the class that it was made from
        return header

    def bands(self, rows: int) -> Iterator[tuple[int, NDArray[Any]]]:
        """Decode the photograph from top to bottom, in bands of `rows` rows.

        Parameters
        ----------
        rows : int
            Rows per band, at least 1. What one band costs in memory is the larger of `rows` and `unit_rows`
            rows; large bands are decoded as fast as a whole file.

        Yields
        ------
        row0 : int
            First row of the band.
        band : ndarray of shape (rows, W, C), uint8, uint16 or float32
            Values as stored in the file; the last band may be lower.

        Raises
        ------
        CaptureError
            If the file is damaged or cut off.
        """
        try:
            yield from READERS[self.path.suffix.lower()].bands(self.path, self, rows)
        except UnreadableError as error:
            raise CaptureError(_unreadable(self.path, error)) from error
        except OSError as error:
            raise CaptureError(_unreadable(self.path, UnreadableError(f"cannot be read: {error}"))) from error


def find_photographs(folder: Path) -> list[Path]:
    """Return the photographs in a folder, in the natural order of their names.

    Subfolders (calibration shots lie there) and hidden files are not looked at.
    """
    return sorted(
        (
            path
            for path in folder.iterdir()
            if path.suffix.lower() in READERS and not path.name.startswith(".") and path.is_file()
        ),
        key=lambda path: natural_key(path.name),
    )


def without_previews(paths: list[Path]) -> tuple[list[Path], list[str]]:
    """Leave out the JPEG files that a camera wrote beside its raw files, and say so.

    Returns
    -------
    paths : list of Path
    notes : list of str
    """
    raws = {path.stem for path in paths if path.suffix.lower() in raw.ENDINGS}
    kept = [path for path in paths if path.stem not in raws or path.suffix.lower() not in (".jpg", ".jpeg")]
    left = len(paths) - len(kept)
    if not left:
        return kept, []
    return kept, [f"{left} JPEG file{'s' if left > 1 else ''} beside raw files of the same name left out"]


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Return a sort key that puts image2 before image10, whatever the case of the letters."""
    parts = re.split(r"(\d+)", unicodedata.normalize("NFC", name).casefold())
    return [int(part) if part.isdecimal() else part for part in parts], name


def read_photograph(path: Path, transfer: str | None = None) -> tuple[Photograph, list[str]]:
    """Read the header of a photograph and settle how its values become linear.

    Parameters
    ----------
    path : Path
    transfer : str, optional
        Transfer function that overrides what the file says.

    Returns
    -------
    photograph : Photograph
    notes : list of str
        What was assumed or left out, in words that are the same for all files that share it.

    Raises
    ------
    CaptureError
        If the file is damaged, cut off, of a kind that is not a photograph, or if its profile cannot be
        decoded by one curve per channel.
    """
    try:
        header = READERS[path.suffix.lower()].read_header(path)
    except UnreadableError as error:
        raise CaptureError(_unreadable(path, error)) from error
    except OSError as error:
        raise CaptureError(_unreadable(path, UnreadableError(f"cannot be read: {error}"))) from error
    try:
        name, reason = (transfer, "as the light file states") if transfer else _settle_transfer(header)
        if header.dtype == np.float32:
            if name != "linear":
                raise OptionError(
                    Problem(f"transfer function {name}", "is stated for float values", "Floats are linear")
                )
        else:
            table = linearisation_table(name, header.dtype, header.icc_profile)
            if table.ndim == 2 and table.shape[1] != header.channels:
                raise OptionError(
                    Problem(
                        f"transfer function {name}",
                        f"has curves for {table.shape[1]} channels, the photograph has {header.channels}",
                        _STATE_TRANSFER,
                    )
                )
    except (OptionError, ValueError) as error:
        raise CaptureError(_bad_transfer(path, error)) from error
    notes = [reason and f"decoded as {name} ({reason})", *header.remarks]
    if header.orientation != 1:
        # A camera that looks straight down sets this flag at random, so only the pixels as stored are sure to
        # lie on each other.
        notes.append(
            f"marked as turned (EXIF orientation {header.orientation}) and read as stored, without turning"
        )
    return Photograph(path=path, transfer=name, **vars(header)), [note for note in notes if note]


def _settle_transfer(header: Header) -> tuple[str, str]:
    """Return the name of the transfer function, and why it is assumed where the file does not say."""
    bits = 8 * header.dtype.itemsize
    if header.dtype == np.float32:
        return "linear", ""
    if header.icc_profile is not None:
        return f"icc:{icc.description(header.icc_profile)}", "by the embedded profile"
    if header.declared_transfer is not None:
        return header.declared_transfer, "as the file states"
    if bits == 8:
        return "srgb", "8 bits without a profile: assumed"
    return "linear", "16 bits without a profile: assumed"


def _unreadable(path: Path, error: UnreadableError) -> Problem:
    return Problem(where=path.name, what=error.what, do=error.do)


def _bad_transfer(path: Path, error: OptionError | ValueError) -> Problem:
    if isinstance(error, OptionError):
        problem = error.problems[0]
        return Problem(where=path.name, what=f"{problem.where} {problem.what}", do=problem.do)
    return Problem(
        where=path.name,
        what=f"embedded ICC profile cannot be used: {error}",
        do=_STATE_TRANSFER,
    )
