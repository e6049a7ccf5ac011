"""The fitted parameters of some pixels, and their radiance under lights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto import _core
from impasto.errors import OptionError, Problem
from impasto.geometry import Array, Camera, Lights, position_mm, rows_and_columns, turn_about_z
from impasto.light_distance import place_lights
from impasto.models import ModelSpec, parse_model
from impasto.residual import ResidualTerm
from impasto.store import Fit

Map = NDArray[np.float32]

# Rec. 709: luminance of linear sRGB.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

_PER_PIXEL = (
    *("row", "column", "normal", "diffuse", "specular", "shape", "ambient", "specular_rgb", "view_tilt"),
    "residual",
)


@dataclass(frozen=True)
class Pixels:
    """Pixels of a fit, side by side as the core takes them.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    size : tuple of int
        Height and width of the painting in pixels.
    row, column : ndarray of shape (P,), int
    normal : ndarray of shape (P, 3)
    diffuse : ndarray of shape (P, C)
    specular : ndarray of shape (P, lobes)
    shape : ndarray of shape (P, S)
        Shape parameters in the model's order.
    ambient : ndarray of shape (P, C) or None
        For models with the term.
    view_tilt : ndarray of shape (P,) or None
        The view of each pixel, in the plane of the arm, as the paper's procedure has it in its literal form.
    specular_rgb : ndarray of shape (P, C) or None
        Colour of the highlight over that of the light; None for white.
    residual : ndarray of shape (P, K), uint16 (of a published store uint8), or None
        Codes of what the model leaves over; None leaves it away.
    """

    attributes: Mapping[str, Any]
    size: tuple[int, int]
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    normal: Map
    diffuse: Map
    specular: Map
    shape: Map
    ambient: Map | None
    view_tilt: Map | None
    specular_rgb: Map | None = None
    residual: NDArray[np.unsignedinteger] | None = None

    def __len__(self) -> int:
        return len(self.row)

    @property
    def model(self) -> ModelSpec:
        """The model that was fitted."""
        return parse_model(self.attributes["model"])

    @property
    def light_rgb(self) -> Array:
        """Colour of the specular term, shape (C,)."""
        return np.asarray(self.attributes["light_rgb"], np.float64)

    @property
    def highlight_rgb(self) -> Array:
        """Colour of each pixel's highlight, shape (P, C)."""
        colour = np.ones_like(self.diffuse) if self.specular_rgb is None else self.specular_rgb
        return colour * self.light_rgb

    @property
    def albedo(self) -> Array:
        """Diffuse magnitude in luminance under white light, shape (P,)."""
        return luminance(self.diffuse / self.light_rgb)

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Which pixels have no fit."""
        return ~_finite(self.normal)

    @property
    def matte(self) -> NDArray[np.bool_]:
        """Which pixels have a fit, but a highlight that the photographs do not tell."""
        return ~self.missing & ~(_finite(self.specular) & _finite(self.shape))

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Which pixels have all their parameters."""
        return ~self.missing & ~self.matte

    def select(self, index: ArrayLike | slice) -> Pixels:
        """Return the pixels at `index` (integers, a slice or a boolean mask), in that order."""
        index = index if isinstance(index, slice) else np.asarray(index)
        columns = {name: getattr(self, name) for name in _PER_PIXEL}
        chosen: dict[str, Any] = {
            name: None if values is None else values[index] for name, values in columns.items()
        }
        return replace(self, **chosen)

    def without_highlights(self) -> Pixels:
        """Return the pixels with their diffuse and ambient terms alone."""
        return replace(self, specular=np.zeros_like(self.specular))


def _finite(values: Map) -> NDArray[np.bool_]:
    """Return which rows are finite, column by column: along rows so short, numpy is slow."""
    result = np.ones(len(values), bool)
    for column in values.T:
        result &= np.isfinite(column)
    return result


def join_pixels(parts: Sequence[Pixels]) -> Pixels:
    """Return pixels of one fit, at least one part, as a whole."""
    columns = {name: [getattr(part, name) for part in parts] for name in _PER_PIXEL}
    joined: dict[str, Any] = {
        name: None if values[0] is None else np.concatenate(values) for name, values in columns.items()
    }
    return replace(parts[0], **joined)


def luminance(values: NDArray[np.floating]) -> Array:
    """Return the luminance of colours (..., C): by Rec. 709 for three channels, else their mean."""
    channels = values.shape[-1]
    weights = _LUMINANCE if channels == 3 else np.full(channels, 1 / channels)
    result: Array = np.asarray(values, np.float64) @ weights
    return result


def read_pixels(fit: Fit, rows: slice, columns: slice, *, residual: bool = False) -> Pixels:
    """Return the pixels of a tile, row by row.

    Parameters
    ----------
    fit : Fit
    rows, columns : slice
        The tile.
    residual : bool, optional
        Whether to read what the model leaves over too, where the fit describes it.

    Raises
    ------
    StoreError
        If a map is damaged or lost.
    """
    spec = parse_model(fit.attributes["model"])
    names = ["normal", "diffuse", *spec.shape_names]
    names += ["specular"] if spec.lobes else []
    names += ["ambient"] if spec.ambient else []
    names += ["specular_rgb"] if "specular_rgb" in fit.names else []
    names += ["view_tilt"] if "view_tilt" in fit.names else []
    names += ["residual"] if residual and "residual" in fit.names else []
    maps = fit.read(rows, columns, names)
    height, width = maps["normal"].shape[:2]
    row, column = rows_and_columns(
        slice(rows.start, rows.start + height), slice(columns.start, columns.start + width)
    )
    return pixels_of_maps(fit.attributes, fit.shape, row, column, maps)


