"""Did the camera or the painting move?"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.ndimage import binary_dilation

from impasto.calibrate.steadiness import edges
from impasto.geometry import Array
from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

_FINENESS = 50
# Below this correlation the two hardly show the same edges: their shift means something only if photographs
# under different lamps agree on it.
_LEAST_CORRELATION = 0.5
_LEAST_AGREEING, _AGREEING_PX = 3, 0.15
# The border of a clipped area wanders with the highlight: edges so near to it are left out.
_NEAR_CLIPPED_PX = 4


def shift_px(look: Look, references: Sequence[Look]) -> tuple[float, float] | None:
    """Return by how many columns and rows a photograph lies off others; None where nobody can tell.

    Parameters
    ----------
    look : Look
    references : sequence of Look
        Photographs under lamps near to its own, because shading moves edges.

    Notes
    -----
    Phase correlation of the edges in the parts of the frame, against the sum of the references' edges; the
    median of the parts. Measured on photographs of an icon and of a plaster cat, each against four of those
    taken before it: originals lie off by 0.25 px at most, those shifted by 0.5 px by 0.40 px at least.

    References
    ----------
    [GuizarSicairos2008]_
    """
    found = []
    for number in range(len(look.parts)):
        moving = _edges(look, number)
        others = [_edges(other, number) for other in references]
        shift, correlation = _register(np.sum(others, axis=0), moving)
        if correlation < _LEAST_CORRELATION:
            shift = _agreed([_register(other, moving)[0] for other in others])
        if shift is not None:
            found.append(shift)
    if not found:
        return None
    rows, columns = np.median(found, axis=0)
    return float(columns), float(rows)


def moved(
    shift: tuple[float, float] | None, shot: Shot, limits: Limits, other: Shot | None = None
) -> list[Finding]:
    """Return whether a photograph lies off others.

    Parameters
    ----------
    shift : (float, float) or None
        What `shift_px` returned.
    shot : Shot
    limits : Limits
    other : Shot, optional
        The only one that it was compared with: nobody can tell which of the two moved.
    """
    if shift is None or np.hypot(*shift) <= limits.moved_px:
        return []
    off = "the photographs under lamps near its own" if other is None else other.name
    what = (
        f"lies {np.hypot(*shift):.2f} px off {off} ({shift[0]:+.2f} columns, {shift[1]:+.2f} rows); at most "
        f"{limits.moved_px:g} px planned"
    )
    do = "Wait until nothing shakes and take it again; if it stays off, camera or painting has moved for good"
    names = (shot.name,) if other is None else (other.name, shot.name)
    return [Finding("moved", names, what, do)]


@lru_cache(maxsize=60)
def _edges(look: Look, part: int) -> Array:
    """Return the edges in a part; those of the last photographs are kept, because the next are like them."""
    clipped = look.parts_clipped[part]
    found = edges(look.parts[part])
    if clipped.any():
        found[binary_dilation(clipped, iterations=_NEAR_CLIPPED_PX)] = 0
    return found


def _register(reference: Array, moving: Array) -> tuple[Array | None, float]:
    """Return rows and columns by which edges lie off, and their correlation once they are shifted back."""
    from skimage.registration import phase_cross_correlation

    if not (reference.any() and moving.any()):
        return None, 0.0  # clipped everywhere
    shift, error, _ = phase_cross_correlation(
        reference, moving, upsample_factor=_FINENESS, normalization=None
    )
    return -shift, float(np.sqrt(max(0.0, 1 - float(error) ** 2)))


def _agreed(shifts: Sequence[Array | None]) -> Array | None:
    """Return the shift that most references agree on, None if they do not."""
    known = [shift for shift in shifts if shift is not None]
    if len(known) < _LEAST_AGREEING:
        return None
    median = np.median(known, axis=0)
    near = sum(float(np.hypot(*(shift - median))) <= _AGREEING_PX for shift in known)
    return median if near >= _LEAST_AGREEING else None
