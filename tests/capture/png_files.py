"""Write PNG files chunk by chunk: interlaced ones, and ones with chunks that libraries do not write."""

import struct
import zlib

import numpy as np

_PASSES = ((0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1))


def chunk(kind, data=b""):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(pixels, *, interlaced=False, extra=b""):
    """Return a PNG file of uint8 or uint16 pixels (H, W, C), with `extra` chunks after the header."""
    height, width, channels = pixels.shape
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    depth = 8 * pixels.dtype.itemsize
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, int(interlaced))
    parts = []
    for top, left, down, across in _PASSES if interlaced else ((0, 0, 1, 1),):
        rows = np.ascontiguousarray(pixels[top::down, left::across], dtype=f">u{pixels.dtype.itemsize}")
        parts += [b"\0" + row.tobytes() for row in rows if row.size]
    data = zlib.compress(b"".join(parts))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra + chunk(b"IDAT", data) + chunk(b"IEND")
