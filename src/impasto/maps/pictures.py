"""Readable pictures of maps: colour maps that colour-blind readers can follow, each with its legend.

All functions raise `OutputError` if the picture cannot be written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from impasto.colour import encode_srgb
from impasto.output import written_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

_DPI = 100
_SHORTEST_PX = 900
_MISSING = "#d7d3cb"
_INK = "#22201c"
_TEXT_PT = 13

# Okabe and Ito's palette, which stays distinct for the common colour deficiencies [OkabeIto2008]_; the usual
# outcome is the quiet one. Where more are needed, Tol's muted ones follow [Tol2021]_.
_STATUS_COLOURS = (
    *("#e8e4da", "#56b4e9", "#e69f00", "#cc79a7", "#000000", "#009e73", "#d55e00", "#0072b2"),
    *("#882255", "#ddcc77", "#332288", "#44aa99", "#999933"),
)


def draw_values(
    path: Path,
    values: NDArray[np.floating],
    *,
    title: str,
    label: str,
    logarithmic: bool = False,
    limits: tuple[float, float] | None = None,
    uncertainty: bool = False,
) -> None:
    """Draw a map of one number per pixel with a colour bar.

    Parameters
    ----------
    path : Path
        PNG file to write.
    values : ndarray of shape (H, W), float
        NaN where a pixel has no value; those are drawn in grey and named in the legend.
    title : str
        Heading of the picture.
    label : str
        What the colours mean, with the unit.
    logarithmic : bool, optional
        Whether equal steps of colour are equal ratios.
    limits : pair of float, optional
        Values at the ends of the colour bar; by default the 1st and the 99th percentile.
    uncertainty : bool, optional
        Whether to use the colour map kept for standard deviations.
    """
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm, Normalize

    finite = values[np.isfinite(values) & ((values > 0) if logarithmic else True)]
    low, high = limits or (_percentiles(finite) if finite.size else (0.0, 1.0))
    if logarithmic and low <= 0:
        low = float(finite.min()) if finite.size else high / 10
    if high <= low:
        high = low * 1.01 if low > 0 else low + 1.0
    figure, axes, side = _canvas(values.shape[0], values.shape[1], title, side_px=200)
    colour_map = colormaps["cividis" if uncertainty else "viridis"].with_extremes(bad=_MISSING)
    shown = np.where(np.isfinite(values), np.clip(values, low, high), np.nan)
    norm = LogNorm(low, high) if logarithmic else Normalize(low, high)
    image = axes.imshow(shown, cmap=colour_map, norm=norm, interpolation="nearest")
    below, above = bool((finite < low).any()), bool((finite > high).any())
    bar = _colour_bar(figure, side, image, label, below, above)
    if logarithmic:
        _label_decades(bar, narrow=high < 100 * low)
    if not np.isfinite(values).all():
        _legend(side, [(_MISSING, "no value")])
    _save(figure, path)


def draw_difference(
    path: Path,
    difference: NDArray[np.floating],
    *,
    title: str,
    limit: float,
    mm_per_px: float | None = None,
    px_per_px: int = 1,
) -> None:
    """Draw a signed difference around white, with its colour bar and a bar for lengths on the painting.

    Parameters
    ----------
    path : Path
        PNG file to write.
    difference : ndarray of shape (H, W), float
        NaN where there is none.
    title : str
    limit : float
        Magnitude at the ends of the colour bar; what is beyond is drawn as this.
    mm_per_px : float, optional
        Size of a pixel on the painting; without it the bar counts pixels.
    px_per_px : int, optional
        How many pixels of the painting a pixel of the picture stands for, along a side.
    """
    from matplotlib import colormaps

    height, width = difference.shape
    figure, axes, side = _canvas(height, width, title, side_px=200)
    # Orange and purple stay apart for the common colour deficiencies, and on paper.
    colour_map = colormaps["PuOr"].with_extremes(bad=_MISSING)
    shown = np.where(np.isfinite(difference), np.clip(difference, -limit, limit), np.nan)
    image = axes.imshow(shown, cmap=colour_map, vmin=-limit, vmax=limit, interpolation="nearest")
    finite = difference[np.isfinite(difference)]
    below, above = bool((finite < -limit).any()), bool((finite > limit).any())
    _colour_bar(figure, side, image, "relative radiance", below, above)
    length, unit = _round_length(width * (mm_per_px or px_per_px)), "mm" if mm_per_px else "px"
    on_picture = length / (mm_per_px or px_per_px)
    start, base = 0.03 * width, 0.95 * height
    axes.plot([start, start + on_picture], [base, base], color=_INK, linewidth=4, solid_capstyle="butt")
    axes.text(
        start, base - 0.02 * height, f"{length:g} {unit}", va="bottom", fontsize=_TEXT_PT, color=_INK,
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 2},
    )  # fmt: skip
    if not np.isfinite(difference).all():
        _legend(side, [(_MISSING, "no value")])
    _save(figure, path)


def draw_normal(path: Path, normal: NDArray[np.floating], *, title: str) -> None:
    """Draw a map of normals in the usual colours, (n + 1) / 2, with a hemisphere as their key.

    Parameters
    ----------
    path : Path
        PNG file to write.
    normal : ndarray of shape (H, W, 3), float
        Unit vectors, NaN where a pixel has none.
    title : str
        Heading of the picture.
    """
    figure, axes, side = _canvas(normal.shape[0], normal.shape[1], title, side_px=240)
    axes.imshow(_normal_colours(normal), interpolation="nearest")
    y, x = np.mgrid[1:-1:121j, -1:1:121j]
    sphere = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)
    sphere[np.hypot(x, y) > 1] = np.nan
    box = side.get_position()
    key_px = 0.62 * box.width * figure.get_figwidth()
    height = key_px / figure.get_figheight()
    key = figure.add_axes((box.x0 + 0.2 * box.width, box.y1 - 1.35 * height, 0.62 * box.width, height))
    key.imshow(_normal_colours(sphere, missing=np.ones(3)), interpolation="bilinear")
    key.set_axis_off()
    for position, text, ha, va in (
        ((60, -4), "up", "center", "bottom"),
        ((60, 125), "down", "center", "top"),
        ((-5, 60), "left", "right", "center"),
        ((126, 60), "right", "left", "center"),
    ):
        key.text(*position, text, ha=ha, va=va, fontsize=_TEXT_PT, color=_INK)
    if not np.isfinite(normal).all():
        _legend(side, [(_MISSING, "no value")])
    _save(figure, path)


def draw_colour(path: Path, image_linear: NDArray[np.floating], *, title: str, exposure: float) -> None:
    """Draw a map of one number per channel as a picture, encoded as sRGB.

    Parameters
    ----------
    path : Path
        PNG file to write.
    image_linear : ndarray of shape (H, W, C), float
        One or three channels, NaN where a pixel has no value.
    title : str
        Heading of the picture.
    exposure : float
        Factor on the values; 1 shows 1 as white.
    """
    image = encode_srgb(np.asarray(image_linear, dtype=np.float32), exposure)
    missing = ~np.isfinite(image_linear).all(axis=-1)
    image = np.repeat(image, 3, axis=-1) if image.shape[-1] == 1 else image
    image[missing] = _rgb(_MISSING)
    figure, axes, side = _canvas(image.shape[0], image.shape[1], title, side_px=170)
    axes.imshow(image, interpolation="nearest")
    side.text(0.1, 1.0, f"white is {1 / exposure:.3g}\nand above", va="top", fontsize=_TEXT_PT, color=_INK)
    if missing.any():
        _legend(side, [(_MISSING, "no value")])
    _save(figure, path)


def draw_status(
    path: Path,
    status: NDArray[np.integer],
    *,
    title: str,
    meaning: Mapping[int, str],
    counts: Mapping[int, int],
) -> None:
    """Draw a map of status codes, each named with its share of the pixels.

    Parameters
    ----------
    path : Path
        PNG file to write.
    status : ndarray of shape (H, W), int
        Codes.
    title : str
        Heading of the picture.
    meaning : mapping of int to str
        What each code means.
    counts : mapping of int to int
        How many pixels of the whole map have each code.
    """
    palette = np.array([_rgb(colour) for colour in _STATUS_COLOURS])
    figure, axes, side = _canvas(status.shape[0], status.shape[1], title, side_px=300)
    axes.imshow(palette[np.clip(status, 0, len(palette) - 1)], interpolation="nearest")
    total = max(sum(counts.values()), 1)
    entries = [
        (
            _STATUS_COLOURS[min(code, len(_STATUS_COLOURS) - 1)],
            f"{text}\n{_share(counts.get(code, 0) / total)}",
        )
        for code, text in sorted(meaning.items())
    ]
    _legend(side, entries, top=True)
    _save(figure, path)


def _colour_bar(figure: Figure, side: Axes, image: AxesImage, label: str, below: bool, above: bool) -> Axes:
    """Draw the colour bar at the side, pointed where values lie beyond it, and return its axes."""
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    box = side.get_position()
    bar = figure.add_axes(
        (box.x0 + box.width * 0.12, box.y0 + box.height * 0.1, box.width * 0.16, box.height * 0.86)
    )
    colour_bar = figure.colorbar(image, cax=bar, extend=extend[below, above])
    colour_bar.set_label(label, color=_INK, fontsize=_TEXT_PT)
    bar.tick_params(labelsize=_TEXT_PT, which="both")
    return bar


def _round_length(whole: float) -> float:
    """Return a length of 1, 2 or 5 times a power of ten, about a fifth of the whole."""
    decade = 10.0 ** np.floor(np.log10(whole / 5))
    return float(decade * max(step for step in (1, 2, 5) if step * decade <= whole / 5))


def _label_decades(bar: Axes, narrow: bool) -> None:
    """Label a logarithmic colour bar in plain figures, between the decades too if they are few."""
    from matplotlib.ticker import LogLocator, NullFormatter

    bar.yaxis.set_major_formatter("{x:g}")
    if narrow:
        bar.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        bar.yaxis.set_minor_formatter("{x:g}")
    else:
        bar.yaxis.set_minor_formatter(NullFormatter())


def _share(share: float) -> str:
    if share == 0:
        return "none"
    if share < 0.0005:
        return "under 0.05 %"
    return f"{100 * share:.1f} %"


def _percentiles(values: NDArray[np.floating]) -> tuple[float, float]:
    low, high = np.percentile(values, [1, 99])
    return float(low), float(high)


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[start : start + 2], 16) / 255 for start in (1, 3, 5))


def _normal_colours(
    normal: NDArray[np.floating], missing: NDArray[np.floating] | None = None
) -> NDArray[np.floating]:
    colours = np.clip((normal + 1) / 2, 0, 1)
    bad = ~np.isfinite(colours).all(axis=-1)
    colours[bad] = _rgb(_MISSING) if missing is None else missing
    return colours


def _canvas(height: int, width: int, title: str, side_px: int) -> tuple[Figure, Axes, Axes]:
    """Return a figure with the map at a whole number of screen pixels per pixel, and room for its legend."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    factor = max(1, round(_SHORTEST_PX / max(height, width)))
    map_height, map_width = height * factor, width * factor
    top, edge = 52, 14
    total_height = max(map_height, 260) + top + edge
    total_width = map_width + side_px + 2 * edge
    figure = Figure(figsize=(total_width / _DPI, total_height / _DPI), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    bottom = total_height - top - map_height
    axes = figure.add_axes(
        (edge / total_width, bottom / total_height, map_width / total_width, map_height / total_height)
    )
    axes.set_axis_off()
    figure.text(edge / total_width, 1 - 14 / total_height, title, va="top", fontsize=_TEXT_PT + 2, color=_INK)
    side = figure.add_axes(
        (
            (edge + map_width + 10) / total_width,
            edge / total_height,
            (side_px - 10) / total_width,
            (total_height - top - edge) / total_height,
        )
    )
    side.set_axis_off()
    return figure, axes, side


def _legend(axes: Axes, entries: Sequence[tuple[str, str]], top: bool = False) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, edgecolor="#8b867b", label=text) for colour, text in entries]
    axes.legend(
        handles=handles,
        loc="upper left" if top else "lower left",
        bbox_to_anchor=(0.0, 1.0) if top else (0.0, -0.01),
        frameon=False,
        borderaxespad=0,
        labelspacing=0.9,
        labelcolor=_INK,
        fontsize=_TEXT_PT,
    )


def _save(figure: Figure, path: Path) -> None:
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png", dpi=_DPI)
