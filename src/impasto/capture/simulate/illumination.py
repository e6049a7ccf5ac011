"""Radiance of the simulated painting under one light, shadows included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.lamps import GOLDEN_ANGLE
from impasto.capture.simulate.materials import diffuse_term, specular_term
from impasto.capture.simulate.measured import MeasuredSet
from impasto.capture.simulate.shadows import near_visibility, visibility
from impasto.capture.simulate.surface import Surface
from impasto.geometry import Camera, Lights, pixel_position_mm

Array = NDArray[np.float64]
Map = NDArray[np.float32]

# Pixels evaluated at once: the working arrays of the models stay in the processor's cache.
_BAND_PX = 16384


@dataclass(frozen=True)
class Scene:
    """A painting before a camera.

    Parameters
    ----------
    surface : Surface
    camera : Camera
        Orthographic, or perspective with a distance; pixels are places on the painting, as in a rectified
        photograph, and relief causes no parallax.
    measured : MeasuredSet or None
        Needed where the surface's materials are measured.
    index : float
        Index of refraction of every interface.
    cast_shadows : bool
        Whether relief casts shadows.
    """

    surface: Surface
    camera: Camera
    measured: MeasuredSet | None = None
    index: float = 1.5
    cast_shadows: bool = True

    def radiance(self, lights: Lights, light: int, visible: Map | None = None) -> Map:
        """Return the painting's relative radiance under one light.

        Parameters
        ----------
        lights : Lights
        light : int
            Which of them.
        visible : ndarray of shape (H, W), optional
            What `visible` returns for this light, where it is known already.

        Returns
        -------
        ndarray of shape (H, W, 3), float32
            Relative radiance: 1 is a perfect white diffuser that faces a light of intensity 1.
        """
        height, width = self.surface.size
        if visible is None:
            visible = self.visible(lights, light)
        out = np.empty((height, width, 3), np.float32)
        band = max(1, _BAND_PX // width)
        for row in range(0, height, band):
            rows = slice(row, min(row + band, height))
            out[rows] = self._band(rows, lights, light).reshape(-1, width, 3) * visible[rows, :, None]
        return out

    def visible(self, lights: Lights, light: int) -> Map:
        """Return how much of one light each pixel sees past the relief, ndarray of shape (H, W), 0 to 1."""
        surface, size = self.surface, float(np.nan_to_num(lights.angular_size_deg[light]))
        if not self.cast_shadows:
            return np.ones(surface.size, np.float32)
        if np.isfinite(lights.position_mm[light]).all():
            return near_visibility(surface.height_mm, surface.mm_per_px, lights.position_mm[light], size)
        return visibility(surface.height_mm, surface.mm_per_px, lights.direction[light], size)

    def _band(self, rows: slice, lights: Lights, light: int) -> Array:
        """Return the radiance of a band of rows without cast shadows, ndarray of shape (N, 3)."""
        surface, materials = self.surface, self.surface.materials
        height, width = surface.size
        place = None
        if self.camera.distance_mm is not None or np.isfinite(lights.position_mm[light]).all():
            flat = pixel_position_mm(rows, slice(0, width), height, width, surface.mm_per_px)
            place = np.column_stack([flat.astype(np.float64), np.zeros(len(flat))])
        light_direction, fall_off = light_at(lights, light, place)
        view_direction = self._view(place)
        normal = surface.normal[rows].reshape(-1, 3).astype(np.float64)
        material = surface.material[rows].ravel()
        cosine = diffuse_term(normal, light_direction, view_direction)
        out = surface.diffuse[rows].reshape(-1, 3) * cosine[:, None]
        sources = disc_directions(light_direction, float(np.nan_to_num(lights.angular_size_deg[light])))
        if self.measured is not None:
            cosine = surface.strength[rows].ravel() * cosine
            for number in np.unique(material):
                here = _where(material == number)
                name, brdf = materials[number].measured or "", np.zeros(out[here].shape)
                for source in sources:
                    brdf += self.measured.brdf(name, normal[here], *_at(here, source, view_direction))
                out[here] = np.pi / len(sources) * brdf * cosine[here, None]
        specular = surface.specular[rows].ravel().astype(np.float64)
        shape = surface.shape[rows].ravel().astype(np.float64)
        tints = np.array([entry.tint for entry in materials])
        models = sorted({entry.model for entry in materials})
        model_of = np.array([models.index(entry.model) for entry in materials])[material]
        for number in np.unique(model_of):
            here = _where((model_of == number) & (specular > 0))
            lobe = np.zeros(len(specular[here]))
            for source in sources:
                towards, view = _at(here, source, view_direction)
                lobe += specular_term(models[number], normal[here], towards, view, shape[here], self.index)
            lobe *= specular[here] / len(sources)
            out[here] += lobe[:, None] * tints[material[here]]
        return np.asarray(out * (lights.intensity[light] * np.reshape(fall_off, (-1, 1))))

    def _view(self, place: Array | None) -> Array:
        """Return the view direction, one for all pixels or of shape (N, 3) with perspective."""
        if self.camera.distance_mm is None or place is None:
            return self.camera.view_direction
        towards = self.camera.distance_mm * self.camera.view_direction - place
        return np.asarray(towards / np.linalg.norm(towards, axis=-1, keepdims=True))


def light_at(lights: Lights, light: int, place: Array | None) -> tuple[Array, Array]:
    """Return the direction to a light and its relative irradiance at places on the painting.

    Parameters
    ----------
    lights : Lights
    light : int
    place : ndarray of shape (N, 3), mm, or None
        Needed for a near light.

    Returns
    -------
    light_direction : ndarray of shape (3,) or (N, 3)
    fall_off : ndarray of shape () or (N,)
        (distance from the centre / distance from the place)².
    """
    position = lights.position_mm[light]
    if place is None or not np.isfinite(position).all():
        return lights.direction[light], np.ones(())
    towards = position - place
    distance = np.linalg.norm(towards, axis=-1)
    return towards / distance[:, None], (position @ position) / distance**2


def disc_directions(light_direction: Array, angular_size_deg: float) -> list[Array]:
    """Return directions spread over the disc of a source, of equal weight; the centre alone for a point.

    Parameters
    ----------
    light_direction : ndarray of shape (3,) or (N, 3)
    angular_size_deg : float
        The disc's angular diameter.

    Notes
    -----
    A golden-angle spiral, whose places have equal shares of the disc. They lie about 0.3° apart, closer than
    the narrowest lobes of paint are wide.
    """
    if angular_size_deg <= 0:
        return [light_direction]
    helper = np.where(np.abs(light_direction[..., :1]) < 0.8, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(light_direction, helper)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second = np.cross(light_direction, first)
    number = int(np.clip(8 * angular_size_deg**2, 12, 300))
    reach = np.tan(np.radians(angular_size_deg) / 2) * np.sqrt((np.arange(number) + 0.5) / number)
    turn = GOLDEN_ANGLE * np.arange(number)
    sources = [
        light_direction + r * (np.cos(t) * first + np.sin(t) * second)
        for r, t in zip(reach, turn, strict=True)
    ]
    return [source / np.linalg.norm(source, axis=-1, keepdims=True) for source in sources]


def _where(mask: NDArray[np.bool_]) -> slice | NDArray[np.bool_]:
    """Return what selects the pixels of a mask; all of them without copying."""
    return slice(None) if mask.all() else mask


def _at(here: slice | NDArray[np.bool_], *directions: Array) -> list[Array]:
    """Return directions for the chosen pixels."""
    return [direction if direction.ndim == 1 else direction[here] for direction in directions]
