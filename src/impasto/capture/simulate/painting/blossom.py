"""The still life's blossoming branch.

Studio millimetres from the painting's centre, y down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.painting.brushwork import vary
from impasto.capture.simulate.painting.paints import mix
from impasto.capture.simulate.painting.strokes import Stroke

# Stems as quadratic curves (start, turn, end), and how far along each its blossoms sit.
STEMS = (
    (((-13, -14), (-19, -28), (-33, -38)), (0.52, 0.80, 1.0)),
    (((-12, -14), (-15, -32), (-10, -45)), (0.50, 0.78, 1.0)),
    (((-11, -14), (-4, -28), (11, -36)), (0.55, 0.82, 1.0)),
    (((-14, -14), (-25, -18), (-38, -18)), (0.62, 1.0)),
)
LEAF = mix(("terre verte", 1.0))


def stems(rng: np.random.Generator) -> Iterator[Stroke]:
    """Stems and leaves rising from the jug."""
    bark = mix(("burnt sienna", 0.4), ("raw umber", 0.6))
    lit = mix(("terre verte", 0.5), ("lead-tin yellow", 0.5))
    shade = mix(("terre verte", 0.6), ("ultramarine", 0.25), ("raw umber", 0.15))
    for stem, _ in STEMS:
        for t in np.arange(0.04, 1.0, 0.11):
            size = (5.4, 1.35 - 0.5 * t, 0.26)
            yield Stroke(_along(stem, t), size, "raw umber", (vary(rng, bark, 0.15), LEAF))
        for number, t in enumerate(np.arange(0.28, 1.0, 0.13)):
            x, y, angle = _along(stem, t)
            turn = angle + (0.95 if number % 2 else -0.95) + rng.normal(0, 0.2)
            length = rng.uniform(4.6, 6.6)
            x, y = x + 0.55 * length * np.cos(turn), y + 0.55 * length * np.sin(turn)
            for side, colour in ((-0.55, shade), (0.55, lit if number % 3 else LEAF)):  # halves of a leaf
                yield Stroke(
                    (x - side * np.sin(turn), y + side * np.cos(turn), turn),
                    (length, 2.0, 0.24),
                    "terre verte",
                    (vary(rng, colour, 0.12), LEAF),
                    bend=0.5 * side,
                    taper=0.9,
                )


def blossom(rng: np.random.Generator) -> Iterator[Stroke]:
    """Blossoms in thick lead white, five touches of the brush each."""
    white, rose = mix(("lead white", 1.0)), mix(("lead white", 0.82), ("vermilion", 0.18))
    heart = mix(("lead-tin yellow", 0.8), ("vermilion", 0.2))
    for stem, places in STEMS:
        for t in places:
            x, y, _ = _along(stem, t)
            x, y = x + rng.normal(0, 1.4), y + rng.normal(0, 1.4)
            radius, start = rng.uniform(2.1, 2.9), rng.uniform(0, 2 * np.pi)
            for petal in start + np.arange(5) * 2 * np.pi / 5 + rng.normal(0, 0.1, 5):
                yield Stroke(
                    (x + radius * np.cos(petal), y + radius * np.sin(petal), petal),
                    (1.9 * radius, 1.45 * radius, 0.42),
                    "lead white",
                    (vary(rng, white, 0.03), rose),
                    bend=rng.normal(0, 0.3),
                    taper=0.55,
                )
            for _ in range(3):
                place = (x + rng.normal(0, 0.5), y + rng.normal(0, 0.5), rng.uniform(0, np.pi))
                yield Stroke(place, (1.6, 1.1, 0.45), "lead-tin yellow", (vary(rng, heart, 0.1), heart))


def _along(stem: tuple[tuple[float, float], ...], t: float) -> tuple[float, float, float]:
    """Return the place at `t` on a stem and the stem's direction there."""
    a, b, c = (np.array(point, dtype=np.float64) for point in stem)
    place: NDArray[np.float64] = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c
    way = 2 * (1 - t) * (b - a) + 2 * t * (c - b)
    return float(place[0]), float(place[1]), float(np.arctan2(way[1], way[0]))
