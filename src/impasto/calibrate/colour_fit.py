"""Fit the transform from a camera's radiance to XYZ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from impasto.calibrate.patches import Array
from impasto.colour.camera import TERMS, colour_terms

METHODS = tuple(TERMS)


@dataclass(frozen=True)
class ColourFit:
    """A transform and how good it is.

    Parameters
    ----------
    matrix : ndarray of shape (3, 3) or (3, 6)
        As `impasto.colour.camera.CameraColour` has it.
    difference : ndarray of shape (P,)
        CIEDE2000 of each patch.
    left_out : ndarray of shape (P,)
        CIEDE2000 of each patch by a fit without it.
    """

    matrix: Array
    difference: Array
    left_out: Array


def fit_colour(rgb: Array, xyz: Array, white_xyz: Array, method: str) -> ColourFit:
    """Fit a transform, and fit it again without each patch.

    Parameters
    ----------
    rgb : ndarray of shape (P, 3)
        Radiance; a perfect white diffuser has mean 1.
    xyz : ndarray of shape (P, 3)
        What is known; Y = 1 for a perfect white diffuser.
    white_xyz : ndarray of shape (3,)
    method : {'matrix', 'root-polynomial'}
    """
    terms = colour_terms(rgb, TERMS[method])
    matrix = _fit(terms, xyz, white_xyz)
    without = []
    for row in range(len(rgb)):
        kept = np.arange(len(rgb)) != row
        without.append(terms[row] @ _fit(terms[kept], xyz[kept], white_xyz).T)
    return ColourFit(
        matrix,
        ciede2000(terms @ matrix.T, xyz, white_xyz),
        ciede2000(np.array(without), xyz, white_xyz),
    )


def _fit(terms: Array, xyz: Array, white_xyz: Array) -> Array:
    """Return the matrix of least squared differences in CIELAB, from that of least squares in XYZ."""
    count = terms.shape[1]
    start, *_ = np.linalg.lstsq(terms, xyz, rcond=None)
    wanted = lab(xyz, white_xyz)

    def off(flat: Array) -> Array:
        return np.asarray((lab(terms @ flat.reshape(3, count).T, white_xyz) - wanted).ravel())

    return np.asarray(least_squares(off, start.T.ravel(), x_scale="jac").x.reshape(3, count))


def lab(xyz: Array, white_xyz: Array) -> Array:
    """Return CIELAB of XYZ (..., 3) by colour-science [CIE15]_."""
    import colour

    return np.asarray(colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white_xyz)))


def ciede2000(xyz: Array, other: Array, white_xyz: Array) -> Array:
    """Return CIEDE2000 between XYZ (..., 3) by colour-science [Sharma2005]_."""
    import colour

    return np.asarray(colour.delta_E(lab(xyz, white_xyz), lab(other, white_xyz), method="CIE 2000"))
