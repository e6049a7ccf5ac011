"""Each map as a picture to look at: what it is called, what its unit is, and how it is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.maps import pictures
from impasto.store import STATUS_MEANING, Fit, level_sizes, open_fit

_TITLES = {
    "normal": "Normal",
    "diffuse": "Diffuse magnitude",
    "specular": "Specular magnitude",
    "ambient": "Ambient term",
    "specular_rgb": "Colour of the highlight",
    "c": "Width of the highlight, c",
    "c2": "Width of the broader lobe, c2",
    "m": "Width of the highlight, m",
    "shininess": "Shininess",
    "alpha": "Slope of the facets, alpha",
    "alpha_x": "Slope of the facets along x",
    "alpha_y": "Slope of the facets along y",
    "correlation": "Correlation of the slopes along x and y",
    "exponent": "Exponent of the facets' distribution",
    "sigma": "Roughness of the diffuse surface, sigma",
    "chi2_reduced": "Reduced chi-square",
    "residual_rms": "Residual",
    "shadowed": "Cast shadows",
    "view_tilt": "Tilt of the view that suits the highlight",
    "status": "How the fit of each pixel ended",
}
_LABELS = {
    "specular": "specular magnitude As",
    "c": "c (small is glossy)",
    "c2": "c2 (small is glossy)",
    "m": "m (small is glossy)",
    "shininess": "shininess (large is glossy)",
    "alpha": "alpha (small is glossy)",
    "alpha_x": "alpha_x (small is glossy)",
    "alpha_y": "alpha_y (small is glossy)",
    "correlation": "correlation (0: strokes along x or y, or none)",
    "exponent": "exponent (small has long tails)",
    "sigma": "sigma, radians (0 is Lambert)",
    "chi2_reduced": "reduced chi-square",
    "residual_rms": "RMS residual, relative radiance",
    "shadowed": "share of the lights",
    "view_tilt": "θv in the arm's plane, radians",
}
_LOGARITHMIC = {
    *("specular", "shininess", "c", "c2", "m", "alpha", "alpha_x", "alpha_y", "exponent"),
    *("chi2_reduced", "residual_rms"),
}
_SIGNED = {"view_tilt", "correlation"}
COLOURS = {"diffuse", "ambient", "specular_rgb"}


def preview_fit(store: Path, model: str, size: tuple[int, int], longest_px: int) -> Fit:
    """Return the finest level of a fit that is not larger than a preview shall be.

    Parameters
    ----------
    store : Path
    model : str
    size : tuple of int
        Height and width of the fit itself.
    longest_px : int
        Pixels along the longer side.
    """
    sizes = [size, *level_sizes(*size)]
    level = next((number for number, each in enumerate(sizes) if max(each) <= longest_px), len(sizes) - 1)
    return open_fit(store, model, level)


def map_title(name: str) -> str:
    """Return what a map is called in words."""
    base = name.removesuffix("_sd")
    title = _TITLES.get(base, base)
    return title if base == name else f"{title}: standard deviation"


def map_limits(name: str, values: NDArray[np.floating]) -> tuple[float, float]:
    """Return the values between which those of a map lie, by far most of them."""
    if name == "normal":
        return -1.0, 1.0
    if name in ("c", "diffuse") and not (values > 1).any():
        return 0.0, 1.0
    finite = values[np.isfinite(values)]
    if name in _SIGNED:
        side = float(np.abs(finite).max()) if finite.size else 1.0
        return -side, side
    high = float(np.percentile(finite, 99.9)) if finite.size else 1.0
    return 0.0, high if high > 0 else 1.0


def draw_map(path: Path, name: str, values: NDArray[Any], *, model: str) -> None:
    """Draw a map of numbers with its legend.

    Parameters
    ----------
    path : Path
        PNG file to write.
    name : str
        Of the map in the store.
    values : ndarray of shape (H, W) or (H, W, k)
    model : str

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    heading = f"{map_title(name)} · {model}"
    uncertainty = name.endswith("_sd")
    if name == "normal":
        pictures.draw_normal(path, values, title=heading)
    elif name in COLOURS:
        pictures.draw_colour(path, values, title=heading, exposure=1 / map_limits(name, values)[1])
    else:
        if values.ndim == 3 and name.removesuffix("_sd") in COLOURS:
            values = np.sqrt(np.mean(np.square(values), axis=2))
        elif values.ndim == 3:
            values = np.concatenate(np.moveaxis(values, 2, 0), axis=1)
            heading += ", the narrow lobe on the left"
        pictures.draw_values(
            path,
            np.degrees(values) if name == "normal_sd" else values,
            title=heading,
            label=_label(name),
            logarithmic=name in _LOGARITHMIC or uncertainty,
            uncertainty=uncertainty,
        )


def draw_statuses(path: Path, status: NDArray[np.integer], counts: Mapping[int, int], *, model: str) -> None:
    """Draw how the fit of each pixel ended.

    Parameters
    ----------
    path : Path
        PNG file to write.
    status : ndarray of shape (H, W), int
    counts : mapping of int to int
        Pixels per code, of the whole map.
    model : str

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    pictures.draw_status(
        path,
        status,
        title=f"{map_title('status')} · {model}",
        meaning={code: text for code, text in STATUS_MEANING.items() if code in counts or code < 6},
        counts=counts,
    )


def _label(name: str) -> str:
    if name == "normal_sd":
        return "standard deviation, degrees"
    return "standard deviation" if name.endswith("_sd") else _LABELS.get(name, name)
