"""What mirror spheres show: dust on their highlights, and where the lamps stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label

from impasto.calibrate.mirror import Rays, Sphere, find_reflection, given_sphere
from impasto.calibrate.outline import Circle, find_circles
from impasto.calibrate.shots import one_by_one
from impasto.calibrate.sphere_windows import SphereWindow, cut_out
from impasto.geometry import Array, Camera
from impasto.stand.checks.finding import Finding

# A lamp's image is what reaches this share of its brightest pixel; where that is clipped, its core alone,
# because glare and scratches draw out the rest.
_LAMP_SHARE, _CORE_SHARE = 0.3, 0.9
_SMOOTH = 1 / 300
_WITHIN = 0.95
# Fewer pixels have no shape.
_LEAST_PX = 40
# By how much less of its outline a highlight may fill than those of other lamps on the same sphere: the shape
# of the lamp and the scratches of the sphere are common to all. On the two chrome spheres of a published
# capture, under twelve lamps each, it is 0.13 at most.
_LESS_SOLID = 0.2
# A second spot of this share of the first's area is no scratch: 0.05 at most on the same spheres.
_SECOND = 0.15
# Spheres that are found by themselves tell directions within a few degrees; lamps are further apart.
_OFF_DEG = 12.0
_LEAST_LAMPS = 3


@dataclass(frozen=True)
class Highlight:
    """A lamp's image on a sphere.

    Parameters
    ----------
    solidity : float
        Share of its convex hull that it fills; NaN where it has too few pixels for a shape.
    second : float
        Area of the second largest spot over that of the largest.
    """

    solidity: float
    second: float


def check_spheres(paths: Mapping[str, Path], planned: Mapping[str, Array], camera: Camera) -> list[Finding]:
    """Return the photographs of mirror spheres that show dust, or the lamp elsewhere than planned.

    Parameters
    ----------
    paths : mapping of str to Path
        Photographs under one lamp each, by their names.
    planned : mapping of str to ndarray of shape (3,)
        Where their lamps are to stand, of those for which that is known.
    camera : Camera

    Raises
    ------
    CaptureError
        If they cannot be read.
    """
    if not paths:
        return []
    # One photograph at a time is in memory, and all are read twice: the spheres are found in their mean.
    mean = np.zeros((1, 1))
    for shot in one_by_one(paths.values()):
        mean = mean + shot.luminance()
    mean /= len(paths)
    rays = Rays(camera, *mean.shape)
    spheres = [given_sphere(circle, rays) for circle in find_circles(mean)]
    if not spheres:
        return []
    windows = cut_out(one_by_one(paths.values()), len(paths), spheres, rays)
    findings = []
    for sphere, window in zip(spheres, windows, strict=True):
        column, row, radius = sphere.circle
        circle = (column - window.columns.start, row - window.rows.start, radius)
        seen = [
            highlight(level.astype(np.float64), lost, circle)
            for level, lost in zip(window.level, window.clipped, strict=True)
        ]
        findings += [
            Finding(
                "sphere",
                (name,),
                f"the highlight on the sphere at column {column:.0f}, row {row:.0f} {what}",
                "Blow or wipe the dust off the sphere, and take it again",
            )
            for name, what in zip(paths, faults(seen), strict=True)
            if what
        ]
    found = lamp_directions(windows, spheres, rays)
    directions = {name: at for name, at in zip(paths, found, strict=True) if at is not None}
    return findings + misplaced(directions, planned)


def lamp_directions(
    windows: Sequence[SphereWindow], spheres: Sequence[Sphere], rays: Rays
) -> list[Array | None]:
    """Return the direction of the lamp that is seen in each picture, None where none is."""
    count = len(windows[0].level)
    if count < _LEAST_LAMPS:
        return [None] * count
    seen: list[list[Array]] = [[] for _ in range(count)]
    for window, sphere in zip(windows, spheres, strict=True):
        background = window.background()
        for directions, level, lost in zip(seen, window.level, window.clipped, strict=True):
            reflection = find_reflection(level, background, lost, sphere, rays)
            if reflection is not None:
                directions.append(reflection.direction)
    return [np.median(directions, axis=0) if directions else None for directions in seen]


def misplaced(directions: Mapping[str, Array], planned: Mapping[str, Array]) -> list[Finding]:
    """Return the photographs whose lamp stands elsewhere than planned, as one finding: they have one reason.

    Parameters
    ----------
    directions, planned : mapping of str to ndarray of shape (3,)
        By the photographs' names, of any length.
    """
    off = {}
    for name in directions.keys() & planned.keys():
        pair = np.array([directions[name], planned[name]])
        a, b = pair / np.linalg.norm(pair, axis=1, keepdims=True)
        if (angle := float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))) > _OFF_DEG:
            off[name] = angle
    if not off:
        return []
    what = (
        f"in the spheres, the lamp stands {min(off.values()):.0f} to {max(off.values()):.0f}° from where the "
        f"plan has it, in {len(off)} of {len(directions)} photographs"
    )
    do = "See whether the plan's angles run the other way, and which lamp is lit at each place"
    return [Finding("order", tuple(sorted(off)), what, do)]


def highlight(image: Array, clipped: NDArray[np.bool_], circle: Circle) -> Highlight:
    """Measure the lamp's image on a sphere.

    Parameters
    ----------
    image : ndarray of shape (H, W)
        Relative radiance.
    clipped : ndarray of shape (H, W), bool
    circle : (column, row, radius)
        The sphere's outline.
    """
    from skimage.measure import regionprops

    column, row, radius = circle
    rows, columns = np.ogrid[: image.shape[0], : image.shape[1]]
    inside = np.hypot(columns - column, rows - row) < _WITHIN * radius
    smooth = gaussian_filter(image, radius * _SMOOTH)
    peak = float(smooth[inside].max(initial=0.0))
    share = _CORE_SHARE if clipped[inside].any() else _LAMP_SHARE
    regions, _ = label((smooth > share * peak) & inside)
    spots = sorted(regionprops(regions), key=lambda spot: -float(spot.area))
    if not spots or spots[0].area < _LEAST_PX:
        return Highlight(float("nan"), 0.0)
    second = float(spots[1].area / spots[0].area) if len(spots) > 1 else 0.0
    return Highlight(float(spots[0].solidity), second)


def faults(seen: Sequence[Highlight]) -> list[str]:
    """Return what is wrong with each lamp's image on one sphere, "" where nothing is."""
    shaped = [spot.solidity for spot in seen if not np.isnan(spot.solidity)]
    usual = float(np.median(shaped)) if shaped else 1.0
    said = []
    for spot in seen:
        if spot.second > _SECOND:
            said.append("is split, or there are two")
        elif spot.solidity < usual - _LESS_SOLID:
            said.append(
                f"has a speck in it: it fills {spot.solidity:.0%} of its outline, those of other lamps "
                f"{usual:.0%}"
            )
        else:
            said.append("")
    return said


def sphere_names(names: Sequence[str]) -> dict[str, list[str]]:
    """Return the names of photographs of spheres by the series that they belong to, which is their folder."""
    series: dict[str, list[str]] = {}
    for name in names:
        series.setdefault(name.rpartition("/")[0], []).append(name)
    return series
