"""Find the classic colour target of 24 patches in a photograph, by its lattice and its colours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.lattice import Array, Lattice, lattices
from impasto.calibrate.patches import Box
from impasto.errors import CaptureError, Problem, raise_problems

CLASSIC = "ColorChecker24 - After November 2014"
"""Its data in colour-science."""

_ACROSS, _DOWN = 6, 4
# Patches whose outlines must be seen; the others follow from the lattice.
_LEAST_SEEN = 14
_LONGEST_PX = 900
# Mean difference in CIELAB after the best matrix, below which colours are the target's. On simulated charts
# the right order is off by 3 at most, the next best by 30.
_ALIKE = 10.0
_ONE_ALIKE = 25.0
_CLEARLY = 1.5
# Share of a step that a patch surely covers.
_INSIDE = 0.62
_BY_HAND = "Write the patches' boxes by hand into a table; see docs/calibration.md"


@dataclass(frozen=True)
class FoundTarget:
    """A target found in a photograph.

    Parameters
    ----------
    names : tuple of str, length 24
    outlines : ndarray of shape (24, 4, 2)
        Columns and rows of the corners of the inner part of each patch.
    boxes : tuple of (int, int, int, int)
        First column, first row, end column and end row of an upright box inside of each.
    difference : ndarray of shape (24,)
        In CIELAB, from the target's data after the best matrix.
    seen : int
        Patches whose outlines were seen.
    """

    names: tuple[str, ...]
    outlines: Array
    boxes: tuple[Box, ...]
    difference: Array
    seen: int


@dataclass(frozen=True)
class _Placement:
    """The target's patches laid on a lattice in one of the eight ways."""

    centres: Array
    lattice: Lattice
    mirrored: bool
    colours: Array
    difference: Array
    seen: int

    @property
    def off(self) -> float:
        # Few patches that are covered do not hide the rest.
        return float(np.sort(self.difference)[:20].mean())


def classic_data() -> tuple[tuple[str, ...], Array, Array]:
    """Return names, XYZ (24, 3) and XYZ of white (3,) of the target, Y = 1 for a perfect white, under D50."""
    import colour  # slow to import

    known = colour.CCS_COLOURCHECKERS[CLASSIC]
    xyz = colour.xyY_to_XYZ(np.array(list(known.data.values())))
    return tuple(known.data), np.asarray(xyz), np.asarray(colour.xy_to_XYZ(known.illuminant))


