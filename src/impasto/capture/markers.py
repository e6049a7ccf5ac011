"""What the markers of PNG and JPEG files say that OpenImageIO does not pass on."""

from __future__ import annotations

import struct
from pathlib import Path

from impasto.capture.header import UnreadableError

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
# Bytes at the end of a JPEG file in which its end marker is looked for; cameras may append a little.
_JPEG_TAIL = 1 << 16


def check_jpeg_end(path: Path) -> None:
    """Raise `UnreadableError` if a file is no JPEG file or lacks its end."""
    with path.open("rb") as file:
        if file.read(2) != b"\xff\xd8":
            raise UnreadableError("is not a JPEG file: it does not start with FF D8")
        file.seek(max(2, path.stat().st_size - _JPEG_TAIL))
        if b"\xff\xd9" not in file.read():
            raise UnreadableError("is cut off: the end marker FF D9 is missing")


def is_progressive(path: Path) -> bool:
    """Return whether a JPEG file refines the whole picture pass by pass, which keeps all of it in memory."""
    with path.open("rb") as file:
        file.seek(2)
        while len(start := file.read(4)) == 4:
            marker, length = struct.unpack(">HH", start)
            if 0xFFC0 <= marker <= 0xFFCF and marker not in (0xFFC4, 0xFFC8, 0xFFCC):
                return marker in (0xFFC2, 0xFFC6, 0xFFCA, 0xFFCE)
            file.seek(length - 2, 1)
    return False


def png_declared_transfer(path: Path) -> str | None:
    """Return what the sRGB or gAMA chunk of a PNG file states; raise if the file has no end.

    OpenImageIO calls every PNG sRGB, whether the file says so or not. Both chunks come before the pixels,
    whose thousands of chunks are walked only where the file does not end as it should.
    """
    declared = None
    with path.open("rb") as file:
        if file.read(8) != _PNG_SIGNATURE:
            raise UnreadableError("is not a PNG file: the signature is wrong")
        size = path.stat().st_size
        while True:
            start = file.read(8)
            if len(start) < 8:
                raise UnreadableError("is cut off: the end chunk IEND is missing")
            length, kind = struct.unpack(">I4s", start)
            if kind == b"IEND" or (kind == b"IDAT" and _ends_with_iend(path, size)):
                return declared
            if file.tell() + length + 4 > size:
                raise UnreadableError(f"is cut off in its chunk {kind.decode('latin-1')}")
            if kind == b"sRGB":
                declared = "srgb"
            elif kind == b"gAMA" and declared is None and length == 4:
                (stored,) = struct.unpack(">I", file.read(4))
                declared = _gamma_name(stored)
                length = 0
            file.seek(length + 4, 1)


def is_interlaced(path: Path) -> bool:
    """Return whether a PNG file is interlaced, so that no row is complete before the last pass."""
    with path.open("rb") as file:
        return file.read(29)[28] != 0


def _ends_with_iend(path: Path, size: int) -> bool:
    with path.open("rb") as file:
        file.seek(max(0, size - len(_PNG_END)))
        return file.read() == _PNG_END


def _gamma_name(stored: int) -> str | None:
    """Return the transfer function for a gAMA chunk, which holds 100000 / gamma."""
    if not stored:
        return None
    return "linear" if stored == 100000 else f"gamma:{100000 / stored:.6g}"
