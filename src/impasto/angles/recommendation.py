"""The smallest number of photographs that serves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from impasto.angles.refit import Errors
from impasto.angles.study import Point, Study
from impasto.errors import OptionError, Problem

USUAL = {"rms": 5.0, "ciede2000": 1.0, "psnr": 0.5}
"""The tolerance of each measure unless another is asked for: per cent, colour difference and decibels."""


@dataclass(frozen=True)
class Tolerance:
    """How much worse than the fit to all photographs a fit to fewer may be.

    Parameters
    ----------
    measure : str
        ``rms``: its RMS by at most `limit` per cent more; ``ciede2000``: the 95th percentile of the colour
        difference between both renderings at most `limit`; ``psnr``: at most `limit` decibels less.
    limit : float
    """

    measure: str = "rms"
    limit: float = USUAL["rms"]

    @property
    def displayed(self) -> bool:
        """Whether renderings are judged as pictures rather than by their radiance."""
        return self.measure != "rms"

    def allows(self, errors: Errors, full: Errors) -> bool:
        """Return whether errors are within the tolerance of those of the fit to all photographs."""
        if self.measure == "rms":
            return errors.rms <= full.rms * (1 + self.limit / 100)
        if self.measure == "ciede2000":
            return errors.ciede2000 <= self.limit
        return errors.psnr_db >= full.psnr_db - self.limit

    def __str__(self) -> str:
        words = {
            "rms": f"RMS within {self.limit:g} %",
            "ciede2000": f"95 % of the colours within CIEDE2000 {self.limit:g}",
            "psnr": f"PSNR within {self.limit:g} dB",
        }
        return words[self.measure]


def tolerance(measure: str = "rms", limit: float | None = None) -> Tolerance:
    """Return a tolerance, the usual one of a measure unless a limit is given.

    Raises
    ------
    OptionError
        If there is no such measure, or the limit is not above 0.
    """
    problems = []
    if measure not in USUAL:
        problems.append(Problem("--measure", f"there is no {measure!r}", f"Choose from {', '.join(USUAL)}"))
    if limit is not None and not 0 < limit < float("inf"):
        problems.append(
            Problem("--tolerance", f"is {limit:g}, expected above 0", "Try 5 (per cent) for --measure rms")
        )
    if problems:
        raise OptionError(problems)
    return Tolerance(measure, USUAL[measure] if limit is None else limit)


def recommend(study: Study, strategy: str, sizes: Sequence[int], allowed: Tolerance) -> Point:
    """Return the smallest set of a strategy from which on the error stays within the tolerance.

    Parameters
    ----------
    study : Study
    strategy : str
    sizes : sequence of int
        The sizes examined; between the last of them that fails and those that serve, the interval is halved.
    allowed : Tolerance

    Returns
    -------
    Point
        That of all photographs, if no smaller number serves.
    """

    def serves(size: int) -> bool:
        return allowed.allows(study.point(strategy, size).errors, study.full)

    examined = sorted({*sizes, len(study.candidates)})
    most = examined.pop()
    while examined and serves(examined[-1]):
        most = examined.pop()
    fails = examined[-1] if examined else most - 1
    while most - fails > 1:
        middle = (fails + most) // 2
        fails, most = (fails, middle) if serves(middle) else (middle, most)
    return study.point(strategy, most)
