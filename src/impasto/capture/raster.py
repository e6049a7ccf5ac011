"""Read EXR, PNG and JPEG photographs through OpenImageIO.

OpenImageIO reports damage only through `geterror()` after the very read that met it: a truncated JPEG gives a
full array, and the reads after it report nothing. So each read is checked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.header import Header, UnreadableError
from impasto.capture.markers import (
    check_jpeg_end,
    is_interlaced,
    is_progressive,
    png_declared_transfer,
)

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

# Scan lines that OpenEXR compresses together; other compressions work line by line.
_EXR_BLOCK_ROWS = {"zip": 16, "pxr24": 16, "piz": 32, "b44": 32, "b44a": 32, "dwaa": 32, "dwab": 256}


def read_header(path: Path) -> Header:
    """Read the header of an EXR, PNG or JPEG file, and check its end where that costs nothing.

    Raises
    ------
    UnreadableError
        If the file is damaged, cut off, or of a kind that is not a photograph.
    """
    format_name = {".exr": "EXR", ".png": "PNG"}.get(path.suffix.lower(), "JPEG")
    remarks: list[str] = []
    declared = None
    if format_name == "PNG":
        declared = png_declared_transfer(path)
    elif format_name == "JPEG":
        check_jpeg_end(path)
    image = _open(path)
    try:
        spec = image.spec()
        if format_name == "EXR":
            _check_exr(image)
            if image.seek_subimage(1, 0):
                remarks.append("only the first part of the EXR file read")
                image.seek_subimage(0, 0)
                spec = image.spec()
        if spec.getattribute("jpeg:ColorSpace") == "CMYK":
            raise UnreadableError("holds CMYK pixels, expected grey or RGB", "Export it as grey or RGB")
        chosen, dropped = _channels(spec)
        if dropped == ["A"]:
            remarks.append("alpha channel left out")
        elif dropped:
            remarks.append(f"channels {', '.join(dropped)} left out")
        profile = spec.getattribute("ICCProfile")
        return Header(
            height=spec.height,
            width=spec.width,
            channels=len(chosen),
            dtype=_dtype(spec, format_name),
            unit_rows=_unit_rows(spec, format_name, path),
            declared_transfer=declared,
            icc_profile=None if profile is None else bytes(profile),
            exposure_s=_number(spec, "ExposureTime"),
            f_number=_number(spec, "FNumber"),
            iso=_number(spec, "Exif:PhotographicSensitivity") or _number(spec, "Exif:ISOSpeedRatings"),
            camera=" ".join(filter(None, (_text(spec, "Make"), _text(spec, "Model")))) or None,
            lens=_text(spec, "Exif:LensModel"),
            taken=_text(spec, "Exif:DateTimeOriginal"),
            orientation=spec.getattribute("Orientation") or 1,
            remarks=tuple(remarks),
        )
    finally:
        image.close()


def bands(path: Path, header: Header, rows: int) -> Iterator[tuple[int, NDArray[Any]]]:
    """Decode an EXR, PNG or JPEG file from top to bottom.

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
    image = _open(path)
    try:
        spec = image.spec()
        chosen, _ = _channels(spec)
        # A reader goes fastest, and EXR and tiles only decode once, in whole blocks.
        step = max(1, rows // header.unit_rows) * header.unit_rows
        held: list[NDArray[Any]] = []
        row0 = 0
        for top in range(0, header.height, step):
            held.append(_read(image, spec, chosen, header, top, min(top + step, header.height)))
            ready = sum(map(len, held))
            last = top + step >= header.height
            while ready >= rows or (last and ready):
                band, held = _take(held, rows)
                yield row0, band
                row0 += len(band)
                ready -= len(band)
    finally:
        image.close()


def _take(held: list[NDArray[Any]], rows: int) -> tuple[NDArray[Any], list[NDArray[Any]]]:
    """Split the first `rows` rows off the blocks held."""
    if len(held[0]) == rows or (len(held) == 1 and len(held[0]) < rows):
        return held[0], held[1:]
    joined = held[0] if len(held) == 1 else np.concatenate(held)
    return joined[:rows], [joined[rows:]] if len(joined) > rows else []


def _open(path: Path) -> ImageInput:
    import OpenImageIO as oiio

    wanted = oiio.ImageSpec()
    # Alpha is dropped; without this OpenImageIO would first multiply the colours of a PNG by it.
    wanted.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageInput.open(str(path), wanted)
    if image is None:
        raise UnreadableError(f"cannot be opened: {_one_line(oiio.geterror())}")
    return image


def _read(
    image: ImageInput, spec: ImageSpec, chosen: list[int], header: Header, top: int, bottom: int
) -> NDArray[Any]:
    first, stop = min(chosen), max(chosen) + 1
    kind = header.dtype.name.replace("float32", "float")
    if spec.tile_width:
        pixels = image.read_tiles(
            spec.x, spec.x + spec.width, spec.y + top, spec.y + bottom, spec.z, spec.z + 1, first, stop, kind
        )
    else:
        pixels = image.read_scanlines(spec.y + top, spec.y + bottom, spec.z, first, stop, kind)
    error = image.geterror()
    if error or pixels is None:
        raise UnreadableError(
            f"cannot be decoded in rows {top} to {bottom - 1} of {header.height}: "
            f"{_one_line(error) or 'no reason given'}"
        )
    pixels = pixels.reshape(bottom - top, header.width, stop - first)
    if [channel - first for channel in chosen] != list(range(stop - first)):
        pixels = np.ascontiguousarray(pixels[..., [channel - first for channel in chosen]])
    return pixels


def _channels(spec: ImageSpec) -> tuple[list[int], list[str]]:
    """Return the indices of the channels to read, R, G, B or one, and the names of those left out."""
    names = list(spec.channelnames)
    if {"R", "G", "B"} <= set(names):
        chosen = [names.index(name) for name in "RGB"]
    else:
        grey = [name for name in names if name != "A"]
        if len(grey) != 1:
            raise UnreadableError(
                f"has the channels {', '.join(names)}, expected R, G, B or one grey channel",
                "Export it as grey or RGB",
            )
        chosen = [names.index(grey[0])]
    return chosen, [name for number, name in enumerate(names) if number not in chosen]


def _dtype(spec: ImageSpec, format_name: str) -> np.dtype[Any]:
    kind = str(spec.format)
    if format_name == "EXR" and kind in ("half", "float"):
        return np.dtype(np.float32)
    if kind in ("uint8", "uint16"):
        return np.dtype(kind)
    raise UnreadableError(
        f"holds samples of type {kind}, expected half or float", "Export it as half or float"
    )


def _unit_rows(spec: ImageSpec, format_name: str, path: Path) -> int:
    if format_name == "EXR":
        block = spec.tile_height or _EXR_BLOCK_ROWS.get(str(spec.getattribute("compression")), 1)
        return int(min(block, spec.height))
    whole = is_interlaced(path) if format_name == "PNG" else is_progressive(path)
    return int(spec.height) if whole else 1


def _check_exr(image: ImageInput) -> None:
    spec = image.spec()
    if spec.deep:
        raise UnreadableError("is a deep EXR file", "Flatten it")
    data = (spec.x, spec.y, spec.width, spec.height)
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if data != display:
        # Photographs cut differently would no longer lie pixel on pixel.
        raise UnreadableError(
            f"has a data window (x, y, width, height) {data} that is not its display window {display}",
            "Save the whole picture, without a crop or overscan",
        )


def _text(spec: ImageSpec, name: str) -> str | None:
    value = spec.getattribute(name)
    return str(value).strip() or None if value is not None else None


def _number(spec: ImageSpec, name: str) -> float | None:
    value = spec.getattribute(name)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) and value > 0 else None


def _one_line(message: str) -> str:
    """Return the first line of a library's message, which may repeat itself, without its full stop."""
    return message.strip().split("\n")[0].strip().rstrip(".")
