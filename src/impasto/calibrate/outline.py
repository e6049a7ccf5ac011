"""Find mirror spheres in a photograph by their outlines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, gaussian_filter1d, map_coordinates
from scipy.optimize import least_squares

Array = NDArray[np.float64]
Circle = tuple[float, float, float]
"""Column, row and radius in pixels."""

# The search runs on an image of this size; the outline is then followed in the whole one.
_SEARCH_PX = 220
_RADIUS_SHARE = (0.06, 0.5)
_CANDIDATES = 12
_RAYS = 720
# How far from the last guess the outline is looked for, as shares of the radius.
_REACH = (0.08, 0.04, 0.02)
# Share of the rays on which a sphere's edge must lie on one circle within this share of its radius.
_LEAST_SUPPORT = 0.45
_ON_CIRCLE = 0.012


def find_circles(image: Array, count: int | None = None) -> list[Circle]:
    """Find the outlines of spheres.

    Parameters
    ----------
    image : ndarray of shape (H, W)
        Mean of photographs under many lights, so that no single highlight or shadow stands out.
    count : int, optional
        How many to find at most; by default all that have a clear outline.

    Returns
    -------
    list of (column, row, radius)
        From left to right.
    """
    from skimage.feature import canny
    from skimage.transform import hough_circle, hough_circle_peaks, rescale

    height, width = image.shape
    factor = min(1.0, _SEARCH_PX / min(height, width))
    level = _even(image)
    small = rescale(level, factor, anti_aliasing=True)
    edges = canny(small, sigma=1.5, low_threshold=0.85, high_threshold=0.95, use_quantiles=True)
    low, high = (int(share * min(small.shape)) for share in _RADIUS_SHARE)
    radii = np.arange(max(low, 6), high + 1)
    votes = hough_circle(edges, radii)
    # A small circle is filled by few chance edges, so larger ones come first.
    votes *= np.sqrt(radii / radii[-1])[:, None, None]
    _, columns, rows, sizes = hough_circle_peaks(votes, radii, total_num_peaks=_CANDIDATES)
    found: list[tuple[float, Circle]] = []
    for column, row, size in zip(columns, rows, sizes, strict=True):
        circle = ((column + 0.5) / factor - 0.5, (row + 0.5) / factor - 0.5, size / factor)
        if any(_overlap(circle, other) for _, other in found):
            continue
        edge = follow_outline(level, circle)
        if edge is None:
            continue
        support, refined = edge[0], _fit_circle(edge[1])
        if support >= _LEAST_SUPPORT and not any(_overlap(refined, other) for _, other in found):
            found.append((support, refined))
    found.sort(reverse=True)
    return sorted(circle for _, circle in found[:count])


def outline_points(image: Array, circle: Circle) -> Array | None:
    """Return where the edge of a sphere crosses rays from its centre, to sub-pixel.

    Parameters
    ----------
    image : ndarray of shape (H, W)
    circle : (column, row, radius)
        Within a few per cent of the sphere's.

    Returns
    -------
    ndarray of shape (N, 2) or None
        Columns and rows of the points that lie on one smooth curve; None where there is no outline.
    """
    edge = follow_outline(_even(image), circle)
    return None if edge is None else edge[1]


def follow_outline(level: Array, circle: Circle) -> tuple[float, Array] | None:
    """Follow an outline, in ever narrower bands about it.

    Returns
    -------
    support : float
        Share of the rays whose strongest edge lies on one circle.
    points : ndarray of shape (N, 2)
        Columns and rows of these edges.
    """
    points = np.empty((0, 2))
    for reach in _REACH:
        column, row, radius = circle
        points = _edges_on_rays(level, circle, reach * radius)
        if len(points) < 20:
            return None
        circle = _fit_circle(points)
        off = np.abs(np.hypot(points[:, 0] - circle[0], points[:, 1] - circle[1]) - circle[2])
        # A tilted camera makes the outline an ellipse, by less than this.
        points = points[off <= max(_ON_CIRCLE * circle[2], 1.0)]
        if len(points) < 20:
            return None
        if not (0.5 < circle[2] / radius < 2 and np.hypot(circle[0] - column, circle[1] - row) < radius):
            return None
    return len(points) / _RAYS, points


def _even(image: Array) -> Array:
    """Return a logarithm of the image in which dark and bright edges count alike, slightly smoothed."""
    image = np.asarray(image, np.float64)
    floor = max(float(np.percentile(image, 50)) * 0.1, 1e-6 * float(image.max()), 1e-12)
    return np.asarray(gaussian_filter(np.log(np.maximum(image, 0) + floor), 1.0))


def _edges_on_rays(level: Array, circle: Circle, reach: float) -> Array:
    column, row, radius = circle
    angle = np.arange(_RAYS) * (2 * np.pi / _RAYS)
    reach = max(reach, 3.0)
    step = 0.25 if reach < 60 else reach / 240
    distance = radius + np.arange(-reach, reach + step, step)
    columns = column + np.cos(angle)[:, None] * distance
    rows = row + np.sin(angle)[:, None] * distance
    height, width = level.shape
    whole = (columns >= 1) & (columns <= width - 2) & (rows >= 1) & (rows <= height - 2)
    inside = whole.all(axis=1)
    if not inside.any():
        return np.empty((0, 2))
    profile = map_coordinates(level, [rows[inside], columns[inside]], order=1)
    slope = np.abs(gaussian_filter1d(profile, max(1.0 / step, 0.02 * radius / step / 4), axis=1, order=1))
    best = np.clip(slope.argmax(axis=1), 1, slope.shape[1] - 2)
    ray = np.arange(len(best))
    before, peak, after = slope[ray, best - 1], slope[ray, best], slope[ray, best + 1]
    bend = before - 2 * peak + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1), 0.0)
    edge = (slope[ray, 0] < peak) & (slope[ray, -1] < peak)
    clear = edge & (peak > 0.1 * np.median(peak))
    at = distance[best] + np.clip(shift, -0.5, 0.5) * step
    direction = np.column_stack([np.cos(angle[inside]), np.sin(angle[inside])])
    return np.asarray((np.array([column, row]) + at[:, None] * direction)[clear])


def _fit_circle(points: Array) -> Circle:
    """Fit a circle that the outliers among points (N, 2) do not move."""
    from skimage.measure import CircleModel, ransac

    scale = float(np.ptp(points, axis=0).max()) / 2
    model, inliers = ransac(
        points, CircleModel, min_samples=3, residual_threshold=0.006 * scale + 0.3, max_trials=200, rng=0
    )
    chosen = points if model is None or inliers.sum() < 8 else points[inliers]
    start = (*chosen.mean(axis=0), scale) if model is None else (*model.center, model.radius)

    def off(at: Array) -> Array:
        return np.asarray(np.hypot(chosen[:, 0] - at[0], chosen[:, 1] - at[1]) - at[2])

    column, row, radius = least_squares(off, start, loss="soft_l1", f_scale=0.3).x
    return float(column), float(row), float(abs(radius))


def _overlap(one: Circle, other: Circle) -> bool:
    apart = float(np.hypot(one[0] - other[0], one[1] - other[1]))
    return apart < 0.8 * max(one[2], other[2])


def circle_problem(circle: Sequence[float], shape: Sequence[int]) -> str:
    """Return what is wrong with a circle for an image of a shape (H, W), "" if nothing is."""
    column, row, radius = circle
    if not 5 <= radius <= max(shape[:2]):
        return f"has a radius of {radius:g} pixels, expected 5 to {max(shape[:2])}"
    if not (0 <= column < shape[1] and 0 <= row < shape[0]):
        return f"is centred outside of the image of {shape[1]} x {shape[0]} pixels"
    return ""
