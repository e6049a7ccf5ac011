"""Predict what a glossmeter would read on the painting."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from impasto.band_writers import BandWriter
from impasto.errors import OptionError, Problem
from impasto.evaluate.clusters import choose_regions
from impasto.evaluate.glossmeter import GLOSSMETERS, Glossmeter, quadrature
from impasto.evaluate.regions import WHOLE, Sample, check_inside, sample_regions
from impasto.geometry import Array, Camera, Lights
from impasto.maps.pictures import draw_values
from impasto.models import ModelSpec, basis, parse_model
from impasto.output import prepare_folder
from impasto.pixels import Pixels, read_pixels
from impasto.progress import progress
from impasto.store import Fit, Stack, open_fit, open_stack

_BAND_ROWS = 256
_PREVIEW_PX = 1600
_SAMPLED = 20_000
"""Pixels of a region whose normals the reading of the region integrates over."""

_GRID = {0: 0, 1: 96, 2: 32, 3: 12}
"""Values of each shape parameter in the table for single pixels, by the number of parameters."""


@dataclass(frozen=True)
class Reading:
    """What the glossmeter reads at one angle.

    Parameters
    ----------
    angle_deg : float
    gloss : float
        Reading of the region as a whole, its pixels tilted as they are; gloss units.
    median, low, high : float
        Median, 5th and 95th percentile of its pixels, each as if it were a flat sample.
    """

    angle_deg: float
    gloss: float
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class RegionGloss:
    """The gloss of one region.

    Parameters
    ----------
    name : str
    pixels, unknown_pixels : int
        Pixels that were read, and those whose highlight the photographs do not tell.
    readings : tuple of Reading
        One entry per angle.
    haze : float
        Difference of the readings at 60 and 20° [ASTMD4039]_.
    """

    name: str
    pixels: int
    unknown_pixels: int
    readings: tuple[Reading, ...]
    haze: float


@dataclass(frozen=True)
class GlossSummary:
    """What `gloss` found.

    Parameters
    ----------
    store : Path
    model : str
    absolute : bool
        Whether the stack is scaled to a white reference, so that the numbers are gloss units.
    facet_angle_deg : tuple of float
        Least and largest angle of incidence on mirroring facets under the photographs' lights.
    extrapolated_deg : tuple of float
        The glossmeter's angles outside that range: there the reading rests on the model alone.
    regions : tuple of RegionGloss
    files : tuple of Path
    seconds : float
    """

    store: Path
    model: str
    absolute: bool
    facet_angle_deg: tuple[float, float]
    extrapolated_deg: tuple[float, ...]
    regions: tuple[RegionGloss, ...]
    files: tuple[Path, ...]
    seconds: float


def gloss(
    store: str | PathLike[str],
    *,
    model: str,
    regions: str | PathLike[str] | None = None,
    clusters: int | None = None,
    pixels: Sequence[tuple[int, int]] = (),
    out: str | PathLike[str] | None = None,
    show_progress: bool | None = None,
) -> GlossSummary:
    """Predict the readings of a glossmeter at 20, 60 and 85° from a fit.

    The plane of incidence is that of the painting's X axis. A region is read with the meter resting on its
    mean plane and each pixel tilted as it is, so relief lowers the gloss; a single pixel is read as a flat
    sample.

    Parameters
    ----------
    store : path
        Store with a fit of `model`.
    model : str
    regions : path, optional
        Image of the painting's size with a colour per region; see `read_regions`.
    clusters : int, optional
        Have this many regions found instead, from the maps; see `cluster_regions`.
    pixels : sequence of (int, int), optional
        Single pixels, column and row.
    out : path, optional
        Folder for a map per angle: ``gloss_20.exr`` and a picture.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    GlossSummary

    Raises
    ------
    OptionError
        If the model or the regions cannot be used, a pixel lies outside of the painting, or no pixel has a
        highlight that is known.
    StoreError
        If there is no such store or no such complete fit.
    OutputError
        If the maps cannot be written.

    References
    ----------
    [ISO2813]_, [ASTMD523]_
    """
    started = time.perf_counter()
    spec = parse_model(model)
    fit = open_fit(Path(store), spec.name)
    stack = open_stack(Path(store))
    height, width = fit.shape
    check_inside(pixels, height, width)
    divided = choose_regions(fit, regions, clusters, show=show_progress)
    folder = prepare_folder(out) if out else None
    tables = [PixelGloss(spec, fit.attributes, meter) for meter in GLOSSMETERS]
    samples = sample_regions(fit, divided, _SAMPLED, show=show_progress)
    if not samples[WHOLE].known:
        raise OptionError(
            Problem(
                where=f"{store}: {fit.group}",
                what="no pixel has a highlight that the photographs tell, so there is no gloss to predict",
                do="Look at the notes and the statuses of impasto fit; take photographs under more lights",
            )
        )
    found = [_region(name, sample, tables) for name, sample in samples.items()]
    found += [_pixel(fit, column, row, tables) for column, row in pixels]
    files = _write_maps(folder, fit, tables, stack.absolute, show_progress) if folder else ()
    return _summary(stack, spec.name, found, tuple(files), started)


def sample_gloss(pixels: Pixels, stack: Stack) -> GlossSummary:
    """Predict the readings of a glossmeter from some pixels of a fit, as `gloss` does for the whole painting.

    Parameters
    ----------
    pixels : Pixels
        Spread over the painting.
    stack : Stack
        The photographs that they were fitted to.
    """
    started = time.perf_counter()
    tables = [PixelGloss(pixels.model, pixels.attributes, meter) for meter in GLOSSMETERS]
    known = int(pixels.whole.sum())
    sample = Sample(pixels.select(pixels.whole), known, len(pixels) - known)
    return _summary(stack, pixels.model.name, [_region(WHOLE, sample, tables)], (), started)


def _summary(
    stack: Stack, model: str, found: Sequence[RegionGloss], files: tuple[Path, ...], started: float
) -> GlossSummary:
    reach = facet_angles_deg(stack.lights, stack.camera)
    return GlossSummary(
        store=stack.store,
        model=model,
        absolute=stack.absolute,
        facet_angle_deg=reach,
        extrapolated_deg=tuple(m.angle_deg for m in GLOSSMETERS if not reach[0] <= m.angle_deg <= reach[1]),
        regions=tuple(found),
        files=files,
        seconds=time.perf_counter() - started,
    )


def region_gloss(pixels: Pixels, meter: Glossmeter) -> float:
    """Return the reading of a surface made of tilted pixels, the meter resting on its mean plane.

    Parameters
    ----------
    pixels : Pixels
        At least one.
    meter : Glossmeter
    """
    points = quadrature(18, 5)
    light, view, weight = meter.rays(points[:, :4])
    # Neighbouring rays meet pixels of all tilts: the fifth coordinate draws the pixel.
    pixel = pixels.select((points[:, 4] * len(pixels)).astype(np.intp))
    normal = pixel.normal @ _resting(pixels.normal.mean(axis=0))
    diffuse, specular = basis(pixels.model, normal, light, view, pixel.shape, **_optics(pixels.attributes))
    radiance = pixel.albedo * diffuse + np.sum(pixel.specular * specular, axis=1)
    return float(meter.gloss(np.mean(weight * radiance)))


def _optics(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {"index": attributes["index_of_refraction"], "fresnel": attributes["fresnel"]}


def _resting(normal: Array) -> Array:
    """Return the axes (3, 3), in columns, of a meter that stands on a plane with its beam along X."""
    z = normal / np.linalg.norm(normal)
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


class PixelGloss:
    """Readings of single pixels as flat samples, by a table over the model's shape parameters.

    Parameters
    ----------
    model : ModelSpec
    attributes : mapping
        Attributes of the fit: its optics.
    meter : Glossmeter

    Attributes
    ----------
    axes : list of ndarray
        Values of each shape parameter in the table.
    grid : ndarray of shape (len(axis), ..., 1 + lobes)
        Gloss units per unit of albedo and of each lobe's magnitude.
    """

    def __init__(self, model: ModelSpec, attributes: Mapping[str, Any], meter: Glossmeter) -> None:
        shape = model.shape
        count = _GRID[len(shape)]
        self.axes = axes = [
            (np.geomspace if parameter.lower > 0 else np.linspace)(parameter.lower, parameter.upper, count)
            for parameter in shape
        ]
        self._logarithmic = np.array([parameter.lower > 0 for parameter in shape], bool)
        light, view, weight = meter.rays(quadrature(13, 4))
        normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
        table = []
        for values in product(*axes):
            diffuse, specular = basis(
                model,
                normal,
                light,
                view,
                np.tile(values, (len(light), 1)),
                **_optics(attributes),
            )
            table.append(weight @ np.column_stack([diffuse, specular]) / len(light))
        self.grid = grid = np.reshape(meter.gloss(table), (*(len(axis) for axis in axes), -1))
        self._constant = grid.reshape(-1) if not axes else None
        if axes:
            # Readings vary over decades with the width of the lobe.
            places = self._places(np.array(axes).T).T
            self._table = RegularGridInterpolator(list(places), np.log(grid + 1e-30))
            self._bounds = places[:, [0, -1]].T

    def __call__(self, pixels: Pixels) -> Array:
        """Return gloss units, ndarray of shape (P,); NaN where the highlight is not known."""
        if self._constant is None:
            inside = np.clip(self._places(pixels.shape.astype(np.float64)), *self._bounds)
            unit = np.exp(self._table(inside))
        else:
            unit = np.broadcast_to(self._constant, (len(pixels), len(self._constant)))
        result: Array = pixels.albedo * unit[:, 0] + np.sum(pixels.specular * unit[:, 1:], axis=1)
        return result

    def _places(self, shape: Array) -> Array:
        """Return shapes (P, S) as the table counts them: by their logarithm, where they are positive."""
        positive = np.where(self._logarithmic, shape, 1.0)
        return np.where(self._logarithmic, np.log(positive), shape)


def _region(name: str, sample: Sample, tables: Sequence[PixelGloss]) -> RegionGloss:
    """Return the readings of a region from a sample of its pixels."""
    readings = []
    for meter, table in zip(GLOSSMETERS, tables, strict=True):
        if len(sample.pixels) == 0:
            gloss = median = low = high = math.nan
        else:
            gloss = region_gloss(sample.pixels, meter)
            low, median, high = np.percentile(table(sample.pixels), [5, 50, 95]).tolist()
        readings.append(Reading(meter.angle_deg, gloss, median, low, high))
    haze = readings[1].gloss - readings[0].gloss
    return RegionGloss(name, sample.known, sample.unknown, tuple(readings), haze)


def _pixel(fit: Fit, column: int, row: int, tables: Sequence[PixelGloss]) -> RegionGloss:
    """Return the readings of one pixel as a flat sample."""
    pixels = read_pixels(fit, slice(row, row + 1), slice(column, column + 1))
    values = [float(table(pixels)[0]) for table in tables]
    readings = [
        Reading(meter.angle_deg, *[value] * 4) for meter, value in zip(GLOSSMETERS, values, strict=True)
    ]
    name = f"pixel {column},{row}"
    known = int(pixels.whole[0])
    return RegionGloss(name, known, 1 - known, tuple(readings), values[1] - values[0])


def _write_maps(
    folder: Path, fit: Fit, tables: Sequence[PixelGloss], absolute: bool, show: bool | None
) -> Iterator[Path]:
    """Write a map per angle, as EXR and as a picture."""
    height, width = fit.shape
    title = parse_model(fit.attributes["model"]).title
    step = max(1, max(height, width) // _PREVIEW_PX)
    previews = np.full((len(tables), -(-height // step), -(-width // step)), np.nan, np.float32)
    names = [f"gloss_{meter.angle_deg:.0f}" for meter in GLOSSMETERS]
    with ExitStack() as stack:
        writers = [
            stack.enter_context(BandWriter(folder / f"{name}.exr", height, width, ("Y",), f"{title}, {name}"))
            for name in names
        ]
        advance = stack.enter_context(progress("gloss maps", height, show=show))
        for top in range(0, height, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, height))
            pixels = read_pixels(fit, rows, slice(0, width))
            for writer, table, preview in zip(writers, tables, previews, strict=True):
                band = table(pixels).reshape(-1, width, 1).astype(np.float32)
                writer.write(band)
                shown = slice(-top % step, None, step)
                preview[-(-top // step) :][: len(band[shown])] = band[shown, ::step, 0]
            advance(rows.stop - rows.start)
    for meter, name, preview in zip(GLOSSMETERS, names, previews, strict=True):
        draw_values(
            folder / f"{name}.png",
            preview,
            title=f"Gloss at {meter.angle_deg:.0f}° · {title}",
            label="gloss units" if absolute else "relative gloss",
            logarithmic=True,
        )
        yield from (folder / f"{name}.exr", folder / f"{name}.png")


def facet_angles_deg(lights: Lights, camera: Camera) -> tuple[float, float]:
    """Return the least and the largest angle of incidence on facets that mirror a light into the camera."""
    cosine = np.clip(lights.direction @ camera.view_direction, -1.0, 1.0)
    angle = np.degrees(np.arccos(cosine)) / 2
    return float(angle.min()), float(angle.max())
