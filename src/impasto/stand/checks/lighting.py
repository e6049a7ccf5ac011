"""Did the planned lamp light the painting, and nothing else?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impasto.geometry import Array
from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

# A lamp near another may light the painting by this factor more or less than the cosine says: lamps differ,
# paint is no perfect diffuser, and relief throws shadows at grazing angles.
_FACTOR = 5.0
_NEAR_DEG = 35.0
# Pixels count that have this share of the other photograph's bright ones: neither black cloth nor shadows.
_LIT = 0.1
# Less than this share of full scale is no light at all.
_BLACK = 0.005


def fired(
    look: Look, shot: Shot, irradiance: float, others: Sequence[tuple[Look, float, float]]
) -> list[Finding]:
    """Return whether a lamp is as bright on the painting as those near it.

    Parameters
    ----------
    look, shot
        The longest exposure of a light.
    irradiance : float
        What the plan expects on the painting: cosine x gain x exposure time, in any unit.
    others : sequence of (Look, float, float)
        Photographs before, `thinned`, each with the same expectation and its angle from this lamp in degrees.
    """
    near = sorted((other for other in others if other[2] <= _NEAR_DEG), key=lambda other: other[2])[:3]
    if not near:
        if look.bright > _BLACK:
            return []
        what = f"reads {look.bright:.2%} of full scale: there is no light"
    else:
        ratio = float(np.median([_ratio(look, other) * other[1] for other in near if other[1]]) / irradiance)
        if 1 / _FACTOR <= ratio <= _FACTOR:
            return []
        if ratio > _FACTOR:
            what = f"is {ratio:.1f} times as bright as lamps near it lead to expect"
            do = "See that no other lamp and no room light is on, then take it again"
            return [Finding("light", (shot.name,), what, do)]
        what = f"shows {ratio:.1%} of the light that lamps near it lead to expect"
    return [Finding("light", (shot.name,), f"{what}; the lamp did not fire, or not fully", "Take it again")]


def ambient(look: Look, shot: Shot, others: Sequence[tuple[Look, Shot]], limits: Limits) -> list[Finding]:
    """Return whether the room is dark enough, from a photograph with all lamps off.

    Parameters
    ----------
    look, shot
        The photograph without a lamp.
    others : sequence of (Look, Shot)
        Photographs under lamps, `thinned`.
    limits : Limits
    """
    if not others:
        return []
    lit = float(np.median([other.bright / at.exposure_s for other, at in others]))
    share = look.bright / shot.exposure_s / lit
    if share <= limits.ambient:
        return []
    what = f"the room gives {share:.1%} of the light of a lamp, at most {limits.ambient:.1%} planned"
    do = "Darken the room; what was taken in this light may have to be taken again"
    return [Finding("ambient", (shot.name,), what, do)]


def angles_deg(direction: Array, others: Array) -> Array:
    """Return the angles between a direction (3,) and others (N, 3) in degrees."""
    return np.asarray(np.degrees(np.arccos(np.clip(others @ direction, -1, 1))))


def _ratio(look: Look, other: tuple[Look, float, float]) -> float:
    """Return the median ratio of two pictures, which highlights do not change."""
    a, b = look.small, other[0].reduced
    usable = np.isfinite(a) & np.isfinite(b) & (b > _LIT * other[0].bright)
    return float(np.median(a[usable] / b[usable])) if usable.any() else 1 / max(other[1], 1e-12)
