"""The simulated painting as maps: relief, colour and surface of every pixel, the ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.materials import native_parameters
from impasto.capture.simulate.painting.relief import normals

Map = NDArray[np.float32]


@dataclass(frozen=True)
class Material:
    """One material of a painting.

    Parameters
    ----------
    name : str
    model : str
        The model of its specular reflection, a key of `materials.SHAPES`.
    tint : tuple of float
        Colour of its specular reflection; white but for metals, which no fitted model allows for.
    measured : str or None
        The measured material that takes the place of its diffuse reflection; the pixel's `diffuse` then holds
        the radiance factor at 45°/0°.
    """

    name: str
    model: str
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    measured: str | None = None


@dataclass(frozen=True)
class Surface:
    """A painting, known exactly.

    Parameters
    ----------
    height_mm : ndarray of shape (H, W), float32
    normal : ndarray of shape (H, W, 3), float32
        Consistent with `height_mm`.
    diffuse : ndarray of shape (H, W, 3), float32
        Albedo, linear sRGB primaries.
    specular, shape : ndarray of shape (H, W), float32
        Specular magnitude As and c, m or shininess, whichever the pixel's model has.
    alpha : ndarray of shape (H, W), float32
        Facet width from which `specular` and `shape` were made; equal to c where the model has c.
    material : ndarray of shape (H, W), uint8
        Index into `materials`.
    materials : tuple of Material
    mm_per_px : float
    strength : ndarray of shape (H, W), float32
        Factor on the measured BRDF where the material is measured: what the bristles did to its colour.
    """

    height_mm: Map
    normal: Map
    diffuse: Map
    specular: Map
    shape: Map
    alpha: Map
    material: NDArray[np.uint8]
    materials: tuple[Material, ...]
    mm_per_px: float
    strength: Map

    @property
    def size(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.height_mm.shape
        return height, width


def make_surface(
    relief: NDArray[np.floating],
    albedo: NDArray[np.floating],
    alpha: NDArray[np.floating],
    kappa: NDArray[np.floating],
    material: NDArray[np.uint8],
    materials: tuple[Material, ...],
    *,
    pitch_mm: float,
    mm_per_px: float,
    relief_scale: float = 1.0,
) -> Surface:
    """Return the surface that goes with a relief and the paint on it.

    Parameters
    ----------
    relief : ndarray of shape (H, W), mm
        At `pitch_mm` millimetres per pixel; scaled with the painting, so slopes stay.
    albedo : ndarray of shape (H, W, 3)
    alpha, kappa : ndarray of shape (H, W)
        Width and strength of the specular lobe.
    material : ndarray of shape (H, W), uint8
    materials : tuple of Material
    pitch_mm, mm_per_px : float
        Pixel size in the frame of `relief` and on the painting.
    relief_scale : float
        Factor on heights, and thereby on slopes.
    """
    height_mm = (relief * (relief_scale * mm_per_px / pitch_mm)).astype(np.float32)
    height_mm -= height_mm.mean(dtype=np.float64).astype(np.float32)
    specular = np.empty(relief.shape, np.float32)
    shape = np.empty(relief.shape, np.float32)
    strength = np.ones(relief.shape, np.float32)
    diffuse = albedo.astype(np.float32)
    for index, entry in enumerate(materials):
        here = material == index
        if here.any():
            specular[here], shape[here] = native_parameters(entry.model, alpha[here], kappa[here])
            if entry.measured is not None:
                level = diffuse[here].mean(axis=1)
                strength[here] = np.clip(level / np.median(level), 0.5, 1.5)
    return Surface(
        height_mm,
        normals(height_mm, mm_per_px),
        diffuse,
        specular,
        shape,
        alpha.astype(np.float32),
        material,
        materials,
        mm_per_px,
        strength,
    )
