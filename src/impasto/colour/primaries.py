"""RGB colour spaces by their primaries."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.colour.adaptation import WHITE_POINTS, xy_to_xyz

Array = NDArray[np.float64]

SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
"""CIE xy of sRGB's primaries [IEC61966-2-1]_."""

DISPLAY_P3 = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
"""CIE xy of Display P3's primaries [DisplayP3]_."""


def rgb_to_xyz_matrix(primaries: ArrayLike, white_xy: ArrayLike = WHITE_POINTS["D65"]) -> Array:
    """Return the matrix from linear RGB to XYZ.

    Parameters
    ----------
    primaries : array_like of shape (3, 2)
        CIE xy of red, green and blue.
    white_xy : array_like of shape (2,), optional
        CIE xy of the white, which has Y = 1.

    Returns
    -------
    ndarray of shape (3, 3), float64
        Exact; [IEC61966-2-1]_ prints sRGB's rounded to four decimals.
    """
    xyz = xy_to_xyz(primaries).T
    return np.asarray(xyz * np.linalg.solve(xyz, xy_to_xyz(white_xy)))
