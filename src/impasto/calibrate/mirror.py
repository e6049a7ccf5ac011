"""Mirror spheres before a camera: where they lie, and from where the light comes that is seen in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label
from scipy.optimize import least_squares

from impasto.calibrate.outline import Circle
from impasto.geometry import Camera

Array = NDArray[np.float64]

# A lamp's image is what reaches this share of its brightest pixel; where that is clipped, its core alone,
# because glare and scratches draw out the rest, unless so few pixels are in it that their edges matter more.
_LAMP_SHARE, _CORE_SHARE, _CORE_PX = 0.2, 0.9, 60
# A lamp outshines everything else in a sphere by this factor; dimmer spots are the room.
_LEAST_CONTRAST = 4.0
# The grazing rim shows half of the room squeezed into a few pixels.
_RIM = 0.97


@dataclass(frozen=True)
class Rays:
    """The lines of sight of a camera's pixels.

    Parameters
    ----------
    camera : Camera
        Pixels are places on the painting's plane; where `mm_per_px` is unknown, lengths are in pixels.
    height, width : int
        Size of the image in pixels.
    """

    camera: Camera
    height: int
    width: int

    @property
    def px(self) -> float:
        """Size of a pixel in the painting's plane."""
        return self.camera.mm_per_px or 1.0

    def __call__(self, columns: Array, rows: Array) -> tuple[Array, Array]:
        """Return a point of each pixel's line of sight and its direction into the scene, shape (N, 3)."""
        x = (np.asarray(columns, np.float64) - (self.width - 1) / 2) * self.px
        y = ((self.height - 1) / 2 - np.asarray(rows, np.float64)) * self.px
        place = np.stack([x, y, np.zeros_like(x)], axis=-1)
        if self.camera.distance_mm is None:
            return place, np.broadcast_to(-self.camera.view_direction, place.shape)
        towards = place - self.camera.distance_mm * self.camera.view_direction
        return place, towards / np.linalg.norm(towards, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Sphere:
    """A mirror sphere that rests on the painting's plane.

    Parameters
    ----------
    centre : ndarray of shape (3,)
        In the painting's frame, in the unit of the rays: mm, or pixels.
    radius : float
        In the same unit.
    circle : (column, row, radius)
        Its outline in pixels.
    residual_px : float
        Root mean square distance of the outline's points from the sphere's outline; NaN for a circle given.
    """

    centre: Array
    radius: float
    circle: Circle
    residual_px: float


def locate_sphere(points: Array, rays: Rays) -> Sphere:
    """Return the sphere whose outline the points (N, 2), columns and rows, lie on.

    Notes
    -----
    The lines of sight to the outline touch the sphere: their distance from its centre is its radius. Its
    centre lies one radius above the painting's plane.
    """
    origin, direction = rays(points[:, 0], points[:, 1])

    def off(at: Array) -> Array:
        centre = np.array([at[0], at[1], at[2]])
        distance: Array = np.linalg.norm(np.cross(centre - origin, direction), axis=-1)
        return np.asarray((distance - at[2]) / rays.px)

    middle, reach = origin.mean(axis=0), np.ptp(origin, axis=0).max() / 2
    slope = direction.mean(axis=0)
    start = np.array([*(middle + slope * (reach / slope[2]) * -1.0)[:2], reach])
    fit = least_squares(off, start, loss="soft_l1", f_scale=0.3, x_scale=reach)
    x, y, radius = (float(value) for value in fit.x)
    circle = (float(points[:, 0].mean()), float(points[:, 1].mean()), radius / rays.px)
    residual = float(np.sqrt(np.mean(off(fit.x) ** 2)))
    return Sphere(np.array([x, y, radius]), radius, _outline_circle(points, circle), residual)


def given_sphere(circle: Circle, rays: Rays) -> Sphere:
    """Return the sphere whose outline is the circle given in pixels."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    points = np.column_stack([circle[0] + circle[2] * np.cos(angle), circle[1] + circle[2] * np.sin(angle)])
    found = locate_sphere(points, rays)
    return Sphere(found.centre, found.radius, circle, float("nan"))


def _outline_circle(points: Array, start: Circle) -> Circle:
    def off(at: Array) -> Array:
        return np.asarray(np.hypot(points[:, 0] - at[0], points[:, 1] - at[1]) - at[2])

    column, row, radius = least_squares(off, start, loss="soft_l1", f_scale=0.3).x
    return float(column), float(row), float(radius)


@dataclass(frozen=True)
class Reflection:
    """A lamp seen in a sphere.

    Parameters
    ----------
    point : ndarray of shape (3,)
        Where on the sphere it is seen.
    direction : ndarray of shape (3,)
        Unit vector from there towards the lamp.
    pixel : (column, row)
    irradiance : float
        Radiance times solid angle: irradiance on a surface that faces the lamp, as relative as the radiance.
    clipped : bool
        Whether samples of it are clipped, so that `irradiance` is too small.
    """

    point: Array
    direction: Array
    pixel: tuple[float, float]
    irradiance: float
    clipped: bool


def sphere_window(sphere: Sphere, height: int, width: int) -> tuple[slice, slice]:
    """Return the rows and columns of an image of that size in which a sphere lies."""
    column, row, radius = sphere.circle
    return (
        slice(max(0, int(row - radius)), min(height, int(row + radius) + 2)),
        slice(max(0, int(column - radius)), min(width, int(column + radius) + 2)),
    )


def find_reflection(
    image: NDArray[np.floating],
    background: NDArray[np.floating],
    clipped: NDArray[np.bool_],
    sphere: Sphere,
    rays: Rays,
) -> Reflection | None:
    """Find the lamp in a sphere.

    Parameters
    ----------
    image : ndarray of shape (rows, columns)
        Relative radiance under this lamp, in the sphere's window.
    background : ndarray of shape (rows, columns)
        The same under other lamps: what stays is no lamp.
    clipped : ndarray of shape (rows, columns), bool
    sphere : Sphere
    rays : Rays

    Returns
    -------
    Reflection or None
        None where nothing outshines the rest of the sphere.

    Notes
    -----
    Each pixel of the lamp's image shows one direction, l = d − 2 (d·n) n for the line of sight d and the
    normal n where it meets the sphere. Seen without perspective, all pixels show the same solid angle,
    4 dA / R², so that the mean of their directions, weighted by radiance, points to the middle of the lamp.
    """
    column, row, radius = sphere.circle
    rows, columns = np.mgrid[sphere_window(sphere, rays.height, rays.width)]
    inside = np.hypot(columns - column, rows - row) < _RIM * radius
    lit = np.where(inside, np.maximum(image - background, 0), 0).astype(np.float64)
    smooth = gaussian_filter(lit, max(0.7, radius / 150))
    peak = float(smooth.max())
    if peak <= _LEAST_CONTRAST * max(float(np.percentile(smooth[inside], 90)), 1e-9):
        return None
    at_peak = clipped[np.unravel_index(smooth.argmax(), smooth.shape)]
    core = at_peak and np.count_nonzero(smooth > _CORE_SHARE * peak) >= _CORE_PX
    regions, count = label((smooth > (_CORE_SHARE if core else _LAMP_SHARE) * peak) & inside)
    weight = np.bincount(regions.ravel(), lit.ravel(), minlength=count + 1)
    weight[0] = 0
    spot = regions == weight.argmax()
    values, spot_columns, spot_rows = lit[spot], columns[spot], rows[spot]
    origin, sight = rays(spot_columns, spot_rows)
    along = np.sum((sphere.centre - origin) * sight, axis=-1)
    nearest = origin + along[:, None] * sight
    inner = sphere.radius**2 - np.sum((nearest - sphere.centre) ** 2, axis=-1)
    hit = inner > 0
    point = nearest - np.sqrt(np.maximum(inner, 0))[:, None] * sight
    normal = (point - sphere.centre) / sphere.radius
    towards = sight - 2 * np.sum(sight * normal, axis=-1, keepdims=True) * normal
    values = np.where(hit, values, 0)
    total = float(values.sum())
    direction = (values[:, None] * towards).sum(axis=0)
    return Reflection(
        point=(values[:, None] * point).sum(axis=0) / total,
        direction=direction / np.linalg.norm(direction),
        pixel=(float(values @ spot_columns) / total, float(values @ spot_rows) / total),
        irradiance=total * 4 * (rays.px / sphere.radius) ** 2,
        clipped=bool(clipped[spot].any()),
    )
