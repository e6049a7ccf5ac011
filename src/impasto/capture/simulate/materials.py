"""Reflectance models in plain float64 numpy, straight from the papers' equations.

Written apart from the Rust core, so that what is simulated here checks what is fitted there. Every function
takes unit vectors of shape (N, 3) or (3,) that point away from the surface, and returns relative
radiance for a magnitude of 1: multiply by the diffuse or the specular magnitude.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Name of the model: name of its shape parameter.
SHAPES: dict[str, str] = {
    "lambert": "",
    "phong": "shininess",
    "torrance-sparrow": "c",
    "torrance-sparrow-gaussian": "m",
    "torrance-sparrow-smith": "c",
}


def dot(a: Array, b: Array) -> Array:
    """Return the scalar products of vectors of shape (N, 3) or (3,), ndarray of shape (N,) or ()."""
    if b.ndim == 1 or a.ndim == 1:
        return np.asarray(a @ b if b.ndim == 1 else b @ a)
    return np.asarray(np.einsum("ni,ni->n", a, b))


def half_vector(light_direction: Array, view_direction: Array) -> Array:
    """Return h = (l + v) / |l + v|, ndarray of shape (N, 3) or (3,)."""
    h = light_direction + view_direction
    return np.asarray(h / np.linalg.norm(h, axis=-1, keepdims=True))


def fresnel(cos_incidence: Array, index: float) -> Array:
    """Return the unpolarised reflectance of a smooth dielectric.

    Parameters
    ----------
    cos_incidence : ndarray of shape (N,) or ()
        Cosine of the angle of incidence, 0 to 1.
    index : float
        Index of refraction of the dielectric.

    References
    ----------
    [Born1999]_, section 1.5.
    """
    cos_i = np.clip(cos_incidence, 0.0, 1.0)
    cos_t = np.sqrt(1 - (1 - cos_i**2) / index**2)
    s_polarised = (cos_i - index * cos_t) / (cos_i + index * cos_t)
    p_polarised = (index * cos_i - cos_t) / (index * cos_i + cos_t)
    return np.asarray((s_polarised**2 + p_polarised**2) / 2)


def trowbridge_reitz(n_h: Array, c: Array) -> Array:
    """Return the facet distribution of ellipsoids of eccentricity c, 1 at n·h = 1; shapes broadcast.

    References
    ----------
    [TrowbridgeReitz1975]_; [Chen2007]_, Eq. 3.
    """
    return np.asarray((c**2 / (n_h**2 * (c**2 - 1) + 1)) ** 2)


def gaussian(n_h: Array, m: Array) -> Array:
    """Return the Gaussian facet distribution exp(−(δ/m)²), δ = acos(n·h).

    References
    ----------
    [TorranceSparrow1967]_; [Blinn1977]_.
    """
    return np.asarray(np.exp(-((np.arccos(np.minimum(n_h, 1.0)) / m) ** 2)))


def v_groove(n_l: Array, n_v: Array, n_h: Array, v_h: Array) -> Array:
    """Return the shadowing and masking of V-shaped grooves, min(1, 2 n·h n·v / v·h, 2 n·h n·l / v·h).

    References
    ----------
    [TorranceSparrow1967]_; [Blinn1977]_.
    """
    return np.asarray(np.minimum(1.0, 2 * n_h * np.minimum(n_v, n_l) / v_h))


def smith(n_l: Array, n_v: Array, c: Array) -> Array:
    """Return the height-correlated Smith shadowing and masking of Trowbridge-Reitz facets; shapes broadcast.

    References
    ----------
    [Heitz2014]_, Eqs. 72 and 99.
    """

    def shape(cosine: Array) -> Array:
        tan_squared = 1 / cosine**2 - 1
        return np.asarray((np.sqrt(1 + c**2 * tan_squared) - 1) / 2)

    return np.asarray(1 / (1 + shape(n_l) + shape(n_v)))


def specular_term(
    model: str, normal: Array, light_direction: Array, view_direction: Array, shape: Array, index: float = 1.5
) -> Array:
    """Return the specular term of a model for a specular magnitude of 1.

    Parameters
    ----------
    model : str
        One of `SHAPES`.
    normal : ndarray of shape (N, 3), float64
    light_direction, view_direction : ndarray of shape (N, 3) or (3,), float64
    shape : ndarray of shape (N,), float64
        c, m or shininess, as `SHAPES` names it; not used by ``lambert``.
    index : float
        Index of refraction.

    Returns
    -------
    ndarray of shape (N,), float64
        D F G / (n·v) with F at the facet's angle of incidence l·h, or max(0, r·v) ** shininess; 0 where the
        light or the camera is behind the surface element.

    References
    ----------
    [Chen2007]_, Eqs. 1 and 2.
    """
    n_l, n_v = dot(normal, light_direction), dot(normal, view_direction)
    seen = (n_l > 0) & (n_v > 0)
    term = np.zeros(normal.shape[0])
    if model == "lambert" or not seen.any():
        return term
    n_l, n_v = np.where(seen, n_l, 1.0), np.where(seen, n_v, 1.0)
    if model == "phong":
        r_v = 2 * n_l * n_v - dot(light_direction, view_direction)
        return np.where(seen, np.maximum(r_v, 0.0) ** shape, 0.0)
    h = half_vector(light_direction, view_direction)
    n_h, l_h = dot(normal, h), dot(light_direction, h)
    d = gaussian(n_h, shape) if model == "torrance-sparrow-gaussian" else trowbridge_reitz(n_h, shape)
    # v·h is l·h: the half vector lies halfway.
    g = smith(n_l, n_v, shape) if model == "torrance-sparrow-smith" else v_groove(n_l, n_v, n_h, l_h)
    return np.where(seen, d * fresnel(l_h, index) * g / n_v, 0.0)


def diffuse_term(normal: Array, light_direction: Array, view_direction: Array) -> Array:
    """Return Lambert's cosine n·l, ndarray of shape (N,); 0 where the light or the camera is behind."""
    n_l = dot(normal, light_direction)
    return np.where((n_l > 0) & (dot(normal, view_direction) > 0), n_l, 0.0)


def native_parameters(model: str, alpha: Array, kappa: Array) -> tuple[Array, Array]:
    """Return the specular magnitude and shape that give a model the lobe of a given facet width.

    Parameters
    ----------
    model : str
        One of `SHAPES`.
    alpha : ndarray of shape (...)
        Facet width of the Trowbridge-Reitz lobe.
    kappa : ndarray of shape (...)
        Its strength; 1 is the interface of a smooth dielectric.

    Returns
    -------
    specular, shape : ndarray of shape (...)

    Notes
    -----
    Radiance being scaled to a perfect white diffuser, the interface has As = κ/(4α²) and c = α. The other
    models get the same peak and, to second order in the angle from it, the same width: m = α/√2, shininess =
    1/α², and Phong's As takes in the Fresnel reflectance at normal incidence, 1/25 at index 1.5.
    """
    specular = kappa / (4 * alpha**2)
    if model == "phong":
        return specular / 25, 1 / alpha**2
    if model == "torrance-sparrow-gaussian":
        return specular, alpha / np.sqrt(2)
    if model == "lambert":
        return np.zeros_like(specular), np.full_like(specular, np.nan)
    return specular, alpha
