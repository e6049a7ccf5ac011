"""Is there dust on a mirror sphere's highlight?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label

from impasto.calibrate.outline import Circle, find_circles
from impasto.calibrate.shots import read_shots
from impasto.geometry import Array
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


def dusty(paths: Mapping[str, Path]) -> list[Finding]:
    """Return the photographs in which a sphere's highlight is not one whole spot.

    Parameters
    ----------
    paths : mapping of str to Path
        Photographs of mirror spheres under one lamp each, by their names.

    Raises
    ------
    CaptureError
        If they cannot be read.
    """
    if not paths:
        return []
    shots = read_shots(paths.values())
    images = [shot.linear().mean(axis=2).astype(np.float64) for shot in shots]
    clipped = [np.asarray(shot.clipped.any(axis=2)) for shot in shots]
    findings = []
    for circle in find_circles(np.mean(images, axis=0)):
        seen = [highlight(image, lost, circle) for image, lost in zip(images, clipped, strict=True)]
        findings += [
            Finding(
                "sphere",
                (name,),
                f"the highlight on the sphere at column {circle[0]:.0f}, row {circle[1]:.0f} {what}",
                "Blow or wipe the dust off the sphere, and take it again",
            )
            for name, what in zip(paths, faults(seen), strict=True)
            if what
        ]
    return findings


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
