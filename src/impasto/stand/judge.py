"""Judge photographs one by one, each against those before it, and the series at its end."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from impasto.geometry import Array, Camera, Lights
from impasto.stand.checks import exposure, lighting, movement, order, sharpness
from impasto.stand.checks.coverage import LEAST_LIGHTS, Coverage, coarse_radiance, coverage
from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

_REFERENCES = 4
# What is darker than this share of full scale shows its noise as edges.
_LEAST_BRIGHT = 0.01


@dataclass(frozen=True)
class Seen:
    """A photograph that was accepted."""

    shot: Shot
    look: Look


class Judge:
    """What is remembered of the photographs of a capture, and what follows for the next.

    Parameters
    ----------
    lights : Lights
        Where the plan has the lamps; the names are those of `Shot.place`.
    camera : Camera
    limits : Limits

    Attributes
    ----------
    shift_px : dict of str to (float, float)
        By how many columns and rows each photograph lay off those near it when it was last judged; NaN where
        nobody can tell.
    """

    def __init__(self, lights: Lights, camera: Camera, limits: Limits) -> None:
        self.lights, self.camera, self.limits = lights, camera, limits
        self._number = {name: number for number, name in enumerate(lights.names)}
        self._seen: dict[str, Seen] = {}
        self._digests: dict[str, str] = {}
        self.shift_px: dict[str, tuple[float, float]] = {}

    def judge(self, shot: Shot, look: Look) -> list[Finding]:
        """Return what is wrong with a photograph, given those that were accepted."""
        # Uniform pictures have no digest.
        twin = self._digests.get(look.pixels_sha256, shot.name) if look.pixels_sha256 else shot.name
        if twin != shot.name:
            what = f"has the same pixels as {twin}: the camera or its program gave a photograph twice"
            return [Finding("duplicate", (shot.name,), what, "Take it again")]
        dark = exposure.dark(look, shot, self.limits)
        findings = [*exposure.clipped(look, shot, self.limits), *dark]
        if shot.kind == "ambient":
            findings += lighting.ambient(look, shot, self._lit(), self.limits)
        if not shot.painting:
            return findings
        if shot.bracket:
            findings += self._against_longer(shot, look)
        else:
            fired = lighting.fired(look, shot, self._irradiance(shot), self._expected(shot))
            if fired:
                return fired  # what a lamp that is off leads to needs no saying
            findings += self._still_and_sharp(shot, look)
        return findings

    def accept(self, shot: Shot, look: Look) -> None:
        """Remember a photograph."""
        self._digests[look.pixels_sha256] = shot.name
        if shot.kind in ("painting", "ambient"):
            self._seen[shot.name] = Seen(shot, look.thinned(parts=shot.painting))
        if shot.painting and shot.last:
            # Parts are large, and those of shorter exposures serve only the next shorter one.
            for seen in self._at(shot):
                if seen.shot.bracket:
                    self._seen[seen.shot.name] = Seen(seen.shot, seen.look.thinned(parts=False))

    def forget(self, name: str) -> None:
        """Forget a photograph that is to be taken again."""
        self._seen.pop(name, None)
        self._digests = {digest: other for digest, other in self._digests.items() if other != name}

    def series(self) -> list[Finding]:
        """Return what shows only when all lights are seen: their order, and each against all near it."""
        return [
            *self.order(),
            *(finding for seen in self._longest() for finding in self._still_and_sharp(seen.shot, seen.look)),
        ]

    def order(self) -> list[Finding]:
        """Return which lamps seem to be exchanged."""
        long = list(self._longest())
        names = [seen.shot.name for seen in long]
        return order.exchanged(names, [seen.look for seen in long], self._directions(long))

    def room(self) -> list[Finding]:
        """Return whether the room was dark enough, once lamps were seen too."""
        return [
            finding
            for seen in self._seen.values()
            if seen.shot.kind == "ambient"
            for finding in lighting.ambient(seen.look, seen.shot, self._lit(), self.limits)
        ]

    def coverage(self) -> Coverage | None:
        """Return what a coarse fit of the lights so far says of the highlights; None for too few."""
        lit: dict[str, list[Seen]] = {}
        for seen in self._seen.values():
            if seen.shot.painting:
                lit.setdefault(str(seen.shot.place), []).append(seen)
        groups = [sorted(group, key=lambda seen: seen.shot.bracket) for group in lit.values()]
        groups = [group for group in groups if group[-1].shot.last and group[0].shot.bracket == 0]
        if len(groups) < LEAST_LIGHTS:
            return None
        radiance = coarse_radiance(
            [[(seen.look, seen.shot.exposure_s) for seen in group] for group in groups]
        )
        chosen = self.lights.select(np.array([self._number[str(group[0].shot.place)] for group in groups]))
        return coverage(radiance, chosen, self.camera)

    def _still_and_sharp(self, shot: Shot, look: Look) -> list[Finding]:
        near = self._near(shot)
        shift = movement.shift_px(look, near) if near else None
        self.shift_px[shot.name] = shift or (math.nan, math.nan)
        return [
            *movement.moved(shift, shot, self.limits),
            *sharpness.blurred(look, shot, near, self.limits, alike=shift is not None),
        ]

    def _against_longer(self, shot: Shot, look: Look) -> list[Finding]:
        longer = [seen for seen in self._at(shot) if seen.shot.bracket < shot.bracket]
        if not longer:
            return []
        nearest = max(longer, key=lambda seen: seen.shot.bracket)
        findings = exposure.exposure_ratio(look, shot, nearest.look, nearest.shot)
        detailed = [seen for seen in longer if seen.look.parts]
        if detailed and look.bright >= _LEAST_BRIGHT:
            other = max(detailed, key=lambda seen: seen.shot.bracket)
            shift = movement.shift_px(look, [other.look])
            findings += movement.moved(shift, shot, self.limits, other.shot)
        return findings

    def _at(self, shot: Shot) -> list[Seen]:
        """Return the photographs of the painting under the lamp of a shot."""
        return [seen for seen in self._seen.values() if seen.shot.painting and seen.shot.place == shot.place]

    def _longest(self) -> Iterable[Seen]:
        return (seen for seen in self._seen.values() if seen.shot.painting and not seen.shot.bracket)

    def _lit(self) -> list[tuple[Look, Shot]]:
        return [(seen.look, seen.shot) for seen in self._longest()]

    def _near(self, shot: Shot) -> list[Look]:
        """Return the photographs whose lamps are nearest to that of a shot."""
        others = [seen for seen in self._longest() if seen.shot.place != shot.place]
        if not others:
            return []
        angle = lighting.angles_deg(self._direction(shot), self._directions(others))
        return [others[number].look for number in np.argsort(angle)[:_REFERENCES]]

    def _expected(self, shot: Shot) -> list[tuple[Look, float, float]]:
        others = [seen for seen in self._longest() if seen.shot.place != shot.place]
        if not others:
            return []
        angle = lighting.angles_deg(self._direction(shot), self._directions(others))
        return [
            (seen.look, self._irradiance(seen.shot), float(off))
            for seen, off in zip(others, angle, strict=True)
        ]

    def _irradiance(self, shot: Shot) -> float:
        number = self._number[str(shot.place)]
        gain = float(self.lights.intensity[number].mean())
        return float(self.lights.direction[number, 2]) * gain * shot.exposure_s

    def _direction(self, shot: Shot) -> Array:
        return np.asarray(self.lights.direction[self._number[str(shot.place)]])

    def _directions(self, seen: list[Seen]) -> Array:
        return np.array([self._direction(each.shot) for each in seen]).reshape(-1, 3)
