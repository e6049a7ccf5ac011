"""The still life's setting: wall, gilded disc, table, cloth and the shadows painted on it.

Studio millimetres from the painting's centre, y down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impasto.capture.simulate.painting.brushwork import around, scatter, tone, underpaint, vary
from impasto.capture.simulate.painting.paints import mix
from impasto.capture.simulate.painting.relief import Grid
from impasto.capture.simulate.painting.strokes import Stroke

TABLE_Y = 17.0
DISC = (14.5, -14.5, 22.5)  # x, y, radius
# The cloth from its back edge to the front: where it begins and ends.
CLOTH_Y = (21.0, 30.0, 40.0, 50.0)
CLOTH_LEFT = (-40.0, -44.0, -39.0, -31.0)
CLOTH_RIGHT = (22.0, 33.0, 21.0, 6.0)


def wall(grid: Grid, rng: np.random.Generator) -> Iterator[Stroke]:
    """Sweeping strokes that circle the disc, light on the left, falling into umber on the right."""
    ramp = (
        (0.0, mix(("yellow ochre", 0.40), ("lead white", 0.42), ("terre verte", 0.18))),
        (0.42, mix(("yellow ochre", 0.45), ("terre verte", 0.40), ("lead white", 0.15))),
        (1.05, mix(("raw umber", 0.55), ("ultramarine", 0.15), ("burnt sienna", 0.30))),
    )
    for width, length, thickness, step in ((7.5, 24.0, 0.09, (8.0, 5.0)), (4.2, 14.0, 0.17, (5.6, 3.2))):
        places = scatter(rng, (grid.x[0] - 6, grid.x[-1] + 6), (grid.y[0] - 6, TABLE_Y + 1), step)
        for x, y in places:
            away = np.hypot(x - DISC[0], y - DISC[1])
            angle = np.arctan2(y - DISC[1], x - DISC[0]) + np.pi / 2 + rng.normal(0, 0.14)
            t = (x + 50) / 100 + 0.25 * (y + 20) / 100 + rng.normal(0, 0.07)
            glow = np.exp(-(((away - DISC[2]) / 9) ** 2))
            scale = rng.uniform(0.75, 1.2)
            yield Stroke(
                (x, y, angle),
                (length * scale, width * scale, thickness),
                "yellow ochre" if t < 0.62 else "raw umber",
                (vary(rng, tone(t - 0.18 * glow, ramp)), vary(rng, tone(t - 0.2, ramp))),
                bend=around(max(away, 12), length * scale),
                dryness=rng.uniform(0.1, 0.45),
            )


def disc(grid: Grid, rng: np.random.Generator) -> Iterator[Stroke]:
    """A disc of shell gold, burnished ring by ring, on a red rim."""
    x0, y0, radius = DISC
    gold = mix(("shell gold", 1.0))
    pale = mix(("shell gold", 0.7), ("lead-tin yellow", 0.3))
    red = mix(("burnt sienna", 0.7), ("vermilion", 0.3))
    levels = np.arange(1.5 - radius, radius - 1, 2.2)
    yield from underpaint(((x0, y0 + y, np.sqrt(radius**2 - y**2)) for y in levels), 3.6, "shell gold", gold)
    rings = [(radius + 0.4, 3.0, 0.10, "burnt sienna", red, red)]
    rings += [(r, 3.3, 0.12, "shell gold", gold, pale) for r in np.arange(radius - 1.5, 1.0, -2.3)]
    for r, width, thickness, paint, colour, streak in rings:
        number = max(3, round(2 * np.pi * r / 9))
        start = rng.uniform(0, 2 * np.pi)
        length = min(13.0, 1.9 * r + 1.5)
        for turn in start + 2 * np.pi * rng.permutation(number) / number + rng.normal(0, 0.05, number):
            yield Stroke(
                (x0 + r * np.cos(turn), y0 + r * np.sin(turn), turn + np.pi / 2),
                (length, width, thickness),
                paint,
                (vary(rng, colour, 0.06), vary(rng, streak, 0.06)),
                bend=around(max(r, 2.0), length),
                dryness=rng.uniform(0, 0.15),
            )
    yield Stroke((x0, y0, 0.4), (4.4, 4.4, 0.12), "shell gold", (gold, pale), dryness=0.0, taper=0.7)


def table(grid: Grid, rng: np.random.Generator) -> Iterator[Stroke]:
    """A table of earths, long level strokes, darker towards the wall and to the right."""
    far = mix(("burnt sienna", 0.55), ("raw umber", 0.45))
    ramp = ((0.0, far), (1.0, mix(("burnt sienna", 0.65), ("yellow ochre", 0.35))))
    for width, length, thickness, step in ((6.0, 26.0, 0.10, (11.0, 4.2)), (3.4, 16.0, 0.18, (8.0, 2.7))):
        for x, y in scatter(rng, (grid.x[0] - 6, grid.x[-1] + 6), (TABLE_Y + 1.5, grid.y[-1] + 4), step):
            t = (y - TABLE_Y) / (50 - TABLE_Y) - 0.004 * x + rng.normal(0, 0.12)
            yield Stroke(
                (x, max(y, TABLE_Y + width / 2 - 0.6), rng.normal(0, 0.05)),
                (length, width, thickness),
                "burnt sienna",
                (vary(rng, tone(t, ramp)), vary(rng, tone(t + 0.3, ramp))),
                bend=rng.normal(0, 0.4),
                dryness=rng.uniform(0.1, 0.4),
            )
    edge = mix(("raw umber", 0.7), ("ivory black", 0.3))
    for x in np.arange(grid.x[0] - 4, grid.x[-1] + 8, 9.0):
        place = (x, TABLE_Y + rng.normal(0, 0.2), rng.normal(0, 0.02))
        yield Stroke(place, (13.0, 1.5, 0.16), "raw umber", (edge, far))


def cloth(grid: Grid, rng: np.random.Generator) -> Iterator[Stroke]:
    """A white cloth, laid with the palette knife along its folds."""
    ramp = (
        (-1.3, mix(("lead white", 0.78), ("ultramarine", 0.14), ("raw umber", 0.08))),
        (-0.2, mix(("lead white", 0.88), ("yellow ochre", 0.12))),
        (0.5, mix(("lead white", 1.0))),
    )
    for width, length, thickness, step in ((5.5, 12.0, 0.16, (7.0, 3.6)), (3.4, 8.5, 0.30, (5.2, 3.4))):
        places = scatter(rng, (-46, 34), (22.0, 51.0), step)
        for x, y in places[np.argsort(places[:, 1], kind="stable")]:
            left, right = np.interp(y, CLOTH_Y, CLOTH_LEFT), np.interp(y, CLOTH_Y, CLOTH_RIGHT)
            if not left + 3 < x < right - 3:
                continue
            share = (x - left) / (right - left)
            # The folds fan out where the cloth hangs, and lie along the table behind.
            fan = (2.05, 1.05) if y > 30 else (0.35, -0.25)
            angle = np.interp(share, (0, 1), fan) + rng.normal(0, 0.16)
            fold = np.sin(2 * np.pi * (4.2 * share + 0.012 * y)) + rng.normal(0, 0.25)
            yield Stroke(
                (x, y, angle),
                (length * rng.uniform(0.7, 1.15), width * rng.uniform(0.8, 1.2), thickness),
                "lead white",
                (vary(rng, tone(fold, ramp), 0.04), vary(rng, tone(fold + 0.7, ramp), 0.04)),
                knife=True,
            )


def cast_shadows(grid: Grid, rng: np.random.Generator) -> Iterator[Stroke]:
    """Painted shadows that set the jug and the fruit on the cloth."""
    shade = mix(("ultramarine", 0.35), ("raw umber", 0.35), ("lead white", 0.30))
    deep = mix(("raw umber", 0.6), ("ultramarine", 0.4))
    feet = ((-6.0, 26.8, 11.0), (15.0, 34.2, 10.0), (32.5, 36.2, 8.5), (-1.0, 42.4, 9.5))
    for x, y, half_length in feet:
        for _ in range(9):
            place = (
                x + half_length * rng.uniform(-0.7, 0.9),
                y + rng.uniform(-1.8, 1.8),
                rng.normal(0.05, 0.1),
            )
            yield Stroke(place, (8.5, 2.4, 0.10), "ultramarine", (vary(rng, shade), deep), dryness=0.3)
