"""The still life's jug: ultramarine, with bands of gold and a frieze of white flowers.

Studio millimetres from the painting's centre, y down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impasto.capture.simulate.painting.brushwork import scatter, tone, underpaint, vary
from impasto.capture.simulate.painting.paints import mix
from impasto.capture.simulate.painting.strokes import Stroke

AXIS_X = -13.0
# The silhouette from lip to foot: height and half-width.
PROFILE_Y = np.array([-15.0, -13.5, -9.0, -5.0, 0.0, 6.0, 12.0, 18.0, 23.0, 26.0, 27.5])
PROFILE_R = np.array([6.6, 5.8, 4.6, 5.0, 8.6, 12.2, 13.6, 12.6, 9.8, 8.0, 8.2])
LIP_Y, FOOT_Y = PROFILE_Y[0], PROFILE_Y[-1]

LIT = mix(("ultramarine", 0.55), ("lead white", 0.45))
LOCAL = mix(("ultramarine", 1.0))
DARK = mix(("ultramarine", 0.62), ("ivory black", 0.38))
# From the left flank to the right, where the disc is reflected.
RAMP = (
    (-1.1, LOCAL),
    (-0.5, LIT),
    (0.1, LOCAL),
    (0.65, DARK),
    (0.85, DARK),
    (1.0, mix(("ultramarine", 0.60), ("shell gold", 0.40))),
)


def jug(rng: np.random.Generator) -> Iterator[Stroke]:
    """The whole jug; the handle first, so that the belly overlaps it."""
    for part in (_handle, _body, _outline, _bands, _frieze, _lip, _highlights):
        yield from part(rng)


def _radius(y: float) -> float:
    return float(np.interp(y, PROFILE_Y, PROFILE_R))


def _lean(y: float) -> float:
    """Return the silhouette's angle against the upright."""
    return float(np.arctan((_radius(y + 1.5) - _radius(y - 1.5)) / 3))


def _handle(rng: np.random.Generator) -> Iterator[Stroke]:
    for turn in np.linspace(0.62 * np.pi, 1.42 * np.pi, 8):
        yield Stroke(
            (AXIS_X - 7.6 + 7.2 * np.cos(turn), -1.5 + 9.6 * np.sin(turn), turn + np.pi / 2),
            (7.5, 2.9, 0.30),
            "ultramarine",
            (vary(rng, LOCAL, 0.12), vary(rng, LIT, 0.12)),
            bend=0.8,
        )


def _body(rng: np.random.Generator) -> Iterator[Stroke]:
    """Strokes down the flanks, modelled from a light at the upper left."""
    levels = np.arange(LIP_Y + 0.6, FOOT_Y - 0.6, 1.6)
    yield from underpaint(((AXIS_X, y, _radius(y)) for y in levels), 2.6, "ultramarine", LOCAL)
    for thickness, step, width in ((0.10, (3.6, 4.0), 4.6), (0.18, (2.5, 3.4), 2.9)):
        for x, y in scatter(rng, (-15, 15), (LIP_Y + 1, FOOT_Y - 1.2), step):
            across = x / _radius(y)
            if abs(across) > 1 - width / 2.4 / _radius(y):
                continue
            angle = np.pi / 2 - np.arctan(np.tan(_lean(y)) * across) + rng.normal(0, 0.12)
            t = across + 0.005 * (y - 6) + rng.normal(0, 0.10)
            length = min(8.5, 2 * (FOOT_Y - y) + 2.5, 2 * (y - LIP_Y) + 2.5)
            yield Stroke(
                (AXIS_X + x, y, angle),
                (length, width, thickness),
                "ultramarine",
                (vary(rng, tone(t, RAMP)), vary(rng, tone(t - 0.25, RAMP))),
                bend=-0.5 * across,
                dryness=rng.uniform(0.0, 0.25),
            )


def _outline(rng: np.random.Generator) -> Iterator[Stroke]:
    for side in (-1, 1):
        for y in np.arange(LIP_Y + 1.5, FOOT_Y - 0.5, 1.9):
            yield Stroke(
                (AXIS_X + side * (_radius(y) - 0.75), y, np.pi / 2 - side * _lean(y)),
                (5.2, 1.8, 0.16),
                "ultramarine",
                (vary(rng, tone(0.95 * side, RAMP)), vary(rng, tone(0.7 * side, RAMP))),
                dryness=0.0,
                taper=0.4,
            )


def _bands(rng: np.random.Generator) -> Iterator[Stroke]:
    gold = mix(("shell gold", 1.0))
    for y in (2.4, 17.2):
        for turn in np.linspace(-1.25, 1.25, 11):
            place = (AXIS_X + (_radius(y) - 0.8) * np.sin(turn), y + 1.5 * np.cos(turn), -0.24 * np.sin(turn))
            yield Stroke(
                place, (3.4 * np.cos(turn) + 0.9, 1.15, 0.22), "shell gold", (vary(rng, gold, 0.05), gold)
            )


def _frieze(rng: np.random.Generator) -> Iterator[Stroke]:
    white = mix(("lead white", 1.0))
    for turn in np.linspace(-1.1, 1.1, 7):
        x, y = AXIS_X + 12.4 * np.sin(turn), 10.6 + 1.2 * np.cos(turn)
        shaded = white * (0.92 - 0.34 * max(0.0, float(np.sin(turn))))
        for petal in np.arange(5) * 2 * np.pi / 5 + 0.3:
            place = (x + 1.25 * np.cos(petal) * np.cos(turn), y + 1.25 * np.sin(petal), petal)
            yield Stroke(place, (2.0, 1.0, 0.18), "lead white", (vary(rng, shaded, 0.04), LIT))


def _lip(rng: np.random.Generator) -> Iterator[Stroke]:
    grey = 0.7 * mix(("lead white", 1.0))
    for turn in np.linspace(0, 2 * np.pi, 10, endpoint=False):
        angle = turn + np.pi / 2 if abs(np.cos(turn)) > 0.8 else 0.0
        place = (AXIS_X + 5.9 * np.cos(turn), LIP_Y + 1.1 * np.sin(turn), angle)
        near = LIT if np.sin(turn) > 0 else LOCAL
        yield Stroke(place, (3.6, 1.3, 0.26), "ultramarine", (vary(rng, near, 0.1), grey))
    yield Stroke((AXIS_X, LIP_Y + 0.1, 0.0), (9.0, 1.6, 0.05), "ivory black", (DARK, DARK))


def _highlights(rng: np.random.Generator) -> Iterator[Stroke]:
    white = mix(("lead white", 1.0))
    for x, y, length, angle in ((-6.3, 5.5, 5.4, 1.95), (-5.0, 9.5, 2.6, 1.8), (-2.2, -8.0, 3.2, 1.6)):
        yield Stroke((AXIS_X + x, y, angle), (length, 1.5, 0.42), "lead white", (white, LIT), bend=0.3)
