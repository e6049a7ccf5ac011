"""Exposure times from a metering shot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impasto.errors import CaptureError, Problem
from impasto.stand.look import look_at

# Where the longest exposure puts the paint, and the shortest the highlights, as shares of full scale.
_SHADOW, _MIDDLE, _HIGHLIGHT = 0.05, 0.5, 0.7
_SHADOW_PERCENT, _HIGHLIGHT_PERCENT = 10, 99.9
# Two exposures further apart than three stops leave noise between them; see docs/calibration.md.
_LARGEST_STEP = 8.0
_MOST = 5
# Highlights that clip in the metering shot are taken to be brighter by this factor.
_BEYOND = 8.0
# Grazing lights get longer exposures, but not without end.
_LONGEST_FACTOR = 4.0


@dataclass(frozen=True)
class Metering:
    """What a metering shot says, for the lamp under which it was taken.

    Parameters
    ----------
    longest_s, shortest_s : float
        Exposures that suit the shadows and the highlights.
    clipped : float
        Share of its samples that are clipped: how bright those are, it does not tell.
    photograph_mb : float
        Size of its file.
    """

    longest_s: float
    shortest_s: float
    clipped: float
    photograph_mb: float

    def times_s(self, cosine: float, metered_cosine: float, count: int | None = None) -> list[float]:
        """Return the exposures of a light, longest first.

        Parameters
        ----------
        cosine, metered_cosine : float
            Of the light's and of the metering shot's angle from the painting's normal: the paint's radiance
            goes with it, that of highlights does not.
        count : int, optional
            How many exposures; by default as many as steps of at most three stops need.
        """
        longest = self.longest_s * float(np.clip(metered_cosine / cosine, 1.0, _LONGEST_FACTOR))
        count = self.count() if count is None else count
        if count == 1:
            return [rounded(longest)]
        times = np.geomspace(longest, min(self.shortest_s, longest / 2), count)
        return [rounded(float(time)) for time in times]

    def count(self) -> int:
        """Return how many exposures the most inclined light needs."""
        ratio = max(1.0, _LONGEST_FACTOR * self.longest_s / self.shortest_s)
        return int(min(_MOST, 1 + np.ceil(np.log(ratio) / np.log(_LARGEST_STEP))))

    def remarks(self) -> Iterator[str]:
        """Yield what a person should know about it."""
        if self.clipped > 1 - _HIGHLIGHT_PERCENT / 100:
            yield (
                f"{self.clipped:.1%} of the metering shot's samples are clipped: its highlights were taken "
                f"to be {_BEYOND:g} times full scale. Meter again with a shorter exposure to know"
            )


def meter(photograph: Path, exposure_s: float | None = None) -> Metering:
    """Read a metering shot: the painting under one lamp, best the one whose highlights are brightest.

    Parameters
    ----------
    photograph : Path
    exposure_s : float, optional
        Its exposure time, if the file does not say it.

    Raises
    ------
    CaptureError
        If it cannot be read, is black, or nobody knows its exposure time.
    """
    look = look_at(photograph)
    time = exposure_s or look.photograph.exposure_s
    problems = []
    if not time:
        do = "Give it: --meter-exposure-s SECONDS"
        problems.append(Problem(photograph.name, "does not say its exposure time", do))
    shadow, middle = np.percentile(look.reduced, [_SHADOW_PERCENT, 50])
    if middle <= 0:
        do = "See that the lamp is on and the cap is off, and expose longer"
        problems.append(Problem(photograph.name, "is black", do))
    if problems:
        raise CaptureError(problems)
    assert time
    bins = look.histogram.shape[1]
    share = np.cumsum(look.histogram.sum(axis=0)) / look.histogram.sum()
    bright = ((np.searchsorted(share, _HIGHLIGHT_PERCENT / 100) + 1) / bins) ** 2
    if look.clipped > 1 - _HIGHLIGHT_PERCENT / 100:
        bright = _BEYOND
    longest = time * min(_SHADOW / max(float(shadow), 1e-6), _MIDDLE / float(middle))
    shortest = min(longest, time * _HIGHLIGHT / float(bright))
    return Metering(longest, shortest, look.clipped, photograph.stat().st_size / 1e6)


def rounded(seconds: float) -> float:
    """Return an exposure time in thirds of a stop, as cameras have them."""
    return float(f"{2 ** (round(3 * np.log2(seconds)) / 3):.4g}")
