"""Find a colour target in a photograph, by its lattice and its colours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.known_targets import KnownTarget
from impasto.calibrate.lattice import Array, Lattice, lattices
from impasto.calibrate.patches import Box
from impasto.errors import CaptureError, Problem, raise_problems

# Share of the patches whose outlines must be seen; the others follow from the lattice.
_LEAST_SEEN = 14 / 24
_LONGEST_PX = 900
# Mean difference in CIELAB after the best matrix, below which colours are the target's. On simulated charts
# the right order is off by 3 at most, the next best by 30.
_ALIKE = 10.0
_ONE_ALIKE = 25.0
_CLEARLY = 1.5
# By how much the logarithm of light may rise or fall across a target: a factor of 1.6.
_STEEPEST = 0.5
# Light added to all patches, by glare or a response that bends, as a share of white: more leaves no measure
# of the camera's colours. An sRGB curve taken for a straight one adds 12 %.
_MOST_GLARE = 0.13
# Share of a step that a patch surely covers.
_INSIDE = 0.62
# Share of the patches that say whether a target is there: few that are covered do not hide the rest.
_TELLING = 20 / 24
BY_HAND = "Write the patches' boxes by hand into a table; see docs/calibration.md"


@dataclass(frozen=True)
class FoundTarget:
    """A target found in a photograph.

    Parameters
    ----------
    names : tuple of str, length P
    outlines : ndarray of shape (P, 4, 2)
        Columns and rows of the corners of the inner part of each patch.
    boxes : tuple of (int, int, int, int)
        First column, first row, end column and end row of an upright box inside of each.
    difference : ndarray of shape (P,)
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
        telling = round(_TELLING * len(self.difference))
        return float(np.sort(self.difference)[:telling].mean())


