"""The fitted parameters of some pixels, side by side as the models take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from impasto.geometry import Array
from impasto.models import ModelSpec, basis, parse_model
from impasto.store import Fit

# Rec. 709: luminance of linear sRGB.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

_PER_PIXEL = ("row", "column", "normal", "diffuse", "specular", "shape", "ambient")


@dataclass(frozen=True)
class Pixels:
    """Pixels of a fit that have all their parameters.

    Parameters
    ----------
    model : ModelSpec
    row, column : ndarray of shape (P,), int
    normal : ndarray of shape (P, 3)
    diffuse : ndarray of shape (P, C)
    specular : ndarray of shape (P, lobes)
    shape : ndarray of shape (P, S)
    ambient : ndarray of shape (P, C)
        Zero for models without the term.
    light_rgb : ndarray of shape (C,)
        Colour of the specular term.
    index : float
    fresnel : {'facet', 'element'}
    """

    model: ModelSpec
    row: Array
    column: Array
    normal: Array
    diffuse: Array
    specular: Array
    shape: Array
    ambient: Array
    light_rgb: Array
    index: float
    fresnel: str

    def __len__(self) -> int:
        return len(self.row)

    @property
    def albedo(self) -> Array:
        """Diffuse magnitude in luminance under white light, ndarray of shape (P,)."""
        return luminance(self.diffuse / self.light_rgb)

    def select(self, index: ArrayLike) -> Pixels:
        """Return the pixels at `index` (integers or a boolean mask), in that order."""
        chosen: dict[str, Any] = {name: getattr(self, name)[np.asarray(index)] for name in _PER_PIXEL}
        return replace(self, **chosen)

    def basis(self, normal: Array, light: Array, view: Array) -> tuple[Array, Array]:
        """Return the model's basis functions with the pixels' shapes, see `impasto.models.basis`."""
        return basis(self.model, normal, light, view, self.shape, index=self.index, fresnel=self.fresnel)


def join_pixels(parts: Sequence[Pixels]) -> Pixels:
    """Return pixels of one fit, at least one part, as a whole."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in _PER_PIXEL
    }
    return replace(parts[0], **columns)


def luminance(values: Array) -> Array:
    """Return the luminance of colours (..., C): by Rec. 709 for three channels, else their mean."""
    weights = _LUMINANCE if values.shape[-1] == 3 else np.full(values.shape[-1], 1 / values.shape[-1])
    result: Array = values @ weights
    return result


def read_pixels(fit: Fit, rows: slice, columns: slice) -> Pixels:
    """Return the pixels of a tile that have all their parameters.

    Raises
    ------
    StoreError
        If a map is damaged or lost.
    """
    spec = parse_model(fit.attributes["model"])
    names = ["normal", "diffuse", *spec.shape_names, *(["specular"] if spec.lobes else [])]
    maps = fit.read(rows, columns, [*names, *(["ambient"] if spec.ambient else [])])
    height, width = maps["normal"].shape[:2]
    flat = {name: values.reshape(height * width, -1).astype(np.float64) for name, values in maps.items()}
    whole = np.flatnonzero(np.all([np.isfinite(flat[name]).all(axis=1) for name in names], axis=0))
    row, column = np.divmod(whole, width)
    none = np.empty((height * width, 0))
    return Pixels(
        model=spec,
        row=row + rows.start,
        column=column + columns.start,
        normal=flat["normal"][whole],
        diffuse=flat["diffuse"][whole],
        specular=flat.get("specular", none)[whole],
        shape=np.concatenate([none, *(flat[name] for name in spec.shape_names)], axis=1)[whole],
        ambient=flat.get("ambient", np.zeros_like(flat["diffuse"]))[whole],
        light_rgb=np.asarray(fit.attributes["light_rgb"], np.float64),
        index=fit.attributes["index_of_refraction"],
        fresnel=fit.attributes["fresnel"],
    )
