"""The simulator's paint box: pigments with their colour, their surface and a measured stand-in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Paint:
    """One paint.

    Parameters
    ----------
    name : str
    albedo : tuple of float
        Diffuse reflectance in linear sRGB primaries.
    alpha : float
        Facet width of the paint's own surface, which the varnish evens out.
    kappa : float
        Strength of the interface's reflection: 1 is a smooth dielectric of index 1.5 (κ = 4c²As).
    tint : tuple of float
        Colour of the specular reflection; not white only for metals.
    measured : str
        The material of the measured set that stands in for this paint when measured materials are used.
    """

    name: str
    albedo: tuple[float, float, float]
    alpha: float = 0.2
    kappa: float = 0.8
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    measured: str = "nielsen/cardboard"


# Albedos are ours, after the look of the dry pigments in oil; the order is the material index in the truth.
PAINTS: tuple[Paint, ...] = (
    Paint("ground", (0.62, 0.52, 0.40), 0.35, 0.5, measured="nielsen/cardboard"),
    Paint("lead white", (0.86, 0.83, 0.75), 0.17, 0.9, measured="rgl/cm_white"),
    Paint("lead-tin yellow", (0.80, 0.58, 0.12), 0.18, 0.9, measured="merl/yellow-phenolic"),
    Paint("yellow ochre", (0.50, 0.28, 0.075), 0.30, 0.6, measured="merl/yellow-matte-plastic"),
    Paint("burnt sienna", (0.21, 0.072, 0.028), 0.28, 0.6, measured="merl/cherry-235"),
    Paint("raw umber", (0.085, 0.058, 0.036), 0.32, 0.55, measured="merl/light-brown-fabric"),
    Paint("vermilion", (0.60, 0.07, 0.028), 0.16, 0.9, measured="merl/specular-red-phenolic"),
    Paint("madder lake", (0.24, 0.017, 0.026), 0.11, 1.0, measured="merl/maroon-plastic"),
    Paint("ultramarine", (0.030, 0.062, 0.34), 0.14, 0.95, measured="merl/blue-acrylic"),
    Paint("terre verte", (0.105, 0.165, 0.060), 0.25, 0.7, measured="merl/green-latex"),
    Paint("ivory black", (0.022, 0.021, 0.020), 0.12, 0.9, measured="merl/black-phenolic"),
    Paint("shell gold", (0.42, 0.25, 0.055), 0.105, 6.0, (1.0, 0.74, 0.33), "merl/gold-metallic-paint"),
    Paint("retouching", (0.16, 0.115, 0.075), 0.48, 0.2, measured="merl/special-walnut-224"),
)

INDEX: dict[str, int] = {paint.name: number for number, paint in enumerate(PAINTS)}


def mix(*parts: tuple[str, float]) -> NDArray[np.float64]:
    """Return the albedo of a mixture of paints, ndarray of shape (3,).

    Parameters
    ----------
    *parts : tuple of (str, float)
        Paint names with their shares, which need not add up to 1.

    Notes
    -----
    The geometric mean, because pigments absorb one after another: blue and yellow make green, not grey.
    """
    shares = np.array([share for _, share in parts], dtype=np.float64)
    logs = np.array([np.log(PAINTS[INDEX[name]].albedo) for name, _ in parts])
    return np.asarray(np.exp(shares @ logs / shares.sum()))
