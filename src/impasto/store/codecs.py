"""Zarr's codecs by which chunks are encoded, without numcodecs, which takes 30 ms to import."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import _core

Bytes = NDArray[np.uint8]


def zstd_encode(values: NDArray[Any], level: int) -> memoryview:
    """Return the bytes of values compressed, with a checksum."""
    return _core.zstd_encode(np.ascontiguousarray(values).reshape(-1).view(np.uint8), level).data


def zstd_decode(frame: bytes, out: NDArray[Any]) -> None:
    """Decompress a frame into `out`, which has its size and is C-contiguous.

    Raises
    ------
    ValueError
        If the frame is damaged, cut off, or of another size.
    """
    _core.zstd_decode(frame, out.reshape(-1).view(np.uint8))


def decompress(data: bytes, compressor: str, limit: int) -> bytes | Bytes:
    """Return what data hold that ``zstd`` or ``gzip`` compressed, at most `limit` bytes.

    Raises
    ------
    ValueError
        If they are damaged, cut off, or hold more.
    """
    if compressor == "gzip":
        import zlib

        # One byte more has it read on to the checksum at the end.
        stream = zlib.decompressobj(zlib.MAX_WBITS | 16)
        try:
            decoded = stream.decompress(data, limit + 1)
        except zlib.error as error:
            raise ValueError(str(error)) from error
        if not stream.eof or len(decoded) > limit:
            raise ValueError(f"a chunk that is cut off, or of more than {limit} bytes")
        return decoded
    length = _core.zstd_length(data)
    if length > limit:
        raise ValueError(f"a chunk of {length} bytes, expected {limit} at most")
    out = np.empty(length, np.uint8)
    zstd_decode(data, out)
    return out


def strings_encode(strings: Sequence[str]) -> bytes:
    """Return strings, each by its length and its UTF-8, after their number."""
    encoded = [string.encode() for string in strings]
    return struct.pack("<I", len(encoded)) + b"".join(
        struct.pack("<I", len(string)) + string for string in encoded
    )


def strings_decode(data: bytes) -> list[str]:
    """Return the strings that `strings_encode` made.

    Raises
    ------
    ValueError
        If they are cut off, or not UTF-8.
    """
    strings: list[str] = []
    try:
        (count,) = struct.unpack_from("<I", data)
        place = 4
        for _ in range(count):
            (length,) = struct.unpack_from("<I", data, place)
            strings.append(data[place + 4 : place + 4 + length].decode())
            place += 4 + length
    except struct.error:
        place = len(data) + 1
    if place != len(data):
        raise ValueError("its strings are cut off")
    return strings
