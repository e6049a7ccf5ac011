"""Interpolate a mosaic of photosites linearly: a missing colour is the mean of its nearest photosites.

LibRaw's own linear interpolation does the same, and takes most of the time of reading a raw file.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.uint16]

_GREENS = (1, 3)
# Rows of cells at a time: few enough to stay in the processor's cache.
_SLAB_ROWS = 16


def interpolate(cells: Codes, pattern: NDArray[np.uint8], rows: slice) -> Codes:
    """Return the three colours of the photosites in some rows.

    Parameters
    ----------
    cells : ndarray of shape (H / 2, W / 2, 4), uint16
        Red, green, blue and second green of each cell of 2 x 2 photosites.
    pattern : ndarray of shape (2, 2), uint8
        Which of these stands where in a cell.
    rows : slice
        Of photosites.

    Returns
    -------
    ndarray of shape (rows, W, 3), uint16
        Means are rounded down.
    """
    first, last = rows.start // 2, -(-rows.stop // 2)
    image = np.empty((2 * (last - first), 2 * cells.shape[1], 3), np.uint16)
    for top in range(first, last, _SLAB_ROWS):
        bottom = min(top + _SLAB_ROWS, last)
        planes = [_with_border(cells, channel, top, bottom) for channel in range(4)]
        part = image[2 * (top - first) : 2 * (bottom - first)]
        for row, column in np.ndindex(2, 2):
            for colour, channels in enumerate(((0,), _GREENS, (2,))):
                part[row::2, column::2, colour] = _at(planes, channels, pattern, row, column)
    return image[rows.start - 2 * first : rows.stop - 2 * first]


def _with_border(cells: Codes, channel: int, top: int, bottom: int) -> Codes:
    """Return rows of one channel with their neighbours on all sides; at the edges, the outermost again."""
    rows, columns = cells.shape[:2]
    plane = np.empty((bottom - top + 2, columns + 2), np.uint16)
    plane[:, 1:-1] = cells[np.arange(top - 1, bottom + 1).clip(0, rows - 1), :, channel]
    plane[:, 0], plane[:, -1] = plane[:, 1], plane[:, -2]
    return plane


def _at(
    planes: list[Codes], channels: tuple[int, ...], pattern: NDArray[np.uint8], row: int, column: int
) -> Codes:
    """Return one colour at one place of each cell."""
    found = []
    for channel in channels:
        (site,) = np.argwhere(pattern == channel)
        down, across = row - site[0], column - site[1]
        value = _between(_between(planes[channel], down).T, across).T
        if down == across == 0:
            return value
        found.append(value)
    return found[0] if len(found) == 1 else _mean(*found)


def _between(plane: Codes, step: int) -> Codes:
    """Return the values of a plane's inner rows, or the means with the next row, or with the one before."""
    if step == 0:
        return plane[1:-1]
    return _mean(plane[1:-1], plane[2:] if step > 0 else plane[:-2])


def _mean(first: Codes, second: Codes) -> Codes:
    # Without the carry, which 16 bits do not hold.
    return (first & second) + ((first ^ second) >> 1)
