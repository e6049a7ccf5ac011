"""How well the strengths of a lamp led by hand are told to lights between, on simulated strengths.

`python -m benchmarks.hand_held` leads a lamp around a painting along spokes, arcs over the zenith, rings or a
spiral, or to places at random, 30 to 100 lights. Its distance drifts in time and with the pose of the arm and
starts anew with each stroke, its aim wanders, and nothing is steadier than some per cent. Of each capture an
eighth of the lights is left out, and their strengths are told by the others. It prints the errors, in per
cent, of the trend alone, of a process whose kernel is Gaussian over direction, and of what the fit uses.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from impasto.fit.light_process import usual_processes
from impasto.fit.strength import TELLING, find_strength
from impasto.fit.trend import find_trend
from impasto.geometry import dome_direction
from impasto.residual import kernel, told

DRAWS = 100
"""Captures of each way of leading the lamp."""

Array = NDArray[np.float64]
Strokes = tuple[Array, Array, NDArray[np.intp]]
"""Zenith and azimuth angles, in radians and in order of time, and the number of the stroke."""


def spokes(rng: np.random.Generator, count: int, lowest: float, highest: float) -> Strokes:
    """Inwards and outwards in turn."""
    each = int(rng.integers(4, 8))
    number = max(4, round(count / each))
    zenith = np.linspace(highest, lowest, each)
    turns = np.concatenate([zenith if stroke % 2 else zenith[::-1] for stroke in range(number)])
    stroke = np.repeat(np.arange(number), each)
    return turns, 2 * np.pi * stroke / number, stroke


def arcs(rng: np.random.Generator, count: int, lowest: float, highest: float) -> Strokes:
    """From one side over the zenith to the other, and back."""
    each = int(rng.integers(6, 12))
    number = max(3, round(count / each))
    tilt = np.linspace(-lowest, lowest, each)
    turns = np.concatenate([tilt if stroke % 2 else -tilt for stroke in range(number)])
    stroke = np.repeat(np.arange(number), each)
    return np.abs(turns), np.pi * stroke / number + np.pi * (turns < 0), stroke


def rings(rng: np.random.Generator, count: int, lowest: float, highest: float) -> Strokes:
    """One after the other, each all around."""
    zenith = np.linspace(lowest, highest, int(rng.integers(3, 7)))
    counts = np.maximum(4, np.round(count * np.sin(zenith) / np.sin(zenith).sum())).astype(int)
    azimuth = np.concatenate([np.arange(each) * (2 * np.pi / each) for each in counts])
    return np.repeat(zenith, counts), azimuth, np.repeat(np.arange(len(zenith)), counts)


def spiral(rng: np.random.Generator, count: int, lowest: float, highest: float) -> Strokes:
    """From the zenith down, in one stroke."""
    part = np.sqrt((np.arange(count) + 0.5) / count)
    turns = rng.uniform(3, 6)
    return highest + (lowest - highest) * part, 2 * np.pi * turns * part, np.zeros(count, np.intp)


def random(rng: np.random.Generator, count: int, lowest: float, highest: float) -> Strokes:
    """Anywhere, in one stroke."""
    zenith = np.arccos(rng.uniform(np.cos(lowest), 1.0, count))
    return zenith, rng.uniform(0, 2 * np.pi, count), np.zeros(count, np.intp)


WAYS: tuple[Callable[[np.random.Generator, int, float, float], Strokes], ...] = (
    spokes,
    arcs,
    rings,
    spiral,
    random,
)


def smooth(rng: np.random.Generator, covariance: Array) -> Array:
    """Draw from a Gaussian process."""
    drawn: Array = np.linalg.cholesky(covariance + 1e-8 * np.eye(len(covariance))) @ rng.standard_normal(
        len(covariance)
    )
    return drawn


def in_time(rng: np.random.Generator, count: int) -> Array:
    """Draw what drifts over 3 to 15 photographs, of unit variance."""
    apart = np.sqrt(3.0) * np.abs(np.subtract.outer(np.arange(count), np.arange(count))) / rng.uniform(3, 15)
    return smooth(rng, (1.0 + apart) * np.exp(-apart))


def capture(rng: np.random.Generator, way: Callable[..., Strokes]) -> tuple[Array, Array]:
    """Return directions (L, 3) and logarithms of strength (L,) of a lamp led by hand."""
    lowest, highest = np.radians([rng.uniform(65, 82), rng.uniform(8, 20)])
    zenith, azimuth, stroke = way(rng, int(rng.integers(30, 101)), lowest, highest)
    count = len(zenith)
    direction = dome_direction(zenith, azimuth)
    direction = direction + np.radians(rng.uniform(1, 4)) / np.sqrt(2) * rng.standard_normal((count, 3))
    direction[:, 2] = np.maximum(direction[:, 2], 0.08)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    # The lamp goes around a place that is not quite the painting's middle.
    aside = rng.normal(0.0, 0.1, 3)
    along = direction @ aside
    distance = np.log(along + np.sqrt(along * along + 1.0 - aside @ aside))
    distance += rng.uniform(0.02, 0.08) * in_time(rng, count)
    distance += rng.uniform(0.0, 0.06) * smooth(rng, kernel(direction, direction, rng.uniform(0.3, 0.9)))
    distance += rng.uniform(0.0, 0.06) * rng.standard_normal(stroke.max() + 1)[stroke]
    aim = [rng.normal(0, 5) + rng.uniform(1, 7) * in_time(rng, count) for _ in range(2)]
    beam = rng.uniform(1, 5) * np.log(np.maximum(np.cos(np.radians(np.hypot(*aim))), 0.2))
    tremor = rng.uniform(0.01, 0.04) * rng.standard_normal(count)
    strength = beam - 2.0 * distance + tremor
    return direction, strength - np.median(strength)


def gaussian(direction: Array, departure: Array, others: Array) -> Array:
    """Tell strengths (L, 1) by a process whose kernel is Gaussian over direction, chosen by the same rule."""
    moments = departure @ departure.T
    processes = usual_processes(direction)
    errors = [np.sqrt(process.left_out(moments)).mean() for process in processes]
    best = processes[int(np.argmin(errors))]
    if min(errors) >= TELLING * np.abs(departure).mean():
        return np.zeros((len(others), 1))
    weights = np.linalg.solve(best.gram(), departure)
    result: Array = kernel(others, direction, best.length) @ weights
    return result


def errors(rng: np.random.Generator, way: Callable[..., Strokes]) -> Array:
    """Return the errors of the logarithms of left-out strengths, by the trend and both processes, (3, L)."""
    direction, strength = capture(rng, way)
    left_out = rng.permutation(len(direction))[: max(4, len(direction) // 8)]
    kept = np.setdiff1d(np.arange(len(direction)), left_out)
    # The trend at the lights left out is not what is judged, so it is that of all.
    departure = (strength[:, None] - find_trend(direction, strength[:, None]))[:, :1]
    found = find_strength(direction[kept], departure[kept])
    table = told(found, direction[left_out], ()) if found else np.zeros((len(left_out), 1))
    before = gaussian(direction[kept], departure[kept], direction[left_out])
    return np.stack([departure[left_out, 0] - guess for guess in (0.0, before[:, 0], table[:, 0])])


if __name__ == "__main__":
    rng = np.random.default_rng(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
    print("left-out strengths off, % rms: by the trend, a Gaussian kernel, spokes and rings too")
    for way in WAYS:
        found = np.concatenate([errors(rng, way) for _ in range(DRAWS)], axis=1)
        print(
            f"  {way.__name__:8s}",
            *(f"{100 * value:6.1f}" for value in np.sqrt(np.square(found).mean(axis=1))),
        )
