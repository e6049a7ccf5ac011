"""Is there dust on a mirror sphere's highlight?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from impasto.calibrate.outline import Circle, find_circles
from impasto.calibrate.shots import read_shots
from impasto.stand.checks.finding import Finding

# A lamp's image is what reaches this share of its brightest pixel.
_LAMP_SHARE = 0.3
# Fewer pixels have no shape.
_LEAST_PX = 20
# A lamp's image fills its convex hull but for the steps of the pixels; a speck takes a bite out of it.
_SOLID = 0.85
# A second spot of this share of the first's area is no scratch.
_SECOND = 0.15
_WITHIN = 0.95


def dusty(paths: dict[str, Path]) -> list[Finding]:
    """Return the photographs in which a sphere's highlight is not one whole spot.

    Parameters
    ----------
    paths : dict of str to Path
        Photographs of mirror spheres under one lamp each, by their names.

    Raises
    ------
    CaptureError
        If they cannot be read.
    """
    if not paths:
        return []
    images = [shot.linear().mean(axis=2).astype(np.float64) for shot in read_shots(paths.values())]
    circles = find_circles(np.mean(images, axis=0))
    return [
        Finding(
            "sphere",
            (name,),
            f"the highlight on the sphere at column {circle[0]:.0f}, row {circle[1]:.0f} {what}",
            "Blow or wipe the dust off the sphere, and take it again",
        )
        for name, image in zip(paths, images, strict=True)
        for circle in circles
        if (what := highlight_fault(image, circle))
    ]


def highlight_fault(image: NDArray[np.float64], circle: Circle) -> str:
    """Return what is wrong with the lamp's image on a sphere, "" if nothing is.

    Parameters
    ----------
    image : ndarray of shape (H, W)
        Relative radiance.
    circle : (column, row, radius)
        The sphere's outline.
    """
    from skimage.measure import regionprops

    column, row, radius = circle
    rows, columns = np.ogrid[: image.shape[0], : image.shape[1]]
    inside = np.hypot(columns - column, rows - row) < _WITHIN * radius
    peak = float(image[inside].max(initial=0.0))
    regions, _ = label((image > _LAMP_SHARE * peak) & inside)
    spots = sorted(regionprops(regions), key=lambda spot: spot.area, reverse=True)
    if not spots or spots[0].area < _LEAST_PX:
        return ""
    if len(spots) > 1 and spots[1].area > _SECOND * spots[0].area:
        return "is split, or there are two"
    if spots[0].solidity < _SOLID:
        return f"has a speck in it: it fills {spots[0].solidity:.0%} of its outline"
    return ""


def sphere_names(names: Sequence[str]) -> dict[str, list[str]]:
    """Return the names of photographs of spheres by the series that they belong to, which is their folder."""
    series: dict[str, list[str]] = {}
    for name in names:
        series.setdefault(name.rpartition("/")[0], []).append(name)
    return series
