"""Were the lamps lit in the planned order?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from impasto.geometry import Array
from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look

_LEAST_LIGHTS = 8
_NEIGHBOURS = 3
# Two photographs are exchanged if each then resembles its neighbours better by this factor (geometric mean).
# Measured: at most 1.5 in orderly series of 12 to 72 lights, mostly above 1.6 for exchanges beyond 25°.
_FACTOR = 1.6
_SAMPLES = 4000


def exchanged(names: Sequence[str], looks: Sequence[Look], direction: Array) -> list[Finding]:
    """Return pairs of photographs whose lamps seem to be exchanged.

    Parameters
    ----------
    names : sequence of str, length L
    looks : sequence of Look, length L
        The longest exposures, `thinned`.
    direction : ndarray of shape (L, 3)
        Where the plan has their lamps.

    Notes
    -----
    Photographs under neighbouring lamps resemble each other most. Two are exchanged if, with their lamps
    exchanged, they resemble their neighbours clearly better. Whether all lamps are turned or mirrored, this
    cannot tell: mirror spheres do.
    """
    if len(names) < _LEAST_LIGHTS:
        return []
    unlike = _unlikeness(looks)
    angle = np.degrees(np.arccos(np.clip(direction @ direction.T, -1, 1)))
    order = np.argsort(angle, axis=1)
    findings: list[Finding] = []
    taken: set[int] = set()
    pairs = ((_gain(unlike, order, a, b), a, b) for a in range(len(names)) for b in range(a))
    for gain, a, b in sorted(pairs, reverse=True):
        if gain < _FACTOR:
            break
        if taken & {a, b}:
            continue
        taken |= {a, b}
        what = f"look as if their lamps were exchanged ({angle[a, b]:.0f}° apart; {gain:.1f} times likelier)"
        do = "See which lamp lights at each of the two places, then take both again"
        findings.append(Finding("order", (names[b], names[a]), what, do))
    return findings


def _gain(unlike: Array, order: NDArray[np.intp], a: int, b: int) -> float:
    """Return by which factor two photographs are more like their neighbours when exchanged."""

    def cost(photograph: int, place: int) -> float:
        near = [other for other in order[place] if other not in (a, b)][:_NEIGHBOURS]
        return max(float(unlike[photograph, near].mean()), 1e-9)

    return float(np.sqrt(cost(a, a) * cost(b, b) / (cost(a, b) * cost(b, a))))


def _unlikeness(looks: Sequence[Look]) -> Array:
    """Return 1 - the correlation of what is special to each photograph, shape (L, L)."""
    levels = []
    for look in looks:
        image = gaussian_filter(look.parts[0].astype(np.float64), 1.0)
        levels.append(image.ravel()[:: max(1, image.size // _SAMPLES)])
    special = np.array(levels) - np.mean(levels, axis=0)
    special -= special.mean(axis=1, keepdims=True)
    norm = np.maximum(np.linalg.norm(special, axis=1), 1e-12)
    return np.asarray(1 - special @ special.T / np.outer(norm, norm))
