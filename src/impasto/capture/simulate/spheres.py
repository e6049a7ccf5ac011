"""Mirror spheres, in which the lights' directions can be seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.illumination import light_at
from impasto.geometry import Array, Camera, Lights, degrees_between, pixel_position_mm

SPHERES_PX = (200, 360)
CENTRES_MM = ((-43.0, 0.0), (43.0, 0.0))
RADIUS_MM = 36.0
MM_PER_PX = 0.5
# A lamp's housing is seen in a mirror even where the painting takes the lamp for a point.
_LEAST_LAMP_DEG = 5.0
_LAMP_RADIANCE = 20.0
_CLOTH = 0.01
CARD_MM = (0.0, 44.0)
"""Where the middle of a white card lies, 9 mm wide and high."""
_CARD_MM = 9.0
_FINE = 4


def table(camera: Camera) -> str:
    """Return the spheres' CSV: where they lie in mm, and where in pixels their outline is centred.

    Notes
    -----
    A sphere of radius R that rests on the painting's plane is centred at height R. Pixels are places on that
    plane, seen along the view direction, so the outline is shifted against the camera's tilt.
    """
    height, width = SPHERES_PX
    shift = RADIUS_MM * camera.view_direction[:2] / camera.view_direction[2]
    lines = ["sphere,x_mm,y_mm,z_mm,radius_mm,mm_per_px,column_px,row_px,radius_px"]
    for number, (x, y) in enumerate(CENTRES_MM, start=1):
        column = (x - shift[0]) / MM_PER_PX + (width - 1) / 2
        row = -(y - shift[1]) / MM_PER_PX + (height - 1) / 2
        lines.append(
            f"{number},{x},{y},{RADIUS_MM},{RADIUS_MM},{MM_PER_PX},"
            f"{column:.3f},{row:.3f},{RADIUS_MM / MM_PER_PX:.3f}"
        )
    return "\n".join(lines) + "\n"


def radiance(camera: Camera, lights: Lights, light: int) -> Array:
    """Return two chrome spheres and a white card on black cloth under one light, without perspective.

    Parameters
    ----------
    camera : Camera
    lights : Lights
    light : int
        Which of them.

    Returns
    -------
    ndarray of shape (H, W, 3), relative radiance

    Notes
    -----
    Each pixel's ray meets the sphere at a point with normal n, and shows what lies towards 2 (n·v) n − v: the
    lamp, a small disc with soft edges, or the dim studio.
    """
    height, width = SPHERES_PX
    flat = pixel_position_mm(slice(0, height), slice(0, width), height, width, MM_PER_PX)
    place = np.column_stack([flat.astype(np.float64), np.zeros(len(flat))])
    image, lamp = _seen(place, camera, lights, light)
    fine = np.flatnonzero(lamp)
    # A lamp's image is a few pixels wide, each of which collects what falls on all of its area.
    offset = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    offsets = np.array([(x, y, 0.0) for x in offset for y in offset]) * MM_PER_PX
    parts = (place[fine, None] + offsets).reshape(-1, 3)
    image[fine] = _seen(parts, camera, lights, light)[0].reshape(-1, len(offsets)).mean(axis=1)
    return np.asarray(image.reshape(height, width, 1) * np.broadcast_to(lights.intensity[light], 3))


def _seen(place: Array, camera: Camera, lights: Lights, light: int) -> tuple[Array, NDArray[np.bool_]]:
    """Return the radiance seen at places on the plane (N, 3), and where the lamp is in it or close by."""
    view = camera.view_direction
    card = (np.abs(place[:, :2] - CARD_MM) <= _CARD_MM / 2).all(axis=1)
    direction, fall_off = light_at(lights, light, place)
    image = np.where(card, direction[..., 2] * fall_off, _CLOTH)
    near = np.zeros(len(place), bool)
    lamp_deg = max(_LEAST_LAMP_DEG, float(np.nan_to_num(lights.angular_size_deg[light])))
    for x, y in CENTRES_MM:
        centre = np.array([x, y, RADIUS_MM])
        along = (place - centre) @ view
        squared = along**2 - np.sum((place - centre) ** 2, axis=-1) + RADIUS_MM**2
        hit = squared > 0
        point = place[hit] + (np.sqrt(squared[hit]) - along[hit])[:, None] * view
        normal = (point - centre) / RADIUS_MM
        mirror = 2 * (normal @ view)[:, None] * normal - view
        towards, _ = light_at(lights, light, point)
        off_deg = degrees_between(mirror, towards)
        lamp = np.clip(1.5 - off_deg / (lamp_deg / 2), 0, 1)
        studio = 0.02 + 0.03 * np.maximum(mirror[:, 2], 0)
        image[hit] = studio + _LAMP_RADIANCE * lamp
        near[hit] = off_deg < lamp_deg + np.degrees(2 * MM_PER_PX / RADIUS_MM)
    return image, near
