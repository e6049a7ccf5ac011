"""How strong the lights around a direction were, as far as the photographs' strengths tell it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from impasto.direction_table import node_directions
from impasto.fit.light_process import NOISES, left_out
from impasto.geometry import Array

TELLING = 0.85
"""Other lights tell the strength of a light where they lower the error to this share of it; of strengths that
have nothing to do with direction, chance lowers it by a few per cent."""

_LENGTHS = (0.3, 0.6, 1.2, 2.4, 4.8)

# Radians: narrower than the 20 to 45 degrees between the strokes in which a lamp is led around a painting.
_AZIMUTH = 0.3
_ZENITH = 0.15


@dataclass(frozen=True)
class HandKernel:
    """The covariance over direction of the strengths of a lamp that is led by hand.

    Parameters
    ----------
    length : float
        Of a Matérn kernel of order 3/2 over the distance of unit vectors: where the lamp is.
    azimuth, zenith : bool
        Whether lights of one azimuth, or of one zenith angle, have something in common besides: the hand
        leads the lamp along spokes or around in rings, and each is a little nearer or further away.
    """

    length: float
    azimuth: bool
    zenith: bool

    def __call__(self, first: Array, second: Array) -> Array:
        """Return the covariance of unit vectors (N, 3) and (M, 3), as (N, M)."""
        cosine = first @ second.T
        scaled = np.sqrt(3.0 * np.maximum(2.0 - 2.0 * cosine, 0.0)) / self.length
        result: Array = (1.0 + scaled) * np.exp(-scaled)
        if self.azimuth:
            # Times the sines of both zenith angles, since at the zenith all azimuths meet.
            sines = np.outer(np.hypot(*first.T[:2]), np.hypot(*second.T[:2]))
            along = (first[:, :2] @ second[:, :2].T) / np.maximum(sines, 1e-12)
            result = result + sines * np.exp((np.clip(along, -1.0, 1.0) - 1.0) / _AZIMUTH**2)
        if self.zenith:
            angles = [np.arccos(np.clip(each[:, 2], -1.0, 1.0)) for each in (first, second)]
            result = result + np.exp(-0.5 * np.square(np.subtract.outer(*angles) / _ZENITH))
        return result


def find_strength(direction: Array, departure: Array) -> dict[str, Any] | None:
    """Describe strengths by a Gaussian process over direction, where neighbours tell them.

    A lamp that is held by hand comes nearer on one side of the painting than on another: the strengths are
    smooth over direction, in ways that a quadratic trend does not follow.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
        Of the lights.
    departure : ndarray of shape (L, C)
        Logarithms of the strengths that their photographs were divided by.

    Returns
    -------
    dict or None
        Entry ``strength`` of the residual term; see docs/store.md. None where each light, left out, is not
        told from the others.
    """
    moments = departure @ departure.T / departure.shape[1]
    kernels = [HandKernel(*each) for each in product(_LENGTHS, (False, True), (False, True))]
    processes = [(kernel, noise) for kernel in kernels for noise in NOISES]
    noisy = [kernel(direction, direction) + noise * np.eye(len(direction)) for kernel, noise in processes]
    # Mean absolute errors: one number per light is too few for a geometric mean, which lucky ones rule.
    errors = [np.sqrt(left_out(gram, moments)).mean() for gram in noisy]
    best = int(np.argmin(errors))
    if not errors[best] < TELLING * np.sqrt(np.diag(moments)).mean():
        return None
    kernel, noise = processes[best]
    nodes = node_directions()
    table = kernel(nodes.reshape(-1, 3), direction) @ np.linalg.solve(noisy[best], departure)
    return {
        "length": kernel.length,
        "azimuth": kernel.azimuth,
        "zenith": kernel.zenith,
        "noise": float(noise),
        "table": np.round(table.T.reshape(-1, *nodes.shape[:2]), 4).tolist(),
    }
