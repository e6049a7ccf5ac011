"""Read raw files through LibRaw: linear, in the camera's own colours, without white balance.

Black levels are subtracted per channel and the white level becomes 65535. The mosaic is interpolated
linearly, so that each value is a weighted mean of photosites of its colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.header import Header, UnreadableError

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
            clipped = _clipped(raw, header.half_size)
            image = raw.postprocess(
                gamma=(1, 1),
                no_auto_bright=True,
                user_wb=[1.0, 1.0, 1.0, 1.0],
                output_color=rawpy.ColorSpace.raw,
                output_bps=16,
                demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
                half_size=header.half_size,
                user_flip=0,
                # LibRaw would take the largest value of each photograph for its white.
                adjust_maximum_thr=0.0,
            )
        except rawpy.LibRawError as error:
            raise UnreadableError(f"cannot be decoded: {_reason(error)}") from error
    if image.shape != (header.height, header.width, header.channels):
        raise UnreadableError(
            f"decodes to {image.shape[1]} x {image.shape[0]} pixels, its header says "
            f"{header.width} x {header.height}"
        )
    image[clipped] = _WHITE
    for row0 in range(0, header.height, rows):
        yield row0, image[row0 : row0 + rows]


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
    return replace(header, height=height, width=width, unit_rows=unit_rows, half_size=True)


def _clipped(raw: RawPy, half: bool) -> NDArray[np.bool_]:
    """Return which samples have a saturated photosite of their colour among the neighbours they come from."""
    mosaic = raw.raw_image_visible
    saturated = mosaic >= raw.white_level
    height, width = ((side + 1) // 2 if half else side for side in mosaic.shape)
    clipped = np.zeros((height, width, 3), bool)
    if not saturated.any():
        return clipped
    colour = np.minimum(raw.raw_colors_visible, 3)
    for channel in range(3):
        # The second green counts as green.
        sites = saturated & ((colour == channel) | ((colour == 3) & (channel == 1)))
        clipped[..., channel] = _in_cells(sites) if half else _widened(sites)
    return clipped


def _widened(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask with its eight neighbours."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    result = wide.copy()
    result[:, 1:] |= wide[:, :-1]
    result[:, :-1] |= wide[:, 1:]
    return result


def _in_cells(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which cells of 2 x 2 hold any of a mask."""
    even = np.pad(mask, [(0, side % 2) for side in mask.shape])
    return np.asarray(even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2).any(axis=(1, 3)))


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