def find_target(radiance: NDArray[np.floating], where: str) -> FoundTarget:
    """Find the classic target of 24 patches, however it is turned.

    Parameters
    ----------
    radiance : ndarray of shape (H, W, 3)
        Linear, of any scale and white balance.
    where : str
        What errors call the photograph.

    Raises
    ------
    CaptureError
        If it is not found, is seen mirrored, or patches do not look like the target's, naming them.

    Notes
    -----
    Even regions that are filled parallelograms are joined to lattices in perspective. The target is laid on
    each in all four orientations, and the four mirrored ones; the colours decide, by what is left after the
    best 3 x 3 matrix to the target's XYZ.
    """
    names, xyz, white = classic_data()
    if radiance.ndim != 3 or radiance.shape[2] != 3:
        raise CaptureError(Problem(where, "is grey, expected three channels", "Photograph in colour"))
    factor = max(1, -(-max(radiance.shape[:2]) // _LONGEST_PX))
    small = _smaller(radiance, factor)
    tone = np.cbrt(np.clip(small / max(float(np.percentile(small, 99.5)), 1e-12), 0, 1))
    placements = [
        placement
        for lattice in lattices(tone, _LEAST_SEEN)
        for placement in _placements(lattice, small, xyz, white)
    ]
    if not placements:
        what = "shows no lattice of 6 x 4 even patches"
        do = f"Photograph the whole target, sharp and larger. {_BY_HAND}"
        raise CaptureError(Problem(where, what, do))
    best = min(placements, key=lambda placement: placement.off)
    _check(best, placements, names, where)
    outlines = _outlines(best)
    outlines = (outlines + 0.5) * factor - 0.5
    boxes = tuple(_inside(outline) for outline in outlines)
    return FoundTarget(names, outlines, boxes, best.difference, best.seen)


def _smaller(image: NDArray[np.floating], factor: int) -> Array:
    height, width = (size // factor * factor for size in image.shape[:2])
    cells = image[:height, :width].reshape(height // factor, factor, width // factor, factor, 3)
    return np.asarray(cells.mean(axis=(1, 3), dtype=np.float64))


def _placements(lattice: Lattice, image: Array, xyz: Array, white: Array) -> Iterator[_Placement]:
    low, high = lattice.steps.min(axis=0), lattice.steps.max(axis=0)
    for shape in ((_ACROSS, _DOWN), (_DOWN, _ACROSS)):
        first = np.minimum(low, high + 1 - shape)
        last = np.maximum(low, high + 1 - shape)
        for corner in np.ndindex(*(last - first + 1)):
            start = first + corner
            inside = ((lattice.steps >= start) & (lattice.steps < start + shape)).all(axis=1)
            if inside.sum() < _LEAST_SEEN:
                continue
            grid = np.stack(np.meshgrid(*(start[a] + np.arange(shape[a]) for a in (0, 1))), axis=-1)
            colours = _colours(lattice, grid.reshape(-1, 2), image)
            if colours is None:
                continue
            colours = colours.reshape(*grid.shape[:2], 3)
            for turns in range(4):
                turned, read = np.rot90(grid, turns), np.rot90(colours, turns)
                if turned.shape[:2] != (_DOWN, _ACROSS):
                    continue
                for mirrored in (False, True):
                    ways = (turned[:, ::-1], read[:, ::-1]) if mirrored else (turned, read)
                    off = _difference(ways[1].reshape(-1, 3), xyz, white)
                    yield _Placement(
                        ways[0].reshape(-1, 2),
                        lattice,
                        mirrored,
                        ways[1].reshape(-1, 3),
                        off,
                        int(inside.sum()),
                    )


def _colours(lattice: Lattice, centres: Array, image: Array) -> Array | None:
    """Return the mean (24, 3) of the middle of each patch, None if one is not in the image."""
    offsets = np.stack(np.meshgrid(*[np.linspace(-0.2, 0.2, 5)] * 2), axis=-1).reshape(-1, 2)
    places = np.rint(lattice.pixels(centres[:, None] + offsets)).astype(int)
    limits = np.array([image.shape[1], image.shape[0]])
    if not ((places >= 0) & (places < limits)).all():
        return None
    return np.asarray(image[places[..., 1], places[..., 0]].mean(axis=1))


def _difference(rgb: Array, xyz: Array, white: Array) -> Array:
    """Return how far colours are off the target's in CIELAB, after the best matrix; shape (24,)."""
    from impasto.calibrate.colour_fit import lab

    weight = 1 / (xyz[:, 1:2] + 0.02) ** (2 / 3)
    trust = np.ones((len(xyz), 1))
    known = lab(xyz, white)
    off = np.zeros(len(xyz))
    for _ in range(6):
        matrix, *_ = np.linalg.lstsq(rgb * weight * trust, xyz * weight * trust, rcond=None)
        off = np.linalg.norm(lab(np.maximum(rgb @ matrix, 0), white) - known, axis=1)
        trust = 1 / np.sqrt(np.maximum(off, 3.0))[:, None]
    return off


def _check(best: _Placement, placements: list[_Placement], names: tuple[str, ...], where: str) -> None:
    if best.off > _ALIKE:
        what = f"shows patches whose colours are off the target's by {best.off:.0f} CIELAB at best, "
        raise CaptureError(
            Problem(where, what + f"expected less than {_ALIKE:.0f}: it is not there, or not whole", _BY_HAND)
        )
    if best.mirrored:
        do = "Do not mirror photographs when exporting them"
        raise CaptureError(Problem(where, "shows the target mirrored", do))
    problems = [
        Problem(
            f"patch {names[row]}",
            f"is off the target's data by {best.difference[row]:.0f} CIELAB in {where}, "
            f"expected less than {_ONE_ALIKE:.0f}",
            f"Take away what covers it or mirrors in it. {_BY_HAND}",
        )
        for row in np.flatnonzero(best.difference > _ONE_ALIKE)
    ]
    grey = best.colours[-_ACROSS:].mean(axis=1)
    problems += [
        Problem(
            f"patch {names[row]}",
            f"reads {dark:.3g} in {where}, not above the {darker:.3g} of the darker {names[row + 1]}",
            f"Light the target evenly, without gloss. {_BY_HAND}",
        )
        for row, (dark, darker) in enumerate(pairwise(grey), start=len(names) - _ACROSS)
        if dark <= darker
    ]
    raise_problems(CaptureError, problems)
    middle = best.lattice.pixels(best.centres)
    for other in placements:
        apart = np.abs(other.lattice.pixels(other.centres) - middle).max()
        step = np.abs(middle[1] - middle[0]).max()
        if apart > 0.3 * step and other.off < _CLEARLY * best.off:
            what = f"allows two places of the target, off by {best.off:.1f} and {other.off:.1f} CIELAB"
            raise CaptureError(Problem(where, what, _BY_HAND))


def _outlines(placement: _Placement) -> Array:
    corner = 0.5 * _INSIDE * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return placement.lattice.pixels(placement.centres[:, None] + corner)


def _inside(outline: Array) -> Box:
    """Return the largest upright box about the middle of a convex outline that lies in it."""
    middle = outline.mean(axis=0)
    half = np.ptp(outline, axis=0) / 2
    edges = np.roll(outline, -1, axis=0) - outline
    inward = np.column_stack([-edges[:, 1], edges[:, 0]])
    inward *= np.sign(((middle - outline) * inward).sum(axis=1))[:, None]
    room = ((middle - outline) * inward).sum(axis=1)
    scale = min(1.0, float((room / (np.abs(inward) @ half)).min()))
    first, last = np.ceil(middle - scale * half), np.floor(middle + scale * half)
    return int(first[0]), int(first[1]), int(last[0]) + 1, int(last[1]) + 1
