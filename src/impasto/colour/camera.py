"""From a camera's radiance to CIE XYZ."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.colour.adaptation import WHITE_POINTS, xy_to_xyz
from impasto.colour.primaries import SRGB, rgb_to_xyz_matrix

TERMS = {"matrix": 3, "root-polynomial": 6}
"""How many terms of R, G and B each kind of camera colour combines."""


def colour_terms(rgb: NDArray[Any], count: int) -> NDArray[Any]:
    """Return the terms of R, G and B that a camera colour combines linearly.

    Parameters
    ----------
    rgb : ndarray of shape (..., C), float
        Radiance in the camera's space.
    count : int
        1 or 3: the channels themselves. 6: also √(RG), √(GB), √(RB), which double with the exposure as R, G
        and B do; the root of a negative product, which only noise makes, is 0.

    Returns
    -------
    ndarray of shape (..., count)

    References
    ----------
    [Finlayson2015]_, the root-polynomial of degree 2.
    """
    if count == rgb.shape[-1]:
        return rgb
    red, green, blue = np.moveaxis(rgb, -1, 0)
    products = (red * green, green * blue, red * blue)
    roots = [np.sqrt(np.maximum(product, 0)) for product in products]
    return np.concatenate([rgb, np.stack(roots, axis=-1)], axis=-1)


@dataclass(frozen=True)
class CameraColour:
    """What a camera's radiance means in XYZ.

    Parameters
    ----------
    matrix : ndarray of shape (3, 3) or (3, 6), float64
        From `colour_terms` to XYZ; a perfect white diffuser, whose radiance has mean 1 over the channels, has
        Y = 1.
    white_xyz : ndarray of shape (3,), float64
        XYZ of a perfect white diffuser, Y = 1.
    source : str
        Where the matrix comes from, for summaries.
    """

    matrix: NDArray[np.float64]
    white_xyz: NDArray[np.float64] = field(default_factory=lambda: xy_to_xyz(WHITE_POINTS["D65"]))
    source: str = "sRGB's primaries, assumed"

    def xyz(self, radiance: NDArray[Any]) -> NDArray[Any]:
        """Return XYZ of radiance, both of shape (..., 3)."""
        terms = colour_terms(radiance, self.matrix.shape[1])
        return np.asarray(terms @ self.matrix.T.astype(terms.dtype, copy=False))


def camera_colour(attributes: dict[str, Any] | None) -> CameraColour:
    """Return the camera colour that a stack's attribute ``camera_colour`` holds, sRGB's without one."""
    if not attributes:
        return CameraColour(rgb_to_xyz_matrix(SRGB))
    matrix, white = (_array(attributes[name]) for name in ("matrix", "white_xyz"))
    return CameraColour(matrix, white, attributes["source"])


def _array(values: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(values, np.float64)
