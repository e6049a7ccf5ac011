"""A height map as a mesh of triangles, in the files that other programs read: binary PLY and STL."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.output import written_whole

_BAND_ROWS = 64


def write_ply(path: Path, height: NDArray[np.float32], pitch: float) -> None:
    """Write a height map as a binary PLY file [Turk1994]_.

    Parameters
    ----------
    path : Path
    height : ndarray of shape (H, W), float32
        At least 2 by 2.
    pitch : float
        Distance of neighbours, in the unit of `height`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    rows, columns = height.shape
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment impasto\n"
        f"element vertex {rows * columns}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {_triangles(rows, columns)}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    with written_whole(path) as temporary, temporary.open("wb") as file:
        file.write(head.encode("ascii"))
        for band in _bands(rows):
            file.write(_vertices(height, pitch, band).astype("<f4").tobytes())
        for band in _bands(rows - 1):
            corners = _corners(band, columns)
            faces = np.empty(len(corners), [("count", "u1"), ("corners", "<u4", 3)])
            faces["count"], faces["corners"] = 3, corners
            file.write(faces.tobytes())


def write_stl(path: Path, height: NDArray[np.float32], pitch: float) -> None:
    """Write a height map as a binary STL file; parameters as for `write_ply`."""
    rows, columns = height.shape
    with written_whole(path) as temporary, temporary.open("wb") as file:
        file.write(b"impasto height map".ljust(80))
        file.write(np.array(_triangles(rows, columns), "<u4").tobytes())
        for band in _bands(rows - 1):
            vertices = _vertices(height, pitch, slice(band.start, band.stop + 1)).reshape(-1, 3)
            points = vertices[_corners(slice(0, band.stop - band.start), columns)]
            across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
            facets = np.zeros(len(points), [("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("rest", "<u2")])
            facets["normal"] = across / np.linalg.norm(across, axis=1, keepdims=True)
            facets["points"] = points
            file.write(facets.tobytes())


def _triangles(rows: int, columns: int) -> int:
    return 2 * (rows - 1) * (columns - 1)


def _bands(rows: int) -> Iterator[slice]:
    for top in range(0, rows, _BAND_ROWS):
        yield slice(top, min(top + _BAND_ROWS, rows))


def _vertices(height: NDArray[np.float32], pitch: float, band: slice) -> NDArray[np.float64]:
    """Return X, Y and Z of rows, (rows, W, 3), in the painting's frame: Y up, origin at its centre."""
    rows, columns = height.shape
    row, column = np.mgrid[band, 0:columns]
    x, y = (column - (columns - 1) / 2) * pitch, ((rows - 1) / 2 - row) * pitch
    return np.stack([x, y, height[band]], axis=-1)


def _corners(band: slice, columns: int) -> NDArray[np.int64]:
    """Return vertices (N, 3) of the triangles below rows, counter-clockwise as the viewer sees them."""
    row, column = np.mgrid[band, 0 : columns - 1].reshape(2, -1)
    first = row * columns + column
    below = first + columns
    return np.concatenate(
        [np.stack([first, below, below + 1], axis=1), np.stack([first, below + 1, first + 1], axis=1)]
    )
