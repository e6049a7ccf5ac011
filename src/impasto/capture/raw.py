"""Read raw files through LibRaw: linear, in the camera's own colours, without white balance.

Black levels are subtracted per channel and the white level becomes 65535. The mosaic is interpolated
linearly, so that each value is a weighted mean of photosites of its colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.header import Header, UnreadableError
from impasto.capture.mosaic import interpolate

if TYPE_CHECKING:
    from rawpy import RawPy

ENDINGS = (
    ".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dcr", ".dng", ".erf", ".fff", ".iiq", ".kdc", ".mef", ".mos",
    ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".raw", ".rw2", ".srw", ".x3f",
)  # fmt: skip

_WHITE = 65535

# LibRaw works on the mosaic (2 bytes per photosite), on four colours (8) and on the result (6), which is
# three times the result in all.
_WORKING_HEIGHTS = 3

# EXIF's orientation for LibRaw's `flip`.
_ORIENTATION = {0: 1, 3: 3, 5: 8, 6: 6}

_COLOURS = b"RGBG"
_SECOND_GREEN = 3

# Looked through for saturated photosites at a time: few enough rows to stay in the processor's cache.
_SLAB_ROWS = 64


def read_header(path: Path) -> Header:
    """Read the header of a raw file.

    Raises
    ------
    UnreadableError
        If LibRaw does not know the file, or its sensor is none of red, green and blue photosites.
    """
    with _open(path) as raw:
        if raw.color_desc != _COLOURS or raw.num_colors != 3:
            raise _no_mosaic(f"{raw.num_colors} colours ({raw.color_desc.decode('ascii', 'replace')})")
        # LibRaw's own notes of exposure and lens would decode the whole file.
        sizes, exif = raw.sizes, _exif(path)
        return Header(
            height=sizes.height,
            width=sizes.width,
            channels=3,
            dtype=np.dtype(np.uint16),
            unit_rows=_WORKING_HEIGHTS * sizes.height,
            declared_transfer="linear",
            exposure_s=_number(exif, "ExposureTime"),
            f_number=_number(exif, "FNumber"),
            iso=_number(exif, "ISOSpeedRatings"),
            orientation=_ORIENTATION.get(sizes.flip, 1),
            camera=" ".join(filter(None, (_text(exif, "Make"), _text(exif, "Model")))) or None,
            lens=_text(exif, "LensModel"),
            taken=_text(exif, "DateTimeOriginal"),
        )


def bands(path: Path, header: Header, rows: int) -> Iterator[tuple[int, NDArray[Any]]]:
    """Decode a raw file, which LibRaw does as a whole, and yield it from top to bottom.

    A sample is clipped, and reads 65535, if a photosite that it is interpolated from is.

    Parameters
    ----------
    path : Path
    header : Header
        As `read_header` gave it.
    rows : int
        Rows per band.

    Yields
    ------
    row0 : int
        First row of the band.
    band : ndarray of shape (rows, W, 3), uint16
        The last band may be lower.

    Raises
    ------
    UnreadableError
        If the pixels are damaged or cut off.
    """
    import rawpy

    with _open(path) as raw:
        try:
            if raw.raw_pattern is None:
                raise _no_mosaic("pixels without a mosaic")
            saturated = _saturated(raw, header.half_size)
            developed, pattern = _develop(raw, header.half_size)
        except rawpy.LibRawError as error:
            raise UnreadableError(f"cannot be decoded: {_reason(error)}") from error
    height, width = (side * (1 if pattern is None else 2) for side in developed.shape[:2])
    if (height, width) != (header.height, header.width):
        raise UnreadableError(
            f"decodes to {width} x {height} pixels, its header says {header.width} x {header.height}"
        )
    for row0 in range(0, height, rows):
        stop = min(row0 + rows, height)
        band = developed[row0:stop] if pattern is None else interpolate(developed, pattern, slice(row0, stop))
        _mark_clipped(band, row0, *saturated, reach=0 if header.half_size else 1)
        yield row0, band


def development(half_size: bool = False) -> dict[str, Any]:
    """Return LibRaw's settings for linear values in the camera's own colours."""
    import rawpy

    return {
        "gamma": (1, 1),
        "no_auto_bright": True,
        "user_wb": [1.0, 1.0, 1.0, 1.0],
        "output_color": rawpy.ColorSpace.raw,
        "output_bps": 16,
        "demosaic_algorithm": rawpy.DemosaicAlgorithm.LINEAR,
        "half_size": half_size,
        "user_flip": 0,
        # LibRaw would take the largest value of each photograph for its white.
        "adjust_maximum_thr": 0.0,
    }


def _develop(raw: RawPy, half_size: bool) -> tuple[NDArray[np.uint16], NDArray[np.uint8] | None]:
    """Take off the black level and stretch to the white level.

    Returns
    -------
    developed : ndarray of shape (H, W, 3) or (H / 2, W / 2, 4), uint16
        The photograph, or its cells of 2 x 2 photosites, which are left to be interpolated.
    pattern : ndarray of shape (2, 2), uint8, or None
        Which colour stands where in a cell.
    """
    repeats = raw.raw_pattern
    pattern = raw.raw_colors_visible[:2, :2].copy()
    bayer = repeats is not None and repeats.shape == (2, 2) and sorted(pattern.flat) == [0, 1, 2, 3]
    if half_size or not bayer or raw.sizes.height % 2 or raw.sizes.width % 2:
        return np.asarray(raw.postprocess(**development(half_size)), np.uint16), None
    # At half size, LibRaw's four colours are the photosites themselves.
    cells = raw.postprocess(**development(half_size=True), four_color_rgb=True)
    return np.asarray(cells, np.uint16), pattern


def _open(path: Path) -> RawPy:
    import rawpy

    try:
        return rawpy.imread(str(path))
    except rawpy.LibRawError as error:
        raise UnreadableError(f"is not a raw file that LibRaw reads: {_reason(error)}") from error


def _no_mosaic(what: str) -> UnreadableError:
    return UnreadableError(
        f"holds {what}, expected a mosaic of red, green and blue", "Develop it to a linear 16-bit TIFF file"
    )


def half_size(header: Header) -> Header:
    """Return the header of a raw file that is read at half size, which takes no interpolation."""
    height, width = ((side + 1) // 2 for side in (header.height, header.width))
    unit_rows = _WORKING_HEIGHTS * height
    whole_size = (header.width, header.height)
    return replace(header, height=height, width=width, unit_rows=unit_rows, whole_size=whole_size)


def _saturated(raw: RawPy, half_size: bool) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint8]]:
    """Return row and column, in the photograph as it is read, and colour of each saturated photosite."""
    mosaic = raw.raw_image_visible
    parts = [
        np.flatnonzero(mosaic[top : top + _SLAB_ROWS] >= raw.white_level) + top * mosaic.shape[1]
        for top in range(0, mosaic.shape[0], _SLAB_ROWS)
    ]
    row, column = np.divmod(np.concatenate(parts).astype(np.int32), mosaic.shape[1])
    colour = raw.raw_colors_visible[row, column]
    side = 2 if half_size else 1
    return row // side, column // side, np.where(colour == _SECOND_GREEN, 1, colour)


def _mark_clipped(
    band: NDArray[np.uint16],
    row0: int,
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    colours: NDArray[np.uint8],
    reach: int,
) -> None:
    """Set each sample of a band to white that has a saturated photosite of its colour within reach.

    Saturated photosites are few, so that going through them takes less than masks of the whole band.
    """
    near = slice(*np.searchsorted(rows, (row0 - reach, row0 + len(band) + reach)))
    for down, across in product(range(-reach, reach + 1), repeat=2):
        row, column = rows[near] - row0 + down, columns[near] + across
        inside = (row >= 0) & (row < band.shape[0]) & (column >= 0) & (column < band.shape[1])
        band[row[inside], column[inside], colours[near][inside]] = _WHITE


def _exif(path: Path) -> dict[str, Any]:
    """Return the EXIF tags by their plain names; none where there are none that can be read."""
    import exifread

    with path.open("rb") as file:
        try:
            tags = exifread.process_file(file, details=False, extract_thumbnail=False)
        except Exception:  # whatever is odd in the tags, the photograph itself may be fine
            return {}
    return {name.partition(" ")[2]: tag for name, tag in tags.items()}


def _number(exif: dict[str, Any], name: str) -> float | None:
    values = exif[name].values if name in exif else []
    try:
        value = float(values[0])
    except (IndexError, TypeError, ValueError, ZeroDivisionError):
        return None
    return value if 0 < value < float("inf") else None


def _text(exif: dict[str, Any], name: str) -> str | None:
    return str(exif[name]).strip() or None if name in exif else None


def _reason(error: Exception) -> str:
    told = error.args[0] if error.args else "no reason given"
    return told.decode("ascii", "replace") if isinstance(told, bytes) else str(told)
