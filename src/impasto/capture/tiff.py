"""Read TIFF photographs: headers, and bands of rows decoded strip by strip or tile by tile."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from impasto.capture.header import Header, UnreadableError

if TYPE_CHECKING:
    from tifffile import TiffPage

# Types as `bands` gives them, by the type in the file.
_READ_AS = {"u1": "u1", "u2": "u2", "f2": "f4", "f4": "f4", "f8": "f4"}
_JPEG = (6, 7, 34892, 33007)


def read_header(path: Path) -> Header:
    """Read the header of a TIFF file and check that the file is as long as it says.

    Raises
    ------
    UnreadableError
        If the file is damaged, cut off, or of a kind that is not a photograph.
    """
    import tifffile

    try:
        with tifffile.TiffFile(path) as tiff:
            page = tiff.pages.first
            _check_kind(page)
            _check_extent(page, path.stat().st_size)
            exif = page.tags.valueof("ExifTag") or {}
            remarks = []
            if page.samplesperpixel in (2, 4):
                remarks.append("alpha channel left out")
            elif page.samplesperpixel > 4:
                remarks.append(f"channels after the third left out ({page.samplesperpixel} in the file)")
            if len(tiff.pages) > 1:
                remarks.append(f"only the first of {len(tiff.pages)} pages read")
            return Header(
                height=page.imagelength,
                width=page.imagewidth,
                channels=3 if page.samplesperpixel >= 3 else 1,
                dtype=np.dtype(_READ_AS[_stored(page)]),
                unit_rows=_unit_rows(page),
                icc_profile=page.iccprofile,
                exposure_s=_ratio(exif.get("ExposureTime") or page.tags.valueof("ExposureTime")),
                f_number=_ratio(exif.get("FNumber") or page.tags.valueof("FNumber")),
                iso=_first(exif.get("PhotographicSensitivity") or exif.get("ISOSpeedRatings")),
                orientation=int(page.tags.valueof("Orientation") or 1),
                remarks=tuple(remarks),
            )
    except UnreadableError:
        raise
    except Exception as error:  # a damaged file makes tifffile raise nearly anything
        raise UnreadableError(f"is not a readable TIFF file: {error}") from error


def bands(path: Path, header: Header, rows: int) -> Iterator[tuple[int, NDArray[Any]]]:
    """Decode a TIFF file from top to bottom.

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
    band : ndarray of shape (rows, W, C), uint8, uint16 or float32
        As stored; the last band may be lower.

    Raises
    ------
    UnreadableError
        If the pixels are damaged or cut off.
    """
    import tifffile

    with ExitStack() as opened:
        try:
            page = opened.enter_context(tifffile.TiffFile(path)).pages.first
        except OSError:
            raise
        except Exception as error:  # as in `read_header`
            raise UnreadableError(f"has changed since its header was read: {error}") from error
        file = opened.enter_context(path.open("rb", buffering=0))
        if _is_plain(page, header):
            yield from _plain_bands(page, file, header, rows)
        else:
            yield from _decoded_bands(page, file, header, rows)


def _check_kind(page: TiffPage) -> None:
    import tifffile

    if _stored(page) not in _READ_AS or page.bitspersample not in (8, 16, 32, 64):
        raise UnreadableError(
            f"holds {page.bitspersample}-bit samples of type {page.dtype}, expected unsigned integers of 8 "
            "or 16 bits, or floats",
            "Export it as 8- or 16-bit RGB or grey, or as float",
        )
    allowed = tifffile.PHOTOMETRIC.MINISBLACK, tifffile.PHOTOMETRIC.RGB
    jpeg_colour = page.photometric == tifffile.PHOTOMETRIC.YCBCR and page.compression in _JPEG
    if page.photometric not in allowed and not jpeg_colour:
        kind = getattr(page.photometric, "name", page.photometric)
        raise UnreadableError(f"holds {kind} pixels, expected grey or RGB", "Export it as grey or RGB")
    if page.imagedepth != 1:
        raise UnreadableError(f"holds a volume of {page.imagedepth} slices", "Export it as a flat picture")
    if page.compression != 1 and page.compression not in tifffile.TIFF.DECOMPRESSORS:
        raise UnreadableError(
            f"is compressed in an unknown way ({page.compression!s})",
            "Export it uncompressed, or with LZW, deflate or zstd",
        )


def _check_extent(page: TiffPage, size: int) -> None:
    expected = math.prod(page.chunked)
    offsets, counts = page.dataoffsets, page.databytecounts
    missing = sum(1 for offset, count in zip(offsets, counts, strict=False) if offset == 0 or count == 0)
    missing += max(0, expected - min(len(offsets), len(counts)))
    end = max((offset + count for offset, count in zip(offsets, counts, strict=False)), default=0)
    if missing:
        raise UnreadableError(
            f"lacks {missing} of its {expected} strips or tiles: it was not written to the end"
        )
    if end > size:
        raise UnreadableError(f"is cut off: it should have {end} bytes or more and has {size}")


def _stored(page: TiffPage) -> str:
    """Return the type of the samples without their byte order, such as u2."""
    return "" if page.dtype is None else page.dtype.str[1:]


def _unit_rows(page: TiffPage) -> int:
    if page.is_tiled:
        return min(page.tilelength, page.imagelength)
    if page.compression == 1 and page.planarconfig == 1:
        return 1
    return min(page.rowsperstrip, page.imagelength)


def _ratio(value: tuple[int, int] | float | None) -> float | None:
    """Return an EXIF number, stored as numerator and denominator."""
    if isinstance(value, tuple):
        return value[0] / value[1] if value[0] and value[1] else None
    return float(value) if value else None


def _first(value: tuple[int, ...] | int | None) -> float | None:
    """Return an EXIF number that may come as a list."""
    return float(value[0] if isinstance(value, tuple) else value) if value else None


def _is_plain(page: TiffPage, header: Header) -> bool:
    """Return whether rows lie in the file just as a band holds them, so that they can be read into it."""
    return (
        page.compression == 1
        and page.predictor == 1
        and page.fillorder == 1
        and not page.is_tiled
        and (page.planarconfig == 1 or page.samplesperpixel == 1)
        and page.samplesperpixel == header.channels
        and _stored(page) == header.dtype.str[1:]
    )


def _plain_bands(
    page: TiffPage, file: BinaryIO, header: Header, rows: int
) -> Iterator[tuple[int, NDArray[Any]]]:
    stored = np.dtype(page.parent.byteorder + header.dtype.str[1:])
    row_bytes = header.width * header.channels * stored.itemsize
    strip_rows = page.rowsperstrip
    for row0 in range(0, header.height, rows):
        row1 = min(row0 + rows, header.height)
        band = np.empty((row1 - row0, header.width, header.channels), stored)
        target = memoryview(band.data).cast("B")
        row = row0
        while row < row1:
            strip = row // strip_rows
            stop = min(row1, (strip + 1) * strip_rows)
            file.seek(page.dataoffsets[strip] + (row - strip * strip_rows) * row_bytes)
            _read_into(file, target[(row - row0) * row_bytes : (stop - row0) * row_bytes], row)
            row = stop
        yield row0, band.astype(header.dtype, copy=False)


def _read_into(file: BinaryIO, target: memoryview, row: int) -> None:
    """Fill `target`; one unbuffered read may return less, and never returns more than 2 GiB."""
    while target:
        count = file.readinto(target)  # type: ignore[attr-defined]
        if not count:
            raise UnreadableError(f"is cut off at row {row}")
        target = target[count:]


def _decoded_bands(
    page: TiffPage, file: BinaryIO, header: Header, rows: int
) -> Iterator[tuple[int, NDArray[Any]]]:
    band, row0 = _empty(header, 0, rows), 0
    for top, strip in _strips(page, file, header):
        done = 0
        while done < len(strip):
            at = top + done - row0
            part = strip[done : done + len(band) - at]
            band[at : at + len(part)] = part
            done += len(part)
            if at + len(part) == len(band):
                yield row0, band
                row0 += len(band)
                band = _empty(header, row0, rows)


def _empty(header: Header, row0: int, rows: int) -> NDArray[Any]:
    return np.empty((min(rows, header.height - row0), header.width, header.channels), header.dtype)


def _strips(page: TiffPage, file: BinaryIO, header: Header) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield (first row, rows of shape (n, W, C)) for each strip, or row of tiles, from top to bottom."""
    stored_planes = page.shaped[0]
    per_plane = math.prod(page.chunked) // stored_planes
    planes = header.channels if stored_planes > 1 else 1
    across = math.ceil(page.imagewidth / page.tilewidth) if page.is_tiled else 1
    for first in range(0, per_plane, across):
        if across == planes == 1:
            top, _, segment = _segment(page, file, first)
            yield top, segment[: header.height - top, : header.width, : header.channels]
            continue
        out = np.empty((0, 0, 0), header.dtype)
        for plane in range(planes):
            for index in range(first, first + across):
                top, left, segment = _segment(page, file, plane * per_plane + index)
                segment = segment[: header.height - top, : header.width - left, : header.channels]
                if not out.size:
                    out = np.empty((len(segment), header.width, header.channels), header.dtype)
                channels = slice(plane, plane + 1) if planes > 1 else slice(None)
                out[:, left : left + segment.shape[1], channels] = segment
        yield top, out


def _segment(page: TiffPage, file: BinaryIO, index: int) -> tuple[int, int, NDArray[Any]]:
    """Decode one strip or tile; return its top row, left column, and samples (rows, columns, samples)."""
    tables = (
        {"jpegtables": page.jpegtables, "jpegheader": page.jpegheader} if page.compression in _JPEG else {}
    )
    file.seek(page.dataoffsets[index])
    data = file.read(page.databytecounts[index])
    try:
        decoded, (_, _, top, left, _), _ = page.decode(data, index, **tables)
    except Exception as error:  # each codec raises its own kind
        raise UnreadableError(f"cannot be decoded at strip or tile {index}: {error}") from error
    if decoded is None:
        raise UnreadableError(f"has an empty strip or tile ({index})")
    return top, left, decoded[0]
