"""The relief that fits a field of normals best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn


def integrate_normals(normal: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the height whose slopes are nearest to those of the normals, by least squares.

    Errors of the normals add up along the way, so that what is far apart is less certain than what lies
    side by side.

    Parameters
    ----------
    normal : ndarray of shape (H, W, 3)
        Unit normals in the painting's frame; NaN, or facing away, counts as level.

    Returns
    -------
    ndarray of shape (H, W), float32
        Height towards the viewer in widths of a pixel, 0 in the mean.

    Notes
    -----
    Poisson's equation with free edges, ∇²z = ∇·(slopes), is diagonal in the cosine transform
    [Simchony1990]_. A slope between two pixels is the mean of theirs; rows run along −Y.
    """
    wide = np.asarray(normal, np.float64)
    known = np.isfinite(wide).all(axis=-1) & (wide[..., 2] > 0.05)
    z = np.where(known, wide[..., 2], 1.0)
    across = np.where(known, -wide[..., 0], 0.0) / z
    down = np.where(known, wide[..., 1], 0.0) / z
    height, width = known.shape
    divergence = np.zeros((height, width))
    between = (across[:, 1:] + across[:, :-1]) / 2
    divergence[:, :-1] += between
    divergence[:, 1:] -= between
    between = (down[1:] + down[:-1]) / 2
    divergence[:-1] += between
    divergence[1:] -= between
    rows = 2 * np.cos(np.pi * np.arange(height) / height) - 2
    columns = 2 * np.cos(np.pi * np.arange(width) / width) - 2
    eigenvalue = rows[:, np.newaxis] + columns
    eigenvalue[0, 0] = 1
    spectrum = dctn(divergence, type=2) / eigenvalue
    spectrum[0, 0] = 0
    return np.asarray(idctn(spectrum, type=2), np.float32)
