"""Did the camera or the painting move?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from impasto.calibrate.steadiness import edges
from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

_FINENESS = 50
# Below this correlation the two do not show the same edges, and their shift means nothing.
_LEAST_CORRELATION = 0.5
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
    from skimage.registration import phase_cross_correlation

    found = []
    for number in range(len(look.parts)):
        reference = np.sum([_edges(other, number) for other in references], axis=0)
        moving = _edges(look, number)
        if not (reference.any() and moving.any()):
            continue  # clipped everywhere
        shift, error, _ = phase_cross_correlation(
            reference, moving, upsample_factor=_FINENESS, normalization=None
        )
        if np.sqrt(max(0.0, 1 - float(error) ** 2)) >= _LEAST_CORRELATION:
            found.append(-shift)
    if not found:
        return None
    rows, columns = np.median(found, axis=0)
    return float(columns), float(rows)


def moved(look: Look, shot: Shot, references: Sequence[Look], limits: Limits) -> list[Finding]:
    """Return whether a photograph lies off those before."""
    shift = shift_px(look, references) if references else None
    if shift is None or np.hypot(*shift) <= limits.moved_px:
        return []
    what = (
        f"lies {np.hypot(*shift):.2f} px off the photographs before ({shift[0]:+.2f} columns, "
        f"{shift[1]:+.2f} rows); at most {limits.moved_px:g} px planned"
    )
    do = "Wait until nothing shakes and take it again; if it stays off, camera or painting has moved for good"
    return [Finding("moved", (shot.name,), what, do)]


def _edges(look: Look, part: int) -> NDArray[np.float64]:
    clipped = look.parts_clipped[part]
    found = edges(look.parts[part])
    if clipped.any():
        found[binary_dilation(clipped, iterations=_NEAR_CLIPPED_PX)] = 0
    return found