def pixels_of_maps(
    attributes: Mapping[str, Any],
    size: tuple[int, int],
    row: NDArray[np.intp],
    column: NDArray[np.intp],
    maps: Mapping[str, NDArray[Any]],
) -> Pixels:
    """Return fitted maps as pixels side by side.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    size : tuple of int
        Height and width of the painting in pixels.
    row, column : ndarray of shape (P,), int
        Where the pixels lie.
    maps : mapping of str to ndarray of shape (P[, k]) or (rows, columns[, k])
    """
    spec = parse_model(attributes["model"])
    count = len(row)

    def flat(name: str) -> NDArray[Any]:
        return np.ascontiguousarray(maps[name].reshape(count, -1))

    none = np.empty((count, 0), np.float32)
    return Pixels(
        attributes=attributes,
        size=size,
        row=row,
        column=column,
        normal=flat("normal"),
        diffuse=flat("diffuse"),
        specular=flat("specular") if spec.lobes else none,
        shape=np.concatenate([none, *(flat(name) for name in spec.shape_names)], axis=1),
        ambient=flat("ambient") if spec.ambient else None,
        view_tilt=flat("view_tilt")[:, 0] if "view_tilt" in maps else None,
        specular_rgb=flat("specular_rgb") if "specular_rgb" in maps else None,
        residual=flat("residual") if "residual" in maps else None,
    )


def scene(pixels: Pixels, lights: Lights, camera: Camera) -> dict[str, Any]:
    """Return pixels under lights as the core takes them.

    Where the fit found the lights of the photographs near, distant lights stand where it found those.

    Raises
    ------
    OptionError
        If a light or the camera is near, and the size of a pixel is not known.
    """
    lights, camera = place_lights(pixels.attributes, pixels.size, lights, camera)
    normal, arm_azimuth = pixels.normal, 0.0
    position = near_positions_mm(pixels.row, pixels.column, pixels.size, lights, camera)
    if pixels.view_tilt is not None:
        arm_azimuth = np.radians(pixels.attributes["sample"]["arm_azimuth_deg"])
        normal = turn_about_z(normal, -arm_azimuth).astype(np.float32)
        if position is not None:
            turned = turn_about_z(np.pad(position, ((0, 0), (0, 1))), -arm_azimuth)
            position = turned[:, :2].astype(np.float32)
    channels = pixels.diffuse.shape[1]
    return {
        "model": pixels.model.name,
        "normal": normal,
        "diffuse": pixels.diffuse,
        "specular": pixels.specular,
        "shape": pixels.shape,
        "ambient": pixels.ambient,
        "specular_rgb": pixels.specular_rgb,
        "view_tilt": pixels.view_tilt,
        "light_direction": turn_about_z(lights.direction, -arm_azimuth),
        "light_position_mm": turn_about_z(lights.position_mm, -arm_azimuth),
        "light_intensity": np.broadcast_to(lights.intensity, (len(lights), channels)),
        "view_direction": camera.view_direction,
        "camera_distance_mm": camera.distance_mm,
        "position_mm": position,
        "light_rgb": pixels.light_rgb,
        "index": pixels.attributes["index_of_refraction"],
        "fresnel": pixels.attributes["fresnel"],
    }


def render_pixels(pixels: Pixels, lights: Lights, camera: Camera) -> NDArray[np.float32]:
    """Return the relative radiance of pixels under lights.

    A pixel whose highlight the photographs do not tell is rendered without one. What the model leaves over is
    added where the pixels have it. Where the fit found the lights of the photographs near, distant lights
    stand where it found those.

    Parameters
    ----------
    pixels : Pixels
    lights : Lights
    camera : Camera
        The camera of the photographs.

    Returns
    -------
    ndarray of shape (L, P, C), float32
        NaN where there is no fit.

    Raises
    ------
    OptionError
        If a light or the camera is near, and the size of a pixel is not known.
    """
    term = None if pixels.residual is None else ResidualTerm.of(pixels.attributes)
    residual = None
    if term is not None and (under := term.under(lights.direction)):
        residual = {"codes": pixels.residual, **under}
    radiance: NDArray[np.float32] = _core.render(scene(pixels, lights, camera), residual)
    return radiance


def near_positions_mm(
    row: NDArray[np.intp], column: NDArray[np.intp], size: tuple[int, int], lights: Lights, camera: Camera
) -> NDArray[np.float32] | None:
    """Return where pixels lie on a painting, if a light or the camera is so near that it matters.

    Parameters
    ----------
    row, column : ndarray of shape (P,), int
    size : tuple of int
        Height and width of the painting in pixels.
    lights : Lights
    camera : Camera

    Returns
    -------
    ndarray of shape (P, 2), float32, or None
        X and Y in mm.

    Raises
    ------
    OptionError
        If it matters, and the size of a pixel is not known.
    """
    if not lights.near and camera.distance_mm is None:
        return None
    if camera.mm_per_px is None:
        raise OptionError(
            Problem(
                where="render",
                what="a light or the camera is near, and the stack does not say how large a pixel is",
                do="State mm_per_px under [camera] in the photographs' TOML file and stack them again",
            )
        )
    return position_mm(row, column, *size, camera.mm_per_px)
