"""The error of renderings against the number of photographs, for several ways to choose them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from impasto.angles.expected import MOST, Expected, expect
from impasto.angles.photographed import Photographed
from impasto.angles.placement import even_lights, highlight_density, informed_lights, random_lights
from impasto.angles.refit import Errors, Refit, Score
from impasto.angles.search import exhaustive, greedy_exchange
from impasto.errors import OptionError, Problem
from impasto.models import ModelSpec
from impasto.pixels import Pixels

CHOSEN, BEST = "optimal", "exhaustive"
STRATEGIES = (CHOSEN, "even", "informed")
"""The ways to choose that are judged by all errors; `BEST` joins them where candidates are few."""

EXHAUSTIVE_LIGHTS = 20


@dataclass(frozen=True)
class Point:
    """What one set of photographs comes to.

    Parameters
    ----------
    strategy : str
        How it was chosen: ``optimal``, ``even``, ``informed`` by the highlights, or ``exhaustive``.
    size : int
        How many photographs.
    photographs : tuple of str
        Their names.
    expected : float
        What the criterion expects under the candidates themselves: of `errors.rms`, or, where sets are judged
        as pictures, of `errors.psnr_db`.
    errors : Errors
        Verified: the pixels were fitted again from these photographs, and rendered.
    """

    strategy: str
    size: int
    photographs: tuple[str, ...]
    expected: float
    errors: Errors


@dataclass(frozen=True)
class Random:
    """RMS of random sets of a size: median, and 5th and 95th percentile."""

    size: int
    median: float
    low: float
    high: float


class Study:
    """The choice among candidates for one model, made without the photographs that judge it.

    Parameters
    ----------
    pixels : Photographed
    refit : Refit
    candidates : sequence of int
        Numbers of the photographs to choose from.
    scored : sequence of int
        Numbers of those that judge.
    displayed : bool, optional
        Whether sets are chosen for renderings as sRGB pictures; see `expect`.
    seed : int, optional

    Raises
    ------
    OptionError
        If no pixel has a full fit from all candidates.
    """

    def __init__(
        self,
        pixels: Photographed,
        refit: Refit,
        candidates: Sequence[int],
        scored: Sequence[int],
        *,
        displayed: bool = False,
        seed: int = 0,
    ) -> None:
        self._displayed = displayed
        self.pixels, self.refit = pixels, refit
        self.candidates = np.asarray(candidates, np.intp)
        self.lights = pixels.stack.lights.select(self.candidates)
        self._seed = seed
        self._score = Score(pixels, scored)
        fitted = refit(pixels, self.candidates.tolist())
        whole = np.flatnonzero(fitted.whole)
        if not len(whole):
            raise OptionError(
                Problem(
                    where=f"--model {refit.model.name}",
                    what=f"none of {len(pixels)} pixels could be fitted from all {len(self.candidates)} "
                    "photographs",
                    do="Look at the status map of impasto fit: are the photographs clipped or dark?",
                )
            )
        self._score.refer_to(fitted)
        self.full = self._score.errors(fitted)
        chosen = np.sort(np.random.default_rng(seed).permutation(whole)[:MOST])
        self.typical: Pixels = fitted.select(chosen)
        self.expected: Expected = expect(
            self.typical,
            self.lights,
            pixels.camera,
            pixels.stack.noise,
            pixels.stack.clip_level,
            pixels.radiance[self.candidates][:, chosen],
            displayed=displayed,
        )
        self.density = highlight_density(self.typical, self.lights, pixels.camera)
        self._points: dict[tuple[str, int], Point] = {}
        self._chooses: dict[str, Callable[[int], tuple[int, ...]]] = {
            CHOSEN: lambda size: greedy_exchange(self.expected.criterion, size),
            "even": lambda size: even_lights(self.lights.direction, size),
            "informed": lambda size: informed_lights(self.lights.direction, self.density, size),
            BEST: lambda size: exhaustive(self.expected.criterion, size),
        }

    @property
    def strategies(self) -> tuple[str, ...]:
        """The ways to choose that can be compared."""
        few = len(self.candidates) <= EXHAUSTIVE_LIGHTS
        return (*STRATEGIES, BEST) if few else STRATEGIES

    def point(self, strategy: str, size: int) -> Point:
        """Return what a set comes to; asked twice, it is computed once."""
        if (strategy, size) not in self._points:
            chosen = self._chooses[strategy](size)
            fitted = self._refit(chosen)
            self._points[strategy, size] = Point(
                strategy,
                size,
                tuple(self.lights.names[light] for light in chosen),
                self.expect(chosen),
                self._score.errors(fitted),
            )
        return self._points[strategy, size]

    def expect(self, chosen: tuple[int, ...]) -> float:
        """Return `Point.expected` of a set of candidates."""
        rms = self.expected.rms(chosen)
        return -20 * float(np.log10(max(rms, 1e-6))) if self._displayed else rms

    def random(self, size: int, draws: int) -> Random:
        """Return the RMS of random sets of a size."""
        sets = random_lights(len(self.candidates), size, draws, seed=self._seed)
        if size == len(self.candidates):
            sets = sets[:1]
        found = [self._score.rms(self._refit(each)) for each in sets]
        low, median, high = np.percentile(found, [5, 50, 95]).tolist()
        return Random(size, median, low, high)

    def _refit(self, chosen: Sequence[int]) -> Pixels:
        return self.refit(self.pixels, self.candidates[list(chosen)].tolist())

    def of(self, pixels: Photographed) -> Study:
        """Return the same study of other pixels."""
        scored = self._score.numbers
        return Study(
            pixels,
            self.refit,
            self.candidates.tolist(),
            scored,
            displayed=self._displayed,
            seed=self._seed,
        )


def usual_sizes(least: int, most: int, count: int = 10) -> list[int]:
    """Return about `count` numbers of photographs, from `least` to `most`, in nearly equal ratios."""
    sizes = np.unique(np.round(np.geomspace(least, most, count)).astype(int))
    return [int(size) for size in sizes]


def least_lights(model: ModelSpec) -> int:
    """Return how many lights a fit of a model needs."""
    return 2 + len(model.shape) + 1 + model.lobes + int(model.ambient)
