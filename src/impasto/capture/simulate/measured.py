"""Measured materials as truth: the small networks of [Sztrajman2021]_, one per material."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.materials import dot, half_vector
from impasto.errors import OptionError, Problem

Array = NDArray[np.float64]

# The layers' shapes in the order in which the 675 weights lie.
_LAYERS = ((6, 21), (21,), (21, 21), (21,), (21, 3), (3,))
# The networks are not to be used within 10° of grazing.
_LEAST_COSINE = float(np.sin(np.radians(10.0)))


@dataclass(frozen=True)
class MeasuredSet:
    """Measured BRDFs by name.

    Parameters
    ----------
    path : str
        The file that they come from.
    weights : dict of str to ndarray of shape (675,), float32
    """

    path: str
    weights: dict[str, NDArray[np.float32]]

    def brdf(self, name: str, normal: Array, light_direction: Array, view_direction: Array) -> Array:
        """Return a material's BRDF.

        Parameters
        ----------
        name : str
        normal : ndarray of shape (N, 3), float64
        light_direction, view_direction : ndarray of shape (N, 3) or (3,), float64

        Returns
        -------
        ndarray of shape (N, 3), float64
            Per steradian and channel, without the cosine. Within 10° of grazing, the value at 10°.

        Raises
        ------
        OptionError
            If the set has no material of that name.
        """
        w1, b1, w2, b2, w3, b3 = self._layers(name)
        light_direction = _lift(light_direction, normal)
        view_direction = _lift(view_direction, normal)
        layer = _rusinkiewicz(normal, light_direction, view_direction)
        for weight, bias in ((w1, b1), (w2, b2)):
            layer = layer @ weight
            layer += bias
            np.maximum(layer, 0, out=layer)
        return np.asarray(np.maximum(np.expm1(layer @ w3 + b3), 0), dtype=np.float64)

    def radiance_factor(self, name: str) -> Array:
        """Return the radiance factor at 45°/0°, ndarray of shape (3,): the albedo, if it were a diffuser."""
        light = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)])
        up = np.array([0.0, 0.0, 1.0])
        return np.asarray(np.pi * self.brdf(name, up[None], light, up)[0])

    def _layers(self, name: str) -> list[NDArray[np.float32]]:
        if name not in self.weights:
            raise OptionError(
                Problem(
                    f"measured material {name}",
                    f"is not in {self.path}, which has {len(self.weights)} materials",
                    f"Choose one of: {', '.join(self.weights)}",
                )
            )
        ends = np.cumsum([np.prod(shape) for shape in _LAYERS])[:-1]
        parts = np.split(self.weights[name].astype(np.float32), ends)
        return [part.reshape(shape) for part, shape in zip(parts, _LAYERS, strict=True)]


def read_measured(path: str | Path) -> MeasuredSet:
    """Read a file of measured materials: `names` (M,) and `weights` (M, 675).

    Raises
    ------
    OptionError
        If the file is missing or does not hold the two arrays.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            names, weights = archive["names"], archive["weights"]
        if weights.shape != (len(names), 675):
            raise ValueError(f"weights have shape {weights.shape}, expected ({len(names)}, 675)")
    except (OSError, KeyError, ValueError, EOFError) as error:
        raise OptionError(
            Problem(
                f"measured {path}",
                f"cannot be read as a file of measured materials ({error})",
                "Give an .npz with the arrays names (M,) and weights (M, 675)",
            )
        ) from error
    return MeasuredSet(str(path), dict(zip((str(name) for name in names), weights, strict=True)))


def _lift(direction: Array, normal: Array) -> Array:
    """Return the direction, raised to 10° above the surface element where it is lower, shape (N, 3)."""
    cosine = dot(normal, direction)
    direction = np.broadcast_to(direction, normal.shape)
    low = cosine < _LEAST_COSINE
    if not low.any():
        return direction
    direction = direction.copy()
    along = direction[low] - cosine[low, None] * normal[low]
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    direction[low] = _LEAST_COSINE * normal[low] + np.sqrt(1 - _LEAST_COSINE**2) * along / length
    return direction


def _rusinkiewicz(normal: Array, light_direction: Array, view_direction: Array) -> NDArray[np.float32]:
    """Return the networks' input (sin θh, 0, cos θh, d), ndarray of shape (N, 6).

    Notes
    -----
    d is the light turned so that h lies on the z axis and n in the xz plane. Its components along the turned
    axes are taken as products with n and h, which needs no tangent frame: the materials are isotropic.
    """
    h = half_vector(light_direction, view_direction)
    cos_h, l_h = np.minimum(dot(normal, h), 1.0), dot(light_direction, h)
    across = np.cross(normal, h)
    sin_h = np.maximum(np.linalg.norm(across, axis=-1), 1e-9)
    x = (cos_h * l_h - dot(normal, light_direction)) / sin_h
    y = dot(across, light_direction) / sin_h
    # Where h is n, d may be turned at will about it; rounding must not lengthen it.
    rest = np.sqrt(np.maximum(1 - l_h**2, 0))
    length = np.hypot(x, y)
    scale = np.where(length > 1e-12, rest / np.maximum(length, 1e-12), 0)
    x = np.where(length > 1e-12, x * scale, rest)
    return np.stack([sin_h, np.zeros_like(sin_h), cos_h, x, y * scale, l_h], axis=-1).astype(np.float32)
