"""Smooth functions of direction as small tables, so that a reader needs to know no kernel.

A table has a row for each 5° of the zenith angle, from 0 to 90°, and a column for each 5° of azimuth.
"""

from __future__ import annotations

import numpy as np

from impasto.geometry import Array, dome_direction, zenith_azimuth

_ROWS, _COLUMNS = 19, 72


def node_directions() -> Array:
    """Return the directions of a table's nodes, unit vectors of shape (19, 72, 3)."""
    zenith = np.linspace(0.0, np.pi / 2, _ROWS)
    azimuth = np.arange(_COLUMNS) * (2.0 * np.pi / _COLUMNS)
    return dome_direction(*np.meshgrid(zenith, azimuth, indexing="ij"))


def look_up(table: Array, direction: Array) -> Array:
    """Return what a table says of directions, between its nodes by bilinear interpolation in both angles.

    Parameters
    ----------
    table : ndarray of shape (C, Z, A)
        Values at the nodes, zenith angles first; azimuths go around.
    direction : ndarray of shape (L, 3)
        Unit vectors; those below the horizon count as on it.

    Returns
    -------
    ndarray of shape (L, C)
    """
    _, rows, columns = table.shape
    zenith, azimuth = zenith_azimuth(direction)
    down = np.minimum(zenith / (np.pi / 2), 1.0) * (rows - 1)
    along = azimuth / (2.0 * np.pi) * columns
    row = np.minimum(down.astype(np.intp), rows - 2)
    column = np.floor(along).astype(np.intp)
    down, along = down - row, along - column
    first, second = column % columns, (column + 1) % columns
    upper = table[:, row, first] * (1.0 - along) + table[:, row, second] * along
    lower = table[:, row + 1, first] * (1.0 - along) + table[:, row + 1, second] * along
    result: Array = (upper * (1.0 - down) + lower * down).T
    return result
