"""What the samples of a photograph, beside the model's, tell of how strong its light was."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# A sample with this share of highlight counts half: what a model gets wrong there is not the light's.
_HIGHLIGHT = 0.05

# Samples count that are brighter than this share of the photographs' mean.
_LEAST = 0.05

Values = NDArray[Any]


def least_radiance(measured: Values) -> float:
    """Return the radiance below which samples of photographs tell nothing of their lights."""
    return _LEAST * float(np.nanmean(measured))


def log_ratio(
    measured: Values, radiance: Values, matte: Values, clipped: NDArray[np.bool_], least: float
) -> tuple[Values, Values]:
    """Return by what factor samples are brighter than a model has them, and how much that tells.

    Parameters
    ----------
    measured : ndarray of shape (...)
        Radiance as photographed.
    radiance, matte : ndarray of shape (...)
        As the model has it, with and without highlights.
    clipped : ndarray of shape (...), bool
    least : float
        Radiance that both must have; see `least_radiance`.

    Returns
    -------
    ratio : ndarray of shape (...)
        ln(measured / radiance); 0 where not usable.
    weight : ndarray of shape (...)
        The smaller of both, less where the model has a highlight; 0 where not usable. So neither highlights
        that the model misses nor shadows that it does not know count for much.
    """
    usable = (measured > least) & (radiance > least) & ~clipped
    measured, radiance, matte = (np.where(usable, values, 1.0) for values in (measured, radiance, matte))
    known = 1.0 / (1.0 + np.square((1.0 - matte / radiance) / _HIGHLIGHT))
    return np.log(measured / radiance), np.where(usable, np.minimum(measured, radiance) * known, 0.0)
