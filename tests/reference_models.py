"""Every reflectance model of the method in float64 numpy, straight from the equations.

This is what the Rust core, the golden values and the benchmarks are held against, so it shares no code with
the package: one equation is one line, nothing is guarded beyond what the equation needs, and speed does not
matter. Directions are unit vectors of shape (..., 3) that point away from the surface.

References
----------
[Chen2007], [TorranceSparrow1967], [Blinn1977], [TrowbridgeReitz1975], [Heitz2014], [Burley2012], [Ward1992],
and [Born1999], section 1.5; in full in docs/references.md.
"""

from __future__ import annotations

import numpy as np

# Name: (names of the shape parameters, facet distribution, geometric attenuation).
MODELS = {
    "lambert": ((), None, None),
    "phong": (("shininess",), None, None),
    "torrance-sparrow": (("c",), "trowbridge-reitz", "v-groove"),
    "torrance-sparrow-gaussian": (("m",), "gaussian", "v-groove"),
    "torrance-sparrow-smith": (("c",), "trowbridge-reitz", "smith"),
    "gtr": (("c", "exponent"), "generalised-trowbridge-reitz", "v-groove"),
    "ward": (("alpha",), None, None),
}


def base_name(model):
    """Return a model's name without the suffix that adds or removes the ambient term."""
    return model.removesuffix("-ambient").removesuffix("-no")


def dot(a, b):
    """Return the scalar products of vectors of shape (..., 3)."""
    return np.sum(np.asarray(a) * np.asarray(b), axis=-1)


def unit(a):
    """Return vectors of shape (..., 3) divided by their lengths."""
    return np.asarray(a) / np.linalg.norm(a, axis=-1, keepdims=True)


def trowbridge_reitz(n_h, c):
    """D = [c² / ((n·h)² (c² − 1) + 1)]², 1 at n·h = 1 ([TrowbridgeReitz1975], [Chen2007] Eq. 3)."""
    return (c**2 / (n_h**2 * (c**2 - 1) + 1)) ** 2


def generalised_trowbridge_reitz(n_h, c, exponent):
    """D = [c² / ((n·h)² (c² − 1) + 1)]^exponent ([Burley2012])."""
    return (c**2 / (n_h**2 * (c**2 - 1) + 1)) ** exponent


def gaussian(n_h, m):
    """D = exp(−(δ/m)²), δ = acos(n·h) the facet's angle ([TorranceSparrow1967], [Blinn1977])."""
    return np.exp(-((np.arccos(np.clip(n_h, -1, 1)) / m) ** 2))


def fresnel_dielectric(cos_incident, index):
    """Exact unpolarised reflectance (Rs + Rp)/2 of a dielectric, entered from air ([Born1999])."""
    cos_refracted = np.sqrt(1 - (1 - cos_incident**2) / index**2)
    r_s = (cos_incident - index * cos_refracted) / (cos_incident + index * cos_refracted)
    r_p = (index * cos_incident - cos_refracted) / (index * cos_incident + cos_refracted)
    return (r_s**2 + r_p**2) / 2


def v_groove(n_h, n_v, n_l, v_h):
    """G = min(1, 2 (n·h)(n·v)/(v·h), 2 (n·h)(n·l)/(v·h)) ([TorranceSparrow1967], [Blinn1977])."""
    return np.minimum(1, np.minimum(2 * n_h * n_v / v_h, 2 * n_h * n_l / v_h))


def smith(n_l, n_v, alpha):
    """G = 1/(1 + Λ(l) + Λ(v)), height-correlated, Λ of the Trowbridge-Reitz D ([Heitz2014] Eqs. 72, 99)."""

    def auxiliary(cosine):
        return (np.sqrt(1 + alpha**2 * (1 - cosine**2) / cosine**2) - 1) / 2

    return 1 / (1 + auxiliary(n_l) + auxiliary(n_v))


def basis(model, shape, normal, light, view, *, index=1.5, fresnel="facet"):
    """Return what one unit of the diffuse and of the specular magnitude contributes to the radiance.

    Parameters
    ----------
    model : str
        A name in `MODELS`.
    shape : float or ndarray of shape (...) or, for a model of several shape parameters, (..., S)
        In the order of `MODELS`; ignored by `lambert`.
    normal, light, view : array_like of shape (..., 3)
        Unit vectors, broadcastable against each other and against `shape`.
    index : float
        Index of refraction.
    fresnel : {"facet", "element"}
        Whether F is taken at the facet's angle l·h or at the element's n·l.

    Returns
    -------
    diffuse, specular : ndarray of shape (...)
        max(0, n·l), and max(0, r·v)^shininess [Chen2007] Eq. 1, D F G/(n·v) [Chen2007] Eq. 2 or
        √(n·l/n·v) exp(−tan² δ/alpha²) [Ward1992] (zero for `lambert`); both zero where n·l ≤ 0 or n·v ≤ 0.
    """
    normal, light, view = np.broadcast_arrays(*(np.asarray(a, float) for a in (normal, light, view)))
    _, distribution, attenuation = MODELS[model]
    n_l, n_v = dot(normal, light), dot(normal, view)
    faces = (n_l > 0) & (n_v > 0)
    diffuse = np.where(faces, n_l, 0)
    if model == "lambert":
        return diffuse, np.zeros_like(diffuse)
    if model == "phong":
        mirror = 2 * n_l[..., None] * normal - light
        return diffuse, np.where(faces, np.maximum(0, dot(mirror, view)) ** shape, 0)
    # Elements that face away are evaluated at a harmless geometry and selected away below.
    up = np.array([0.0, 0.0, 1.0])
    normal, light, view = (np.where(faces[..., None], a, up) for a in (normal, light, view))
    half = unit(light + view)
    n_l, n_v, n_h, v_h = dot(normal, light), dot(normal, view), dot(normal, half), dot(view, half)
    if model == "ward":
        lobe = np.sqrt(n_l / n_v) * np.exp(-(1 / n_h**2 - 1) / np.asarray(shape) ** 2)
        return diffuse, np.where(faces, lobe, 0)
    if distribution == "generalised-trowbridge-reitz":
        d = generalised_trowbridge_reitz(n_h, *np.moveaxis(np.asarray(shape, float), -1, 0))
    else:
        d = trowbridge_reitz(n_h, shape) if distribution == "trowbridge-reitz" else gaussian(n_h, shape)
    f = fresnel_dielectric({"facet": v_h, "element": n_l}[fresnel], index)
    g = v_groove(n_h, n_v, n_l, v_h) if attenuation == "v-groove" else smith(n_l, n_v, shape)
    return diffuse, np.where(faces, d * f * g / n_v, 0)


