"""A small still life in oil: a blue jug with blossom, two pomegranates and a lemon before a gilded disc.

What lies beyond the central square is wall and table, so that any format works.
"""

from __future__ import annotations

import numpy as np

from impasto.capture.simulate.painting.backdrop import cast_shadows, cloth, disc, table, wall
from impasto.capture.simulate.painting.blossom import blossom, stems
from impasto.capture.simulate.painting.fruit import fruit
from impasto.capture.simulate.painting.jug import jug
from impasto.capture.simulate.painting.strokes import PaintLayer


def paint_still_life(layer: PaintLayer, seed: int) -> None:
    """Paint the still life on `layer`, back to front; `seed` moves every stroke a little."""
    rng = np.random.default_rng((seed, 1))
    for setting in (wall, disc, table, cloth, cast_shadows):
        for stroke in setting(layer.grid, rng):
            layer.lay(stroke, seed)
    for thing in (stems, jug, fruit, blossom):
        for stroke in thing(rng):
            layer.lay(stroke, seed)
