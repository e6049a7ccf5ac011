"""The glossmeter of the standards, by integration over its source and its receptor.

A collimated beam falls on the sample at 20, 60 or 85°; the receptor takes what leaves around the mirror
direction. A reading is the flux received in per cent of what polished black glass of index 1.567 gives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from impasto.geometry import Array

GLASS_INDEX = 1.567
"""Of the primary standard, polished black glass, which reads 100 gloss units at every angle."""

Radiance = Callable[[Array, Array], Array]
"""Relative radiance (N,) for directions of light and view (N, 3) in the frame of the surface."""


@dataclass(frozen=True)
class Glossmeter:
    """One geometry of the standard.

    Parameters
    ----------
    angle_deg : float
        Angle of incidence and of the receptor.
    source_deg, receptor_deg : tuple of float
        Full angular size of the apertures, in the plane of incidence and perpendicular to it.

    References
    ----------
    [ISO2813]_, [ASTMD523]_. The apertures are quoted at second hand; the corrections for a diffuser that the
    standard gives (1.2, 2.5 and 0.03 units) follow from them.
    """

    angle_deg: float
    source_deg: tuple[float, float]
    receptor_deg: tuple[float, float]

    def rays(self, points: Array) -> tuple[Array, Array, Array]:
        """Return rays from the source to the receptor.

        Parameters
        ----------
        points : ndarray of shape (N, 4)
            Uniform in the unit cube: place in the source and in the receptor.

        Returns
        -------
        light, view : ndarray of shape (N, 3)
            Unit vectors in the frame of the surface, with its normal along Z and the beam from −X.
        weight : ndarray of shape (N,)
            The reading of a surface is the mean of weight times relative radiance, in units of the incident
            flux.
        """
        offset = np.radians((points - 0.5) * [*self.source_deg, *self.receptor_deg])
        angle = np.radians(self.angle_deg)
        light = _direction(-angle - offset[:, 0], offset[:, 1])
        view = _direction(angle + offset[:, 2], offset[:, 3])
        solid_angle = np.cos(offset[:, 3]) * np.prod(np.radians(self.receptor_deg))
        # Relative radiance is π times the BRDF times cos θi; flux is received by cos θr dω.
        return light, view, view[:, 2] * solid_angle / (np.pi * light[:, 2])

    @property
    def glass(self) -> float:
        """The reading of the black glass in units of the incident flux."""
        return self.mirror(GLASS_INDEX)

    def mirror(self, index: float) -> float:
        """Return the reading of a smooth surface in units of the incident flux.

        Parameters
        ----------
        index : float
            Index of refraction.
        """
        # What the source sends all falls into the receptor, which is larger.
        light, _, _ = self.rays(quadrature(12, 4))
        return float(fresnel_reflectance(light[:, 2], index).mean())

    def gloss(self, reading: ArrayLike) -> Array:
        """Return gloss units for readings in units of the incident flux."""
        return 100.0 * np.asarray(reading, np.float64) / self.glass

    def measure(self, radiance: Radiance, *, log2_rays: int = 17) -> float:
        """Return the gloss units of a flat surface.

        Parameters
        ----------
        radiance : callable
            Relative radiance (N,) of the surface for unit vectors to the light and to the eye (N, 3), where
            1 is a perfect white diffuser lit along its normal.
        log2_rays : int, optional
            How many rays are traced, as a power of two.
        """
        light, view, weight = self.rays(quadrature(log2_rays, 4))
        return float(self.gloss(np.mean(weight * radiance(light, view))))


GLOSSMETERS = (
    Glossmeter(20.0, (0.75, 2.5), (1.80, 3.6)),
    Glossmeter(60.0, (0.75, 2.5), (4.4, 11.7)),
    Glossmeter(85.0, (0.75, 2.5), (4.0, 6.0)),
)


@cache
def quadrature(log2_points: int, dimensions: int) -> Array:
    """Return points that fill the unit cube evenly: Sobol's sequence [Sobol1967]_, the same at each call.

    Parameters
    ----------
    log2_points : int
        How many, as a power of two.
    dimensions : int

    Returns
    -------
    ndarray of shape (2 ** log2_points, dimensions), read-only
    """
    points = qmc.Sobol(dimensions, scramble=True, rng=2813).random_base2(log2_points)
    points.setflags(write=False)
    return np.asarray(points)


def fresnel_reflectance(cosine: ArrayLike, index: float) -> Array:
    """Return the reflectance of unpolarised light at a smooth dielectric.

    Parameters
    ----------
    cosine : ndarray
        Cosine of the angle of incidence.
    index : float
        Index of refraction.

    References
    ----------
    [CookTorrance1982]_, Eq. 15.
    """
    cosine = np.asarray(cosine, np.float64)
    g = np.sqrt(index**2 - 1.0 + cosine**2)
    ratio = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    result: Array = 0.5 * ((g - cosine) / (g + cosine)) ** 2 * (1.0 + ratio**2)
    return result


def _direction(in_plane: Array, across: Array) -> Array:
    """Return unit vectors (N, 3) at angles in the plane of incidence, from Z to X, and out of it, to Y."""
    return np.stack(
        [np.sin(in_plane) * np.cos(across), np.sin(across), np.cos(in_plane) * np.cos(across)], axis=-1
    )
