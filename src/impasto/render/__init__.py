"""Render a fitted painting under any light, tile by tile."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.band_writers import BandWriter
from impasto.colour.displays import Display
from impasto.colour.rendition import Rendition, Shown
from impasto.geometry import Camera, Lights
from impasto.light_distance import without_distance
from impasto.light_strength import scale_lights
from impasto.models import parse_model
from impasto.output import prepare_folder
from impasto.pixels import read_pixels, render_pixels
from impasto.progress import progress
from impasto.render.animation import Animation
from impasto.render.display import requested_rendition
from impasto.render.lights import requested_lights
from impasto.store import Fit, PublishedStack, Stack, is_published, open_fit, open_published, open_stack

_BAND_BYTES = 192e6
"""What the parameters of a band and its renderings may take; the rest of the process needs about 0.3 GB."""

_BLOCK_ROWS = 256
"""Rows of the store's inner chunks; bands of whole blocks decode each chunk once."""

_LIGHTS_AT_A_TIME = 8
_ANIMATED_FROM = 3

_LETTERS = {1: ("Y",), 3: ("R", "G", "B")}

# Codes of a gamut mask: shown as it is, missing, too bright, outside the gamut.
_MISSING, _TOO_BRIGHT, _OUTSIDE = (np.float32(code / 255) for code in (85, 170, 255))


@dataclass(frozen=True)
class RenderSummary:
    """What `render` did.

    Parameters
    ----------
    out : Path
        The folder with the pictures.
    model : str
        The model rendered.
    lights : tuple of str
        Names of the lights, which are the pictures' names.
    files : tuple of Path
        Every file written.
    animation : Path or None
        The animated picture of a sweep.
    display : str
        What the display pictures are made for.
    camera_colour : str
        Where the meaning of the stack's channels comes from.
    exposure : float
        Factor on the radiance in the display pictures; 1 shows relative radiance 1 as white.
    white_xy : (float, float)
        CIE xy of what is shown in the colour of the display's white.
    adaptation, highlights : str
        How colours follow from that white to the display's, and what happens to those above it.
    missing_pixels : int
        Pixels without a fit: NaN in the EXR files, black on display.
    matte_pixels : int
        Pixels of which the highlight is not identified, rendered with their diffuse term alone.
    lamp_untold : bool
        Whether lights are as strong as stated although they were to be so as photographed, because the fit
        does not tell how strong the lamp was.
    too_bright : float
        Largest share, over the lights, of pixels brighter than the display's white.
    out_of_gamut : float
        Largest share, over the lights, of other pixels whose colour the display cannot show.
    seconds : float
    """

    out: Path
    model: str
    lights: tuple[str, ...]
    files: tuple[Path, ...]
    animation: Path | None
    display: str
    camera_colour: str
    exposure: float
    white_xy: tuple[float, float]
    adaptation: str
    highlights: str
    missing_pixels: int
    matte_pixels: int
    lamp_untold: bool
    too_bright: float
    out_of_gamut: float
    seconds: float


