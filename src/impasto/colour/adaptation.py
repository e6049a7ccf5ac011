"""White points, and chromatic adaptation from one to another."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Adaptation = Literal["cat16", "bradford"]
ADAPTATIONS: tuple[str, ...] = get_args(Adaptation)

WHITE_POINTS: dict[str, tuple[float, float]] = {
    "A": (0.44758, 0.40745),
    "D50": (0.34570, 0.35850),
    "D55": (0.33243, 0.34744),
    "D65": (0.31270, 0.32900),
    "E": (1 / 3, 1 / 3),
}
"""CIE xy of illuminants for the 2° observer [CIE15]_."""

# From XYZ to sharpened cone responses.
_CONES: dict[str, Array] = {
    "cat16": np.array([  # [Li2017]_
        [0.401288, 0.650173, -0.051461],
        [-0.250268, 1.204414, 0.045854],
        [-0.002079, 0.048952, 0.953127],
    ]),
    "bradford": np.array([  # [ICC.1:2022]_ annex E
        [0.8951, 0.2664, -0.1614],
        [-0.7502, 1.7135, 0.0367],
        [0.0389, -0.0685, 1.0296],
    ]),
}  # fmt: skip


def xy_to_xyz(xy: ArrayLike) -> Array:
    """Return XYZ with Y = 1 of chromaticities (..., 2), as an ndarray of shape (..., 3)."""
    x, y = np.moveaxis(np.asarray(xy, np.float64), -1, 0)
    return np.stack([x / y, np.ones_like(y), (1 - x - y) / y], axis=-1)


def adaptation_matrix(source_white: ArrayLike, target_white: ArrayLike, method: Adaptation) -> Array:
    """Return the matrix that takes XYZ seen under one white to XYZ that look alike under another.

    Parameters
    ----------
    source_white, target_white : array_like of shape (3,)
        XYZ of both whites; their luminances do not matter.
    method : {'cat16', 'bradford'}
        Whose cone responses are scaled.

    Returns
    -------
    ndarray of shape (3, 3), float64
        The von Kries transform of complete adaptation, which takes the one white to the other.

    References
    ----------
    [Li2017]_ for CAT16, [ICC.1:2022]_ annex E for Bradford without its non-linear blue.
    """
    cones = _CONES[method]
    source, target = (np.asarray(white, np.float64) for white in (source_white, target_white))
    gain = (cones @ (target / target[1])) / (cones @ (source / source[1]))
    return np.asarray(np.linalg.solve(cones, gain[:, np.newaxis] * cones))
