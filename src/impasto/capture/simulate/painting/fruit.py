"""The still life's fruit: two pomegranates and a lemon.

Studio millimetres from the painting's centre, y down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impasto.capture.simulate.painting.brushwork import Ramp, around, scatter, tone, underpaint, vary
from impasto.capture.simulate.painting.paints import mix
from impasto.capture.simulate.painting.strokes import Stroke

ORANGE = mix(("vermilion", 0.5), ("lead-tin yellow", 0.5))
LAKE = mix(("madder lake", 0.55), ("vermilion", 0.45))
POMEGRANATE = (
    (-0.6, mix(("madder lake", 0.7), ("ivory black", 0.3))),
    (0.05, LAKE),
    (0.55, mix(("vermilion", 1.0))),
    (0.95, ORANGE),
)
PALE = mix(("lead-tin yellow", 0.45), ("lead white", 0.55))
LEMON = (
    (-0.6, mix(("yellow ochre", 0.5), ("terre verte", 0.5))),
    (0.1, mix(("lead-tin yellow", 0.6), ("yellow ochre", 0.4))),
    (0.6, mix(("lead-tin yellow", 1.0))),
    (1.0, PALE),
)


def fruit(rng: np.random.Generator) -> Iterator[Stroke]:
    """All the fruit, back to front."""
    yield from _pomegranate(rng, 30.0, 28.5, 8.2)
    yield from _pomegranate(rng, 13.0, 24.5, 10.4)
    yield from _ball(rng, (-3.0, 37.0, 0.28), (8.6, 5.9), "lead-tin yellow", LEMON)
    tip = (LEMON[2][1], LEMON[0][1])
    yield Stroke((5.6, 39.6, 0.3), (3.2, 2.0, 0.3), "lead-tin yellow", tip)
    light = (mix(("lead white", 1.0)), PALE)
    yield Stroke((-5.6, 34.0, -0.25), (3.2, 1.4, 0.42), "lead white", light, bend=0.3)


def _pomegranate(rng: np.random.Generator, x: float, y: float, radius: float) -> Iterator[Stroke]:
    yield from _ball(rng, (x, y, 0.0), (radius, 0.95 * radius), "vermilion", POMEGRANATE)
    for lean in (-0.55, -0.1, 0.4):  # the crown
        place = (x + 0.15 * radius + 2.6 * lean, y - 1.02 * radius, lean * 0.8 - np.pi / 2)
        yield Stroke(place, (4.0, 1.7, 0.34), "madder lake", (vary(rng, LAKE, 0.1), ORANGE))
    light = (mix(("lead white", 0.9), ("vermilion", 0.1)), ORANGE)
    place = (x - 0.38 * radius, y - 0.42 * radius, -0.8)
    yield Stroke(place, (3.0, 1.5, 0.45), "lead white", light, bend=0.3)


def _ball(
    rng: np.random.Generator,
    place: tuple[float, float, float],
    radii: tuple[float, float],
    paint: str,
    ramp: Ramp,
) -> Iterator[Stroke]:
    """A round form in strokes that go around it; the light comes from the upper left."""
    x0, y0, tilt = place
    rx, ry = radii
    small, large = min(radii), max(radii)
    # The chords of a tilted ellipse are centred off its axis.
    high = np.hypot(rx * np.sin(tilt), ry * np.cos(tilt))
    lean = (rx**2 - ry**2) * np.sin(tilt) * np.cos(tilt) / high**2
    chords = (
        (x0 + lean * y, y0 + y, rx * ry / high * np.sqrt(1 - (y / high) ** 2))
        for y in np.arange(0.8 - high, high - 0.4, 1.5)
    )
    yield from underpaint(chords, 2.4, paint, tone(0.35, ramp))
    broad, fine = (
        [
            (p, q, width, thickness)
            for p, q in scatter(rng, (-1, 1), (-1, 1), (step, step))
            if np.hypot(p, q) < 1 - width / 2.6 / small
        ]
        for width, thickness, step in ((3.6, 0.13, 0.30), (2.5, 0.24, 0.25))
    )
    turns = rng.permutation(np.linspace(0, 2 * np.pi, round(4 * small), endpoint=False))
    inset = 1 - 1.0 / small
    rim = [(inset * np.cos(turn), inset * np.sin(turn), 2.2, 0.15) for turn in turns]
    for p, q, width, thickness in [*broad, *rim, *fine]:
        away = float(np.hypot(p, q))
        x = rx * p * np.cos(tilt) - ry * q * np.sin(tilt)
        y = rx * p * np.sin(tilt) + ry * q * np.cos(tilt)
        t = -0.52 * x / large - 0.58 * y / large + 0.63 * np.sqrt(max(0.0, 1 - away**2)) + rng.normal(0, 0.06)
        angle = tilt + np.arctan2(ry * p, -rx * q) + rng.normal(0, 0.12)
        length = 3.4 + 5.0 * away * small / 9
        yield Stroke(
            (x0 + x, y0 + y, angle),
            (length, width, thickness),
            paint,
            (vary(rng, tone(t, ramp), 0.07), vary(rng, tone(t + 0.25, ramp), 0.07)),
            bend=around(max(away * rx, 3.0), length),
            dryness=rng.uniform(0, 0.2),
        )