def light_geometry(light_direction, light_position_mm, position_mm):
    """Return each light's direction and relative irradiance at points of the painting's plane.

    Parameters
    ----------
    light_direction : array_like of shape (L, 3)
    light_position_mm : array_like of shape (L, 3)
        NaN for a distant light.
    position_mm : array_like of shape (N, 2)

    Returns
    -------
    direction : ndarray of shape (L, N, 3)
    irradiance : ndarray of shape (L, N)
        On a surface facing the light, 1 at the origin: (|p|/|p − x|)².
    """
    points = np.pad(np.asarray(position_mm, float), ((0, 0), (0, 1)))
    source = np.asarray(light_position_mm, float)
    near = np.isfinite(source).all(axis=-1)
    source = np.where(near[:, None], source, [0.0, 0.0, 1.0])
    ray = source[:, None] - points
    distance = np.linalg.norm(ray, axis=-1)
    direction = np.where(near[:, None, None], unit(ray), np.asarray(light_direction, float)[:, None])
    fall_off = (np.linalg.norm(source, axis=-1)[:, None] / distance) ** 2
    return direction, np.where(near[:, None], fall_off, 1.0)


def view_geometry(view_direction, camera_distance_mm, position_mm):
    """Return the view directions of shape (N, 3) from points (N, 2) towards a camera; None: far away."""
    points = np.pad(np.asarray(position_mm, float), ((0, 0), (0, 1)))
    if camera_distance_mm is None:
        return np.broadcast_to(np.asarray(view_direction, float), points.shape)
    return unit(np.asarray(view_direction, float) * camera_distance_mm - points)


def radiance(
    model,
    normal,
    diffuse,
    specular,
    shape,
    ambient=None,
    *,
    light_direction,
    view_direction=(0.0, 0.0, 1.0),
    light_position_mm=None,
    light_intensity=None,
    camera_distance_mm=None,
    position_mm=None,
    light_rgb=None,
    index=1.5,
    fresnel="facet",
):
    """Return the relative radiance of every pixel under every light.

    Y = E [Ae + Ad max(0, n·l) + As s (lobe)], E the light's irradiance at the pixel, s the light's colour.

    Parameters
    ----------
    model : str
        A name in `MODELS`; a suffix that says whether the fit has an ambient term makes no difference here.
    normal : array_like of shape (N, 3)
    diffuse : array_like of shape (N, C)
    specular : array_like of shape (N,) or (N, 1)
    shape : array_like of shape (N,) or (N, S)
    ambient : array_like of shape (N, C), optional
    light_direction, light_position_mm : array_like of shape (L, 3)
    light_intensity : array_like of shape (L, C) or (L, 1)
    view_direction : array_like of shape (3,)
    camera_distance_mm : float, optional
    position_mm : array_like of shape (N, 2)
    light_rgb : array_like of shape (C,)
    index, fresnel
        As in `basis`.

    Returns
    -------
    ndarray of shape (L, N, C)
    """
    normal, diffuse = np.asarray(normal, float), np.asarray(diffuse, float)
    light_direction = np.asarray(light_direction, float)
    pixels, channels = diffuse.shape
    lights = len(light_direction)
    position_mm = np.zeros((pixels, 2)) if position_mm is None else position_mm
    light_position_mm = np.full((lights, 3), np.nan) if light_position_mm is None else light_position_mm
    intensity = np.ones((lights, 1)) if light_intensity is None else np.asarray(light_intensity, float)
    light_rgb = np.ones(channels) if light_rgb is None else np.asarray(light_rgb, float)

    light, irradiance = light_geometry(light_direction, light_position_mm, position_mm)
    view = view_geometry(view_direction, camera_distance_mm, position_mm)
    several = len(MODELS[base_name(model)][0])
    form = (pixels, several) if several > 1 else pixels
    flat_shape = np.zeros(pixels) if np.size(shape) == 0 else np.reshape(np.asarray(shape, float), form)
    flat_specular = np.zeros(pixels) if np.size(specular) == 0 else np.reshape(specular, pixels)
    of_diffuse, of_specular = basis(
        base_name(model), flat_shape, normal, light, view, index=index, fresnel=fresnel
    )
    total = of_diffuse[..., None] * diffuse + (of_specular * flat_specular)[..., None] * light_rgb
    if ambient is not None:
        total = total + np.asarray(ambient, float)
    return total * irradiance[..., None] * intensity[:, None, :]