def render(
    store: str | PathLike[str],
    *,
    model: str,
    lights: str | PathLike[str] | Lights | None = None,
    light: Sequence[tuple[float, float]] = (),
    arm: Sequence[float] = (),
    as_photographed: bool = False,
    distant_light: bool = False,
    out: str | PathLike[str],
    display: str | PathLike[str] | Display = "srgb",
    exposure: float = 1.0,
    white_point: str | tuple[float, float] | None = None,
    adaptation: str = "cat16",
    highlights: str = "clip",
    gamut_mask: bool = False,
    tiff: bool = False,
    raw: bool = False,
    animate: bool | None = None,
    show_progress: bool | None = None,
) -> RenderSummary:
    """Render a fit under lights, as one linear EXR file and one picture for a display per light.

    Memory is bounded whatever the painting's size: about 0.5 GB for pictures of up to 20 000 columns.

    Parameters
    ----------
    store : path
        Store with a fit of `model`, or a published store with that model.
    model : str
        Name of the model.
    lights : path or Lights, optional
        Light file (.lp, .csv, .toml), or lights.
    light : sequence of (float, float), optional
        Zenith and azimuth of single lights, degrees.
    arm : sequence of float, optional
        Arm angles, degrees.
    as_photographed : bool, optional
        Whether lights are as strong as those of the photographs around them were, where the fit tells it, to
        be compared with a photograph; by default they are as strong as stated.
    distant_light : bool, optional
        Whether lights without a position are far away where the fit found those of the photographs near; by
        default they stand as near as those.
    out : path
        Folder for the pictures, made if it is not there; pictures of the same names are replaced.
    display : str, path or Display, optional
        ``srgb``, ``display-p3``, or the file of an ICC profile.
    exposure : float, optional
        Factor on the radiance in the display pictures. The EXR files hold the camera's own, unscaled.
    white_point : str or (float, float), optional
        What is shown in the colour of the display's white: an illuminant such as ``D50``, CIE ``x,y``, or
        ``light``; by default, the white that the camera's colours are calibrated for.
    adaptation : {'cat16', 'bradford'}, optional
        How colours follow from that white to the display's.
    highlights : {'clip', 'shoulder'}, optional
        What happens to colours brighter than the display's white; see `impasto.colour.rendition.Rendition`.
    gamut_mask : bool, optional
        Whether to write a grey picture per light, ``<name>_gamut.png``, that says where the display picture
        is not what it should be: 85 missing, 170 too bright, 255 outside the display's gamut, else 0.
    tiff : bool, optional
        Whether the display pictures are TIFF files of 16 bits instead of PNG files of 8.
    raw : bool, optional
        Whether to write the EXR files only.
    animate : bool, optional
        Whether to write an animated picture too; by default, for three or more arm angles.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    RenderSummary

    Raises
    ------
    OptionError
        If the model, a light or what the display pictures are asked for cannot be used.
    StoreError
        If there is no such store or no such complete fit.
    OutputError
        If the pictures cannot be written.
    """
    started = time.perf_counter()
    spec = parse_model(model)
    fit, stack = _open(Path(store), spec.name)
    _, height, width, channels = stack.shape
    if isinstance(lights, Lights):
        wanted = lights
    else:
        wanted = requested_lights(lights, light, arm, channels, stack.camera)
    stated = wanted
    if as_photographed:
        wanted = scale_lights(fit.attributes, wanted)
    if distant_light:
        fit = replace(fit, attributes=without_distance(fit.attributes))
    rendition = requested_rendition(
        stack,
        display=display,
        exposure=exposure,
        white_point=white_point,
        adaptation=adaptation,
        highlights=highlights,
    )
    endings = ((".tif" if tiff else ".png"), *(("_gamut.png",) if gamut_mask else ()))
    folder = prepare_folder(out)
    animate = len(arm) >= _ANIMATED_FROM if animate is None else animate
    animation = None
    if animate and not raw:
        animation = Animation(folder / f"{spec.name}.webp", height, width, rendition)
    files: list[Path] = []
    too_bright = out_of_gamut = 0.0
    missing = matte = 0
    with progress("render", len(wanted) * height, show=show_progress) as advance:
        for first in range(0, len(wanted), _LIGHTS_AT_A_TIME):
            index = range(first, min(first + _LIGHTS_AT_A_TIME, len(wanted)))
            group = wanted.select(index)
            missing = matte = 0
            with (
                _Pictures(
                    folder, group.names, fit.shape, channels, spec.title, rendition, () if raw else endings
                ) as pictures,
                ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="encode") as encoders,
            ):
                for band in render_bands(fit, group, stack.camera):
                    missing += band.missing_pixels
                    matte += band.matte_pixels
                    done = [
                        encoders.submit(pictures.write, number, radiance)
                        for number, radiance in enumerate(band.radiance)
                    ]
                    for number, radiance in enumerate(band.radiance):
                        if animation:
                            animation.add(first + number, band.rows, radiance)
                        done[number].result()
                        advance(radiance.shape[0])
            files += pictures.files
            too_bright = max(too_bright, pictures.too_bright)
            out_of_gamut = max(out_of_gamut, pictures.out_of_gamut)
    if animation:
        animation.save()
        files.append(animation.path)
    return RenderSummary(
        out=folder,
        model=spec.name,
        lights=wanted.names,
        files=tuple(files),
        animation=animation.path if animation else None,
        display=rendition.display.name,
        camera_colour=rendition.camera.source,
        exposure=exposure,
        white_xy=rendition.white_xy,
        adaptation=adaptation,
        highlights=highlights,
        missing_pixels=missing,
        matte_pixels=matte,
        lamp_untold=as_photographed and wanted is stated,
        too_bright=too_bright,
        out_of_gamut=out_of_gamut,
        seconds=time.perf_counter() - started,
    )


