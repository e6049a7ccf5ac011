"""The specular magnitude As of a sample, from the pixel that holds the highlight's peak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.geometry import Array, tilt_direction
from impasto.models import ModelSpec

_SHAPE_STARTS = 6
# How far θn may be from where the brightest light puts it, radians: the lights stand a few degrees apart.
_THETA_RANGE = 0.25


@dataclass(frozen=True)
class Pixel:
    """One pixel under the lights of an arm that sweeps the XZ plane.

    Parameters
    ----------
    radiance : ndarray of shape (L, C), float64
        Per unit of irradiance; NaN where a sample is missing.
    light_direction : ndarray of shape (L, 3), float64
    view_direction : ndarray of shape (3,), float64
    light_rgb : ndarray of shape (C,), float64
    brightest : int
        Number of the light under which it is brightest.
    index : float
        Index of refraction.
    fresnel : str
    """

    radiance: Array
    light_direction: Array
    view_direction: Array
    light_rgb: Array
    brightest: int
    index: float
    fresnel: str

    @property
    def mirror_normal(self) -> Array:
        """The half vector of the brightest light and the view, shape (3,)."""
        half = self.light_direction[self.brightest] + self.view_direction
        return np.asarray(half / np.linalg.norm(half))

    def basis(self, model: ModelSpec, normal: Array, shape: float) -> tuple[Array, Array]:
        """Return what a unit of Ad and of As contributes under each light, two ndarrays of shape (L,)."""
        from impasto import _core

        count = len(self.light_direction)
        values = _core.basis(
            model.name,
            np.tile(normal, (count, 1)),
            np.ascontiguousarray(self.light_direction),
            np.tile(self.view_direction, (count, 1)),
            np.full((count, 1), shape),
            index=self.index,
            fresnel=self.fresnel,
        )
        return values[:, 0], values[:, 1]


@dataclass(frozen=True)
class PixelFit:
    """A fit of one pixel with φn = φv/2: θn in radians, the shape, As, Ad (C,), and Ae (0 without one)."""

    theta: float
    shape: float
    specular: float
    diffuse: Array
    ambient: float


def specular_at_peak(
    model: ModelSpec, pixel: Pixel, normal: NDArray[np.floating], diffuse: Array, ambient: float
) -> float:
    """Return As as the paper has it: from the peak alone, where the normal is taken to be the half vector.

    Parameters
    ----------
    model : ModelSpec
    pixel : Pixel
    normal : ndarray of shape (3,)
        Of the diffuse stage.
    diffuse : ndarray of shape (C,)
    ambient : float

    Returns
    -------
    float
        (Y − Ad n·l − Ae)/s at the brightest light, mean of the channels, over the model's term there, where
        D = 1; 0 if the diffuse term exceeds the peak.
    """
    light = pixel.brightest
    n_l = max(0.0, float(normal @ pixel.light_direction[light]))
    remainder = (pixel.radiance[light] - diffuse * n_l - ambient) / pixel.light_rgb
    # At the mirror direction the shape makes no difference but to Smith's G, which is 1 for smooth surfaces.
    _, lobe = pixel.basis(model, pixel.mirror_normal, model.shape[0].lower)
    return max(0.0, float(np.nanmean(remainder)) / float(lobe[light]))


def fit_brightest(model: ModelSpec, pixel: Pixel, shadow_level: float | None) -> PixelFit:
    """Fit θn, the shape, As, Ad and, where the model has it, Ae to a pixel, with φn = φv/2 held.

    Unweighted least squares from several starts; the magnitudes, none below 0, are solved for exactly.

    Parameters
    ----------
    model : ModelSpec
        With one lobe of one shape parameter.
    pixel : Pixel
    shadow_level : float or None
        Radiance below which a sample is left out.

    Returns
    -------
    PixelFit
    """
    from scipy.optimize import least_squares, nnls

    channels = pixel.radiance.shape[1]
    usable = np.isfinite(pixel.radiance)
    if shadow_level is not None:
        usable &= pixel.radiance >= shadow_level
    measured = pixel.radiance[usable]
    scale = float(measured.max())
    phi = float(np.arcsin(pixel.view_direction[1])) / 2

    def design(unknowns: Array) -> Array:
        diffuse, lobe = pixel.basis(model, tilt_direction(unknowns[0], phi), float(np.exp(unknowns[1])))
        columns = [diffuse[:, None] * np.eye(channels)[channel] for channel in range(channels)]
        columns.append(lobe[:, None] * pixel.light_rgb)
        if model.ambient:
            columns.append(np.ones_like(pixel.radiance))
        return np.stack([column[usable] for column in columns], axis=-1)

    def residuals(unknowns: Array) -> Array:
        matrix = design(unknowns)
        return np.asarray((matrix @ nnls(matrix, measured)[0] - measured) / scale)

    half = pixel.mirror_normal
    theta = float(np.arctan2(half[0], half[2]))
    lower, upper = np.log(model.shape[0].lower), np.log(model.shape[0].upper)
    bounds = ([theta - _THETA_RANGE, lower], [theta + _THETA_RANGE, upper])
    # Both ends of the range are no place to start from.
    starts = np.linspace(lower, upper, _SHAPE_STARTS + 2)[1:-1]
    best = min(
        (least_squares(residuals, [theta, start], bounds=bounds, x_scale=[0.01, 0.1]) for start in starts),
        key=lambda found: float(found.cost),
    )
    magnitudes = nnls(design(best.x), measured)[0]
    return PixelFit(
        theta=float(best.x[0]),
        shape=float(np.exp(best.x[1])),
        specular=float(magnitudes[channels]),
        diffuse=magnitudes[:channels],
        ambient=float(magnitudes[channels + 1]) if model.ambient else 0.0,
    )
