"""A black trap in a white card, seen through a lens that adds veiling glare."""

from __future__ import annotations

import numpy as np

from impasto.geometry import Array

SHARE = 0.01
"""Light that the lens spreads over the whole picture, as a share of what falls on it."""
_TRAP = (0.45, 0.55)
_BRIGHT = (0.15, 0.35)


def seen(radiance: Array) -> Array:
    """Return what a lens with veiling glare shows of a scene, ndarray of shape (H, W, C).

    Parameters
    ----------
    radiance : ndarray of shape (H, W, C)

    Notes
    -----
    The widest part of a lens's point spread only: everywhere the same share of the picture's mean.
    """
    return np.asarray((1 - SHARE) * radiance + SHARE * radiance.mean(axis=(0, 1)))


def trap(size: tuple[int, int]) -> Array:
    """Return the reflectance of a white card with a hole that lets no light out, shape (H, W, 1)."""
    card = np.ones((*size, 1))
    left, top, right, bottom = _box(size, _TRAP)
    card[top:bottom, left:right] = 0
    return card


def table(size: tuple[int, int]) -> str:
    """Return as CSV where the trap and a part of the card lie."""
    lines = ["area,column0_px,row0_px,column1_px,row1_px"]
    for name, span in (("trap", _TRAP), ("bright", _BRIGHT)):
        left, top, right, bottom = _box(size, span)
        # The trap's rim is left out.
        margin = min(2, (right - left - 1) // 2, (bottom - top - 1) // 2)
        edges = left + margin, top + margin, right - margin, bottom - margin
        lines.append(",".join([name, *map(str, edges)]))
    return "\n".join(lines) + "\n"


def _box(size: tuple[int, int], span: tuple[float, float]) -> tuple[int, int, int, int]:
    """Return first column, first row, end column and end row of a box in an image of (H, W)."""
    height, width = size
    return tuple(round(part * side) for part in span for side in (width, height))  # type: ignore[return-value]
