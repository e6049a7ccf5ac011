"""The photographs of a plan, one by one, in the order in which they are taken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from impasto.stand.plan_file import Calibration, Plan

CALIBRATION = "calibration"
BRACKETS = "brackets"


@dataclass(frozen=True)
class Shot:
    """One photograph to be taken.

    Parameters
    ----------
    name : str
        Its path in the capture folder without ending, such as ``brackets/1/arm-30``: it names the photograph.
    kind : str
        What is before the camera; see `SUBJECTS`.
    place : str or None
        Where the lamp stands; None for no lamp.
    exposure_s : float
    bracket : int
        0 for the longest exposure.
    last : bool
        Whether it is the shortest exposure.
    """

    name: str
    kind: str
    place: str | None
    exposure_s: float
    bracket: int
    last: bool

    @property
    def painting(self) -> bool:
        """Whether it is one of those that are stacked."""
        return self.kind == "painting"

    @property
    def label(self) -> str:
        """The photograph in words."""
        where = "" if self.place is None else f" under {self.place}"
        return f"{self.kind}{where}, {shutter(self.exposure_s)}"


def shots(plan: Plan) -> list[Shot]:
    """Return all photographs of a plan.

    Notes
    -----
    What needs the painting away comes first, so that nobody touches the stand once it lies there; photographs
    of one subject, and within them of one place, follow each other.
    """
    before = [shot for shot in plan.file.calibration if not shot.after]
    after = [shot for shot in plan.file.calibration if shot.after]
    painting = [
        Shot(f"{BRACKETS}/{number}/{place.name}" if number else place.name, "painting", place.name, time,
             number, number == len(plan.times_s(place)) - 1)
        for place in plan.file.place
        for number, time in enumerate(plan.times_s(place))
    ]  # fmt: skip
    return [
        *(shot for entry in before for shot in _calibration(plan, entry)),
        *painting,
        *(shot for entry in after for shot in _calibration(plan, entry)),
    ]


def _calibration(plan: Plan, entry: Calibration) -> Iterator[Shot]:
    places = [place.name for place in plan.file.place] if entry.each_place else [entry.place]
    times = sorted(entry.times_s, reverse=True)
    for place in places:
        for number, time in enumerate(times):
            name = f"{entry.name}/{place}" if entry.each_place else entry.name
            suffix = f"_{number}" if number else ""
            last = number == len(times) - 1
            yield Shot(f"{CALIBRATION}/{name}{suffix}", entry.kind, place, time, number, last)


def shutter(seconds: float) -> str:
    """Return an exposure time as cameras show it: 1/60 s, 0.5 s."""
    return f"1/{1 / seconds:.0f} s" if seconds < 0.3 else f"{seconds:.3g} s"
