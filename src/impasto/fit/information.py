"""What photographs tell of a pixel: slopes of its radiance, and the Fisher information in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from impasto import _core
from impasto.geometry import Array, Camera, Lights
from impasto.pixels import Pixels, luminance, near_positions_mm


def parameter_names(pixels: Pixels) -> tuple[str, ...]:
    """Return what the last axis of `radiance_slopes` counts.

    ``tilt_x`` and ``tilt_y`` turn the normal, in radians; all others are logarithms, but for the
    shape parameters that may be negative.
    """
    channels = pixels.diffuse.shape[1]
    numbered = [""] if channels == 1 else [f"_{channel}" for channel in range(channels)]
    lobes = [""] if pixels.model.lobes == 1 else [f"_{lobe}" for lobe in range(pixels.model.lobes)]
    return (
        "tilt_x",
        "tilt_y",
        *pixels.model.shape_names,
        *(f"specular{lobe}" for lobe in lobes),
        *(f"diffuse{channel}" for channel in numbered),
        *(f"ambient{channel}" for channel in numbered if pixels.ambient is not None),
    )


def in_grey(pixels: Pixels) -> Pixels:
    """Return pixels as a camera of one channel sees them, by luminance."""
    attributes = {**pixels.attributes, "light_rgb": [float(luminance(pixels.light_rgb))]}
    grey = replace(pixels, attributes=attributes, diffuse=_luminance(pixels.diffuse))
    if pixels.specular_rgb is not None:
        colour = _luminance(pixels.highlight_rgb) / np.float32(luminance(pixels.light_rgb))
        grey = replace(grey, specular_rgb=colour)
    return grey if pixels.ambient is None else replace(grey, ambient=_luminance(pixels.ambient))


def _luminance(colours: NDArray[np.floating]) -> NDArray[np.float32]:
    return luminance(colours)[:, None].astype(np.float32)


def radiance_slopes(pixels: Pixels, lights: Lights, camera: Camera) -> tuple[Array, Array]:
    """Return the radiance of pixels under lights, and its slopes by each parameter.

    Parameters
    ----------
    pixels : Pixels
        With all their parameters.
    lights : Lights
    camera : Camera

    Returns
    -------
    radiance : ndarray of shape (P, L, C)
        Relative radiance.
    slopes : ndarray of shape (P, L, C, K)
        Its derivatives by the parameters that `parameter_names` lists.

    Raises
    ------
    OptionError
        If a light or the camera is near, and the size of a pixel is not known.
    """
    basis = _core.basis_slopes(
        pixels.model.name,
        pixels.normal.astype(np.float64),
        np.ascontiguousarray(pixels.shape, np.float64),
        light_direction=lights.direction,
        light_position_mm=lights.position_mm,
        view_direction=camera.view_direction,
        camera_distance_mm=camera.distance_mm,
        position_mm=near_positions_mm(pixels.row, pixels.column, pixels.size, lights, camera),
        index=pixels.attributes["index_of_refraction"],
        fresnel=pixels.attributes["fresnel"],
    )
    diffuse = pixels.diffuse.astype(np.float64)
    channels = diffuse.shape[1]
    intensity = np.broadcast_to(lights.intensity, (len(lights), channels))[:, :, None]
    lobes = pixels.specular.astype(np.float64)[:, None, :, None] * basis[:, :, 1:]
    # What the lobes, and each channel's diffuse term, contribute, and how that follows normal and shape.
    colour = pixels.highlight_rgb[:, None, :, None]
    specular = lobes.sum(axis=2)[:, :, None, :] * colour
    matte = diffuse[:, None, :, None] * basis[:, :, :1]
    whole = specular + matte
    each = np.eye(channels)
    columns = [
        whole[..., 1:],
        lobes[:, :, None, :, 0] * colour,
        matte[..., :1] * each,
    ]
    radiance = whole[..., 0]
    if pixels.ambient is not None:
        ambient = np.broadcast_to(pixels.ambient.astype(np.float64)[:, None, :], radiance.shape)
        radiance = radiance + ambient
        columns.append(ambient[..., None] * each)
    return radiance * intensity[..., 0], np.concatenate(columns, axis=-1) * intensity


def noise_variance(radiance: Array, noise: tuple[float, float, float]) -> Array:
    """Return the variance of samples of relative radiance; see `store.Stack.noise`."""
    read, photon, relative = noise
    level = np.maximum(radiance, 0.0)
    return np.asarray(read**2 + photon * level + (relative * level) ** 2)


def fisher_information(
    pixels: Pixels, lights: Lights, camera: Camera, noise: tuple[float, float, float], clip_level: Array
) -> Array:
    """Return the Fisher information that photographs hold of each pixel's parameters.

    Parameters
    ----------
    pixels : Pixels
    lights : Lights
    camera : Camera
    noise : tuple of float
        (read, photon, relative), see `store.Stack.noise`.
    clip_level : ndarray of shape (C,)
        Relative radiance from which on a sample is clipped and tells nothing.

    Returns
    -------
    ndarray of shape (P, K, K)
        Its inverse bounds the covariance of the parameters that `parameter_names` lists.
    """
    radiance, slopes = radiance_slopes(pixels, lights, camera)
    weight = np.where(radiance < clip_level, 1 / noise_variance(radiance, noise), 0.0)
    weighted = slopes * np.sqrt(weight)[..., None]
    flat = weighted.reshape(len(pixels), -1, weighted.shape[-1])
    return np.asarray(np.swapaxes(flat, 1, 2) @ flat)