def find_target(radiance: NDArray[np.floating], where: str, known: KnownTarget) -> FoundTarget:
    """Find a target, however it is turned.

    Parameters
    ----------
    radiance : ndarray of shape (H, W, 3)
        Linear, of any scale and white balance.
    where : str
        What errors call the photograph.
    known : KnownTarget
        What is looked for.

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
    if radiance.ndim != 3 or radiance.shape[2] != 3:
        raise CaptureError(Problem(where, "is grey, expected three channels", "Photograph in colour"))
    small, factor = smaller(radiance)
    tone = np.cbrt(np.clip(small / max(float(np.percentile(small, 99.5)), 1e-12), 0, 1))
    least = round(_LEAST_SEEN * len(known.names))
    placements = [
        placement
        for lattice in lattices(tone, least, max(known.across, known.down))
        for placement in _placements(lattice, small, known, least)
    ]
    if not placements:
        what = f"shows no lattice of {known.across} x {known.down} even patches"
        do = f"Photograph the whole target, sharp and larger. {BY_HAND}"
        raise CaptureError(Problem(where, what, do))
    best = min(placements, key=lambda placement: placement.off)
    _check(best, placements, known, where)
    outlines = (_outlines(best) + 0.5) * factor - 0.5
    boxes = tuple(box_inside(outline) for outline in outlines)
    return FoundTarget(known.names, outlines, boxes, best.difference, best.seen)


def smaller(image: NDArray[np.floating]) -> tuple[Array, int]:
    """Return the means of squares of pixels, in which targets are looked for, and the squares' side."""
    factor = max(1, -(-max(image.shape[:2]) // _LONGEST_PX))
    height, width = (size // factor * factor for size in image.shape[:2])
    cells = image[:height, :width].reshape(height // factor, factor, width // factor, factor, image.shape[2])
    return np.asarray(cells.mean(axis=(1, 3), dtype=np.float64)), factor


def _placements(lattice: Lattice, image: Array, known: KnownTarget, least: int) -> Iterator[_Placement]:
    low, high = lattice.steps.min(axis=0), lattice.steps.max(axis=0)
    for shape in ((known.across, known.down), (known.down, known.across)):
        first = np.minimum(low, high + 1 - shape)
        last = np.maximum(low, high + 1 - shape)
        for corner in np.ndindex(*(last - first + 1)):
            start = first + corner
            inside = ((lattice.steps >= start) & (lattice.steps < start + shape)).all(axis=1)
            if inside.sum() < least:
                continue
            grid = np.stack(np.meshgrid(*(start[a] + np.arange(shape[a]) for a in (0, 1))), axis=-1)
            colours = _colours(lattice, grid.reshape(-1, 2), image)
            if colours is None:
                continue
            colours = colours.reshape(*grid.shape[:2], 3)
            for turns in range(4):
                turned, read = np.rot90(grid, turns), np.rot90(colours, turns)
                if turned.shape[:2] != (known.down, known.across):
                    continue
                for mirrored in (False, True):
                    ways = (turned[:, ::-1], read[:, ::-1]) if mirrored else (turned, read)
                    off = _difference(ways[1].reshape(-1, 3), known)
                    yield _Placement(
                        ways[0].reshape(-1, 2),
                        lattice,
                        mirrored,
                        ways[1].reshape(-1, 3),
                        off,
                        int(inside.sum()),
                    )


def _colours(lattice: Lattice, centres: Array, image: Array) -> Array | None:
    """Return the mean (P, 3) of the middle of each patch, None if one is not in the image."""
    offsets = np.stack(np.meshgrid(*[np.linspace(-0.2, 0.2, 5)] * 2), axis=-1).reshape(-1, 2)
    places = np.rint(lattice.pixels(centres[:, None] + offsets)).astype(int)
    limits = np.array([image.shape[1], image.shape[0]])
    if not ((places >= 0) & (places < limits)).all():
        return None
    return np.asarray(image[places[..., 1], places[..., 0]].mean(axis=1))


def _difference(rgb: Array, known: KnownTarget) -> Array:
    """Return how far colours are off the target's in CIELAB, shape (P,).

    After the best matrix, and the best light that rises or falls evenly across the target.
    """
    from impasto.calibrate.colour_fit import lab

    white = known.white_xyz
    wanted, lightness = lab(known.xyz, white), 1 / (known.xyz[:, 1:2] + 0.02) ** (2 / 3)
    place = np.indices((known.down, known.across)).reshape(2, -1).T / (known.down, known.across) - 0.5
    plane = np.column_stack([np.ones(len(rgb)), place])
    # At first all count alike: something white on a dark patch would otherwise outweigh all others.
    weight = np.ones((len(rgb), 1))
    slope = np.zeros(3)
    off = np.zeros(len(rgb))
    for _ in range(8):
        even = rgb * np.exp(plane @ slope)[:, None]
        matrix, *_ = np.linalg.lstsq(even * weight, known.xyz * weight, rcond=None)
        seen = np.maximum(even @ matrix, 0)
        off = np.linalg.norm(lab(seen, white) - wanted, axis=1)
        trust = 1 / np.maximum(off, 3.0)[:, None]
        weight = lightness * trust
        left = np.log((known.xyz[:, 1] + 0.02) / (seen[:, 1] + 0.02))
        more, *_ = np.linalg.lstsq(plane * trust, left * trust[:, 0], rcond=None)
        slope = np.clip(slope + more, -_STEEPEST, _STEEPEST)
    return off


def _check(best: _Placement, placements: list[_Placement], known: KnownTarget, where: str) -> None:
    names = known.names
    if best.off > _ALIKE:
        what = f"shows patches whose colours are off the target's by {best.off:.0f} CIELAB at best, "
        raise CaptureError(
            Problem(where, what + f"expected less than {_ALIKE:.0f}: it is not there, or not whole", BY_HAND)
        )
    if best.mirrored:
        do = "Do not mirror photographs when exporting them"
        raise CaptureError(Problem(where, "shows the target mirrored", do))
    problems = [
        Problem(
            f"patch {names[row]}",
            f"is off the target's data by {best.difference[row]:.0f} CIELAB in {where}, "
            f"expected less than {_ONE_ALIKE:.0f}",
            f"Take away what covers it or mirrors in it. {BY_HAND}",
        )
        for row in np.flatnonzero(best.difference > _ONE_ALIKE)
    ]
    # An order that one of these breaks is not laid to its neighbour.
    named = {names[row] for row in np.flatnonzero(best.difference > _ONE_ALIKE)}
    grey = {name: float(best.colours[names.index(name)].mean()) for name in known.grey_row}
    problems += [
        Problem(
            f"patch {name}",
            f"reads {grey[name]:.3g} in {where}, not above the {grey[darker]:.3g} of the darker {darker}",
            f"Light the target evenly, without gloss. {BY_HAND}",
        )
        for name, darker in pairwise(known.grey_row)
        if grey[name] <= grey[darker] and not named & {name, darker}
    ]
    raise_problems(CaptureError, problems)
    raise_problems(CaptureError, _glare_problems(best, known, where))
    middle = best.lattice.pixels(best.centres)
    for other in placements:
        apart = np.abs(other.lattice.pixels(other.centres) - middle).max()
        step = np.abs(middle[1] - middle[0]).max()
        if apart > 0.3 * step and other.off < _CLEARLY * best.off:
            what = f"allows two places of the target, off by {best.off:.1f} and {other.off:.1f} CIELAB"
            raise CaptureError(Problem(where, what, BY_HAND))


def _glare_problems(best: _Placement, known: KnownTarget, where: str) -> list[Problem]:
    """Return a problem if the grey patches read as if much light were added to all."""
    rows = [known.names.index(name) for name in known.grey_row]
    reflectance, read = known.xyz[rows, 1], best.colours[rows].mean(axis=1)
    line = np.column_stack([np.ones(len(rows)), reflectance]) / np.sqrt(reflectance)[:, None]
    (stray, white), *_ = np.linalg.lstsq(line, read / np.sqrt(reflectance), rcond=None)
    share = stray / (stray + white)
    if share < _MOST_GLARE:
        return []
    what = f"adds {share:.0%} of white to all grey patches, expected less than {_MOST_GLARE:.0%}"
    do = f"Keep glare off the target, or measure the camera's response before (--oecf). {BY_HAND}"
    return [Problem(where, what, do)]


def _outlines(placement: _Placement) -> Array:
    corner = 0.5 * _INSIDE * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return placement.lattice.pixels(placement.centres[:, None] + corner)


def box_inside(outline: Array) -> Box:
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
