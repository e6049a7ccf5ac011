"""Is a photograph exposed as planned?"""

from __future__ import annotations

import numpy as np

from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot, shutter

# Of full scale: a cap lets nothing through.
_CAP = 0.02
# Cards and targets must not clip at all; a few hot pixels do.
_TARGET_CLIPPED = 1e-4
# Brackets whose ratio departs by more than this from their times: `stack` refuses them from there on.
_RATIO = 0.12
_FROM, _TO = 0.02, 0.8
# Cameras have times in thirds of a stop, and round them when they write them down.
_NOTED = 0.2
_LEAST_BLOCKS = 30


def clipped(look: Look, shot: Shot, limits: Limits) -> list[Finding]:
    """Return whether too much is at full scale: in the shortest exposure, or in a target's any."""
    target = shot.kind in ("white", "grey-scale", "colour")
    if not (target or (shot.painting and shot.last)):
        return []
    limit = _TARGET_CLIPPED if target else limits.clipped
    if look.clipped <= limit:
        return []
    which = "" if target else ", and there is no shorter exposure"
    return [
        Finding(
            "clipped",
            (shot.name,),
            f"{look.clipped:.2%} of the samples are at full scale, at most {limit:.2%} planned{which}",
            f"Shorten its exposure of {shutter(shot.exposure_s)} in the plan, or move the lamp away",
        )
    ]


def dark(look: Look, shot: Shot, limits: Limits) -> list[Finding]:
    """Return whether the longest exposure is too short, or a dark frame is none."""
    if shot.kind == "dark":
        if look.bright <= _CAP:
            return []
        what = f"a dark frame reads {look.bright:.1%} of full scale, expected below {_CAP:.0%}"
        return [Finding("dark", (shot.name,), what, "Put the cap on the lens")]
    if shot.kind in ("ambient", "spheres") or shot.bracket or look.bright >= limits.dark:
        return []
    what = (
        f"19 of 20 pixels are below {look.bright:.1%} of full scale in the longest exposure; planned is that "
        f"the brightest reach {limits.dark:.0%}"
    )
    do = f"See that the lamp is on and the cap is off, or lengthen {shutter(shot.exposure_s)} in the plan"
    return [Finding("dark", (shot.name,), what, do)]


def as_planned(look: Look, shot: Shot) -> list[Finding]:
    """Return whether the camera says another exposure time than the plan, which the manifest repeats."""
    noted = look.photograph.exposure_s
    if not noted or 1 / (1 + _NOTED) <= noted / shot.exposure_s <= 1 + _NOTED:
        return []
    what = f"was exposed for {shutter(noted)} by its EXIF data, planned are {shutter(shot.exposure_s)}"
    return [Finding("exposure", (shot.name,), what, "Set the camera to the planned time, then take it again")]


def exposure_ratio(look: Look, shot: Shot, longer: Look, longer_shot: Shot) -> list[Finding]:
    """Return whether two exposures of one light differ by what their times say.

    Parameters
    ----------
    look, shot
        The shorter exposure.
    longer, longer_shot
        The next longer one of the same light, `thinned`.
    """
    a, b = look.small, longer.reduced
    stated = shot.exposure_s / longer_shot.exposure_s
    usable = np.isfinite(a) & np.isfinite(b) & (b < _TO) & (a > _FROM * min(1.0, 10 * stated))
    if np.count_nonzero(usable) < _LEAST_BLOCKS:
        return []
    seen = float(np.median(a[usable] / b[usable]))
    if abs(seen / stated - 1) <= _RATIO:
        return []
    what = (
        f"shows {seen:.3g} times the light of {longer_shot.name}, expected {stated:.3g} by their exposure "
        "times"
    )
    do = "See that the camera took the exposure time, and that the lamp does not flicker or fade"
    return [Finding("exposure", (shot.name,), what, do)]
