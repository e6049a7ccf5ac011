"""What an informed placement goes by: how wide the highlights are, and where the normals point them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impasto.angles.study import Study
from impasto.arm import find_arm
from impasto.evaluate.curves import half_width_deg
from impasto.geometry import Array, Camera, direction_tilts
from impasto.pixels import Pixels

_QUANTILES = (5, 50, 95)
_BIN_DEG = 2.0


@dataclass(frozen=True)
class Highlights:
    """The highlights of a painting.

    Parameters
    ----------
    width_deg : tuple of float
        Full width of the highlight at half its height, in angles of the light: 5th, 50th and 95th percentile
        of the pixels. NaN for a model without a lobe.
    theta_deg, phi_deg : tuple of float
        Tilt of the normals along and across the arm (along X and Y without one), the same percentiles.
    theta_histogram : dict of str to float
        Share of the pixels whose θ lies in a bin of 2°, by the bin's middle in degrees.
    density : dict of str to float
        Share of the highlights that falls on each candidate light.
    """

    width_deg: tuple[float, ...]
    theta_deg: tuple[float, ...]
    phi_deg: tuple[float, ...]
    theta_histogram: dict[str, float]
    density: dict[str, float]


def highlight_widths_deg(pixels: Pixels, view: Array) -> tuple[float, ...]:
    """Return the full width of the highlight at half its height for three percentiles of the shape."""
    shapes = np.percentile(pixels.shape, _QUANTILES, axis=0).astype(np.float64)
    up = np.array([0.0, 0.0, 1.0])
    return tuple(2 * half_width_deg(pixels, shape, up, Camera(view)) for shape in shapes)


def describe_highlights(study: Study) -> Highlights:
    """Describe the highlights of a study's pixels."""
    pixels, lights = study.typical, study.lights
    theta, phi = np.degrees(direction_tilts(find_arm(lights.direction).into(pixels.normal)))
    bins = np.arange(np.floor(theta.min() / _BIN_DEG), np.ceil(theta.max() / _BIN_DEG) + 1) * _BIN_DEG
    counts, edges = np.histogram(theta, bins if len(bins) > 1 else 1)
    middles = (edges[:-1] + edges[1:]) / 2
    width = (
        highlight_widths_deg(pixels, study.pixels.camera.view_direction)
        if pixels.model.lobes
        else (float("nan"),) * len(_QUANTILES)
    )
    return Highlights(
        width_deg=width,
        theta_deg=tuple(np.percentile(theta, _QUANTILES).tolist()),
        phi_deg=tuple(np.percentile(phi, _QUANTILES).tolist()),
        theta_histogram={
            f"{middle:g}": count / len(theta) for middle, count in zip(middles, counts.tolist(), strict=True)
        },
        density=dict(zip(lights.names, study.density.tolist(), strict=True)),
    )