def _open(store: Path, model: str) -> tuple[Fit, Stack | PublishedStack]:
    if is_published(store):
        return open_published(store, model)
    return open_fit(store, model), open_stack(store)


class _Pictures(ExitStack):
    """The files of a few lights, open at once; each is there in the end whole or not at all."""

    def __init__(
        self,
        folder: Path,
        names: Sequence[str],
        shape: tuple[int, int],
        channels: int,
        title: str,
        rendition: Rendition,
        endings: Sequence[str],
    ) -> None:
        super().__init__()
        self._rendition = rendition
        self._pixels = shape[0] * shape[1]
        self._too_bright, self._outside = np.zeros((2, len(names)))

        def writer(name: str, ending: str) -> BandWriter:
            letters, icc_profile = {
                ".exr": (_LETTERS[channels], None),
                "_gamut.png": (_LETTERS[1], None),
            }.get(ending, (_LETTERS[rendition.channels], rendition.profile))
            return self.enter_context(
                BandWriter(folder / f"{name}{ending}", *shape, letters, f"{title}, light {name}", icc_profile)
            )

        try:
            self._linear = [writer(name, ".exr") for name in names]
            self._display = [[writer(name, ending) for name in names] for ending in endings]
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise

    @property
    def files(self) -> list[Path]:
        return [writer.path for writers in (self._linear, *self._display) for writer in writers]

    @property
    def too_bright(self) -> float:
        return float(self._too_bright.max()) / self._pixels

    @property
    def out_of_gamut(self) -> float:
        return float(self._outside.max()) / self._pixels

    def write(self, light: int, radiance: NDArray[np.float32]) -> None:
        self._linear[light].write(radiance)
        if not self._display:
            return
        shown = self._rendition(radiance)
        for writers, values in zip(self._display, (shown.drive, _gamut_mask(shown)), strict=False):
            writers[light].write(values)
        self._too_bright[light] += np.count_nonzero(shown.too_bright)
        self._outside[light] += np.count_nonzero(shown.outside)


def _gamut_mask(shown: Shown) -> NDArray[np.float32]:
    mask = np.zeros((*shown.missing.shape, 1), np.float32)
    mask[shown.missing], mask[shown.too_bright], mask[shown.outside] = _MISSING, _TOO_BRIGHT, _OUTSIDE
    return mask


@dataclass(frozen=True)
class Band:
    """Rows of a rendering.

    Parameters
    ----------
    rows : slice
        Which rows.
    radiance : ndarray of shape (L, rows, W, C), float32
        Relative radiance under each light, NaN where there is no fit.
    missing_pixels, matte_pixels : int
        Pixels without a fit, and those rendered with their diffuse term alone.
    """

    rows: slice
    radiance: NDArray[np.float32]
    missing_pixels: int
    matte_pixels: int


def render_bands(fit: Fit, lights: Lights, camera: Camera, *, residual: bool = True) -> Iterator[Band]:
    """Render a fit under lights, in bands of rows from top to bottom.

    A pixel whose highlight the photographs do not identify (status 5) is rendered without one.

    Parameters
    ----------
    fit : Fit
        A complete fit.
    lights : Lights
        The lights.
    camera : Camera
        The camera of the photographs.
    residual : bool, optional
        Whether to add what the model leaves over, where the fit describes it.

    Yields
    ------
    Band

    Raises
    ------
    StoreError
        If a map is damaged.
    """
    height, width = fit.shape
    channels = len(fit.attributes["light_rgb"])
    spec = parse_model(fit.attributes["model"])
    step = _band_rows(
        width, 8 + 2 * channels + spec.lobes + len(spec.shape_names) + 3 * channels * len(lights)
    )
    for top in range(0, height, step):
        rows = slice(top, min(top + step, height))
        pixels = read_pixels(fit, rows, slice(0, width), residual=residual)
        yield Band(
            rows=rows,
            radiance=render_pixels(pixels, lights, camera).reshape(
                -1, rows.stop - rows.start, width, channels
            ),
            missing_pixels=int(pixels.missing.sum()),
            matte_pixels=int(pixels.matte.sum()),
        )


def _band_rows(width: int, floats_per_pixel: int) -> int:
    """Return how many rows a band may have: whole blocks of the store, or a part of one for wide pictures."""
    rows = int(_BAND_BYTES / (4 * floats_per_pixel * width))
    if rows >= _BLOCK_ROWS:
        return rows // _BLOCK_ROWS * _BLOCK_ROWS
    return max(32, 1 << max(rows, 1).bit_length() - 1)
