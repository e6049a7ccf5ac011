"""Cast shadows: march from each pixel towards the light over the height map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]

# A pixel lies partly in a shadow's edge; half a degree is about one pixel's share at a relief's distances.
LEAST_ANGULAR_SIZE_DEG = 0.5
_ROWS = 64


def visibility(
    height_mm: Map, mm_per_px: float, light_direction: NDArray[np.float64], angular_size_deg: float = 0.0
) -> Map:
    """Return how much of a distant light each pixel sees past the relief.

    Parameters
    ----------
    height_mm : ndarray of shape (H, W), float32, mm
    mm_per_px : float
    light_direction : ndarray of shape (3,)
        Unit vector, z > 0.
    angular_size_deg : float
        Angular diameter of the light; shadows get a penumbra of at least `LEAST_ANGULAR_SIZE_DEG`.

    Returns
    -------
    ndarray of shape (H, W), float32
        1 in full light, 0 in full shadow. Attached shadows (n·l ≤ 0) are the reflectance model's matter.

    Notes
    -----
    The horizon towards the light is the largest (height there − height here) / distance along the ray,
    sampled bilinearly every pixel, wider apart far away. The march ends where nothing is high enough.
    Beyond the painting's edge nothing rises.
    """
    elevation = float(np.arcsin(np.clip(light_direction[2], -1, 1)))
    radius = np.radians(max(angular_size_deg, LEAST_ANGULAR_SIZE_DEG)) / 2
    across = float(np.hypot(light_direction[0], light_direction[1]))
    visible = np.ones(height_mm.shape, np.float32)
    lowest, highest = float(height_mm.min()), float(height_mm.max())
    grazing = np.tan(elevation - radius) if elevation > radius else 0.0
    reach_px = max(height_mm.shape) if grazing <= 0 else (highest - lowest) / grazing / mm_per_px
    if across < 1e-9 or reach_px < 1:
        return visible
    step_column, step_row = light_direction[0] / across, -light_direction[1] / across
    distances = march_distances(min(reach_px, float(max(height_mm.shape))))
    pad = int(np.ceil(distances[-1])) + 2
    padded = np.pad(height_mm, pad, constant_values=lowest)
    for row in range(0, height_mm.shape[0], _ROWS):
        rows = slice(row, min(row + _ROWS, height_mm.shape[0]))
        here = height_mm[rows]
        horizon = np.full(here.shape, -np.inf, np.float32)
        for distance in distances:
            there = _shifted(padded, rows, here.shape[1], pad, distance * step_row, distance * step_column)
            there -= here
            there *= np.float32(1 / (distance * mm_per_px))
            np.maximum(horizon, there, out=horizon)
        visible[rows] = disc_fraction(elevation - np.arctan(horizon), radius)
    return visible


def near_visibility(
    height_mm: Map, mm_per_px: float, light_position_mm: NDArray[np.float64], angular_size_deg: float = 0.0
) -> Map:
    """Return how much of a near light each pixel sees; the direction to it changes over the painting.

    Parameters
    ----------
    height_mm : ndarray of shape (H, W), float32, mm
    mm_per_px : float
    light_position_mm : ndarray of shape (3,)
        In the painting's frame: X right, Y up, Z towards the viewer, from the image's centre.
    angular_size_deg : float
        As for `visibility`.

    Returns
    -------
    ndarray of shape (H, W), float32
    """
    from scipy.ndimage import map_coordinates  # slow to import

    height, width = height_mm.shape
    radius = np.radians(max(angular_size_deg, LEAST_ANGULAR_SIZE_DEG)) / 2
    lowest, highest = float(height_mm.min()), float(height_mm.max())
    column_of_light = light_position_mm[0] / mm_per_px + (width - 1) / 2
    row_of_light = -light_position_mm[1] / mm_per_px + (height - 1) / 2
    visible = np.ones(height_mm.shape, np.float32)
    for first in range(0, height, _ROWS):
        rows, columns = np.mgrid[first : min(first + _ROWS, height), 0:width].astype(np.float32)
        here = height_mm[first : first + _ROWS]
        to_row, to_column = row_of_light - rows, column_of_light - columns
        foot_px = np.hypot(to_row, to_column)
        rise = (light_position_mm[2] - here) / mm_per_px
        elevation = np.arctan2(rise, foot_px)
        lowest_sight = max(float(elevation.min()) - radius, 1e-3)
        reach_px = min((highest - lowest) / np.tan(lowest_sight) / mm_per_px, float(foot_px.max()))
        horizon = np.full(here.shape, -np.inf, np.float32)
        unit_row, unit_column = to_row / np.maximum(foot_px, 1), to_column / np.maximum(foot_px, 1)
        for distance in march_distances(reach_px):
            place = [rows + distance * unit_row, columns + distance * unit_column]
            there = map_coordinates(height_mm, place, order=1, cval=lowest)
            slope = (there - here) / np.float32(distance * mm_per_px)
            np.maximum(horizon, np.where(distance < foot_px, slope, -np.inf), out=horizon)
        visible[first : first + _ROWS] = disc_fraction(elevation - np.arctan(horizon), radius)
    return visible


def march_distances(reach_px: float) -> list[float]:
    """Return the distances in pixels at which a ray is sampled: every pixel, then 8 % further each time."""
    distances = [1.0]
    while distances[-1] < reach_px:
        distances.append(distances[-1] + max(1.0, 0.08 * distances[-1]))
    return distances


def disc_fraction(clearance: NDArray[np.floating], radius: float) -> Map:
    """Return the share of a disc above a straight horizon; its centre's clearance, of any shape, and its
    radius are in radians.
    """
    t = np.clip(clearance / radius, -1, 1)
    return np.asarray(0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi, dtype=np.float32)


def _shifted(padded: Map, rows: slice, width: int, pad: int, down: float, right: float) -> Map:
    """Return the heights at (row + down, column + right), bilinear, for a band of rows."""
    whole_down, whole_right = int(np.floor(down)), int(np.floor(right))
    part_down, part_right = down - whole_down, right - whole_right
    out = np.zeros((rows.stop - rows.start, width), np.float32)
    for row, weight_row in ((whole_down, 1 - part_down), (whole_down + 1, part_down)):
        for column, weight_column in ((whole_right, 1 - part_right), (whole_right + 1, part_right)):
            weight = weight_row * weight_column
            if weight > 1e-6:
                top, left = rows.start + pad + row, pad + column
                out += np.float32(weight) * padded[top : top + out.shape[0], left : left + width]
    return out
