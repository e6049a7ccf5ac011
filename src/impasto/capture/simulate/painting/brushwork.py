"""What every passage of a painting uses: where to put strokes, and what colour the brush brings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.painting.strokes import Stroke

Array = NDArray[np.float64]

# The colours on a ramp from shade to light: where each stands, and its albedo.
Ramp = tuple[tuple[float, Array], ...]


def scatter(
    rng: np.random.Generator, x: tuple[float, float], y: tuple[float, float], step: tuple[float, float]
) -> Array:
    """Return places on a jittered grid in random order, ndarray of shape (N, 2).

    Parameters
    ----------
    rng : numpy.random.Generator
    x, y : tuple of float
        First and last place along either axis.
    step : tuple of float
        Spacing along x and y.
    """
    columns = np.arange(x[0], x[1] + step[0], step[0])
    rows = np.arange(y[0], y[1] + step[1], step[1])
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    places = places + rng.uniform(-0.5, 0.5, places.shape) * step
    return np.asarray(rng.permutation(places))


def tone(t: float, ramp: Ramp) -> Array:
    """Return the albedo at `t` on a ramp of mixtures, ndarray of shape (3,)."""
    at = [stop for stop, _ in ramp]
    logs = np.log([colour for _, colour in ramp])
    return np.exp([np.interp(t, at, channel) for channel in logs.T])


def vary(rng: np.random.Generator, colour: Array, amount: float = 0.10) -> Array:
    """Return an albedo as the next load of the brush brings it, lighter or darker by about `amount`."""
    drift = rng.standard_normal() + 0.4 * rng.standard_normal(3)
    return np.asarray(np.clip(colour * np.exp(amount * drift), 0, 0.92))


def underpaint(
    chords: Iterable[tuple[float, float, float]], width: float, paint: str, colour: Array
) -> Iterator[Stroke]:
    """Yield thin level strokes that fill a shape, so that nothing behind it shows between later strokes.

    Parameters
    ----------
    chords : iterable of (x, y, half_length)
        The shape's chords, closer together than `width`.
    width : float
    paint : str
    colour : ndarray of shape (3,)
    """
    for x, y, half_length in chords:
        yield Stroke((x, y, 0.0), (1.96 * half_length, width, 0.05), paint, (colour, colour), dryness=0.0)


def around(radius: float, length: float) -> float:
    """Return the bend of a stroke that follows a circle."""
    return (length / 2) ** 2 / 2 / radius
