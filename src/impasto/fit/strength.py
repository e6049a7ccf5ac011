"""How strong the lights around a direction were, as far as the photographs' strengths tell it."""

from __future__ import annotations

from typing import Any

import numpy as np

from impasto.fit.light_process import rounded, usual_processes
from impasto.geometry import Array

TELLING = 0.85
"""Other lights tell the strength of a light where they lower the error to this share of it; of strengths that
have nothing to do with direction, chance lowers it by a few per cent."""


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
    # Mean absolute errors: one number per light is too few for a geometric mean, which lucky ones rule.
    processes = usual_processes(direction)
    errors = [np.sqrt(process.left_out(moments)).mean() for process in processes]
    process = processes[int(np.argmin(errors))]
    if not min(errors) < TELLING * np.sqrt(np.diag(moments)).mean():
        return None
    weights = np.asarray(np.linalg.solve(process.gram(), departure).T, np.float64)
    return {"length": process.length, "noise": process.noise, "weights": rounded(weights)}
