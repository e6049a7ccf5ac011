"""Every reflectance model of the method in float64 numpy, straight from the equations.

This is what the Rust core, the golden values and the benchmarks are held against, so it shares no code with
the package: one equation is one line, nothing is guarded beyond what the equation needs, and speed does not
matter. Directions are unit vectors of shape (..., 3) that point away from the surface.

References
----------
[Chen2007], [TorranceSparrow1967], [Blinn1977], [TrowbridgeReitz1975], [Heitz2014], [Burley2012], [Ward1992],
[OrenNayar1994], and [Born1999], section 1.5; in full in docs/references.md.
"""

from __future__ import annotations

import numpy as np

# Name: (names of the shape parameters, facet distribution, geometric attenuation).
MODELS = {
    "lambert": ((), None, None),
    "oren-nayar": (("sigma",), None, None),
    "phong": (("shininess",), None, None),
    "torrance-sparrow": (("c",), "trowbridge-reitz", "v-groove"),
    "torrance-sparrow-gaussian": (("m",), "gaussian", "v-groove"),
    "torrance-sparrow-smith": (("c",), "trowbridge-reitz", "smith"),
    "torrance-sparrow-2": (("c", "c2"), "trowbridge-reitz", "v-groove"),
    "gtr": (("c", "exponent"), "generalised-trowbridge-reitz", "v-groove"),
    "ward": (("alpha",), None, None),
    "ward-anisotropic": (("alpha_x", "alpha_y", "correlation"), None, None),
}

# A shape that every test of fitting and of physics can use.
TYPICAL = {
    "c": 0.25,
    "c2": 0.7,
    "m": 0.25,
    "shininess": 30.0,
    "alpha": 0.25,
    "alpha_x": 0.2,
    "alpha_y": 0.3,
    "correlation": 0.4,
    "exponent": 1.6,
    "sigma": 0.5,
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


def bivariate_gaussian(x, y, alpha_x, alpha_y, correlation):
    """exp(−s Σ⁻¹ s / 2) of slopes s = (x, y), with Σ = [[αx², ρ αx αy], [ρ αx αy, αy²]]/2 ([Heitz2014])."""
    covariance = np.stack(
        [
            np.stack([alpha_x**2, correlation * alpha_x * alpha_y], -1),
            np.stack([correlation * alpha_x * alpha_y, alpha_y**2], -1),
        ],
        -2,
    )
    slope = np.stack(np.broadcast_arrays(x, y), -1)[..., None]
    return np.exp(-np.sum(slope * (np.linalg.inv(covariance / 2) @ slope), axis=(-2, -1)) / 2)


def turned_axes(normal):
    """Return X and Y turned by the shortest rotation from Z to the normal."""
    axis = np.cross([0.0, 0.0, 1.0], normal)
    cosine = normal[..., 2:]

    def turn(a):
        along = np.sum(axis * a, axis=-1, keepdims=True)
        return a * cosine + np.cross(axis, a) + axis * along / (1 + cosine)

    return turn(np.array([1.0, 0.0, 0.0])), turn(np.array([0.0, 1.0, 0.0]))


def oren_nayar(n_l, n_v, l_v, sigma):
    """A + B max(0, cos φ) sin α tan β from the angles themselves ([OrenNayar1994] Eq. 30)."""
    theta_l, theta_v = np.arccos(np.clip(n_l, -1, 1)), np.arccos(np.clip(n_v, -1, 1))
    sines = np.sin(theta_l) * np.sin(theta_v)
    cos_phi = np.where(sines > 0, (l_v - n_l * n_v) / np.where(sines > 0, sines, 1), 0)
    a = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    larger, smaller = np.maximum(theta_l, theta_v), np.minimum(theta_l, theta_v)
    return a + b * np.maximum(0, cos_phi) * np.sin(larger) * np.tan(smaller)


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
    diffuse : ndarray of shape (...)
        max(0, n·l), times `oren_nayar` for that model; zero where n·l ≤ 0 or n·v ≤ 0.
    specular : ndarray of shape (...), or (..., 2) for two lobes
        max(0, r·v)^shininess [Chen2007] Eq. 1, D F G/(n·v) [Chen2007] Eq. 2 or √(n·l/n·v) exp(−q) [Ward1992]
        (zero for the diffuse models); zero where n·l ≤ 0 or n·v ≤ 0.
    """
    normal, light, view = np.broadcast_arrays(*(np.asarray(a, float) for a in (normal, light, view)))
    _, distribution, attenuation = MODELS[model]
    n_l, n_v = dot(normal, light), dot(normal, view)
    faces = (n_l > 0) & (n_v > 0)
    diffuse = np.where(faces, n_l, 0)
    if model == "lambert":
        return diffuse, np.zeros_like(diffuse)
    if model == "oren-nayar":
        roughened = n_l * oren_nayar(n_l, n_v, dot(light, view), np.asarray(shape, float))
        return np.where(faces, roughened, 0), np.zeros_like(diffuse)
    if model == "torrance-sparrow-2":
        each = [
            basis("torrance-sparrow", c, normal, light, view, index=index, fresnel=fresnel)[1]
            for c in np.moveaxis(np.asarray(shape, float), -1, 0)
        ]
        return diffuse, np.stack(each, -1)
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
    if model == "ward-anisotropic":
        x_axis, y_axis = turned_axes(normal)
        slopes = dot(half, x_axis) / n_h, dot(half, y_axis) / n_h
        q = bivariate_gaussian(*slopes, *np.moveaxis(np.asarray(shape, float), -1, 0))
        return diffuse, np.where(faces, np.sqrt(n_l / n_v) * q, 0)
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
    specular : array_like of shape (N,) or (N, lobes)
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
    of_diffuse, of_specular = basis(
        base_name(model), flat_shape, normal, light, view, index=index, fresnel=fresnel
    )
    of_specular = of_specular.reshape(*of_diffuse.shape, -1)
    magnitude = np.zeros((pixels, 1)) if np.size(specular) == 0 else np.reshape(specular, (pixels, -1))
    total = of_diffuse[..., None] * diffuse + (of_specular * magnitude).sum(-1)[..., None] * light_rgb
    if ambient is not None:
        total = total + np.asarray(ambient, float)
    return total * irradiance[..., None] * intensity[:, None, :]
