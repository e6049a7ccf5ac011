"""Write the maps of a fit as files that other programs read, each with a picture that people read."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.band_writers import BandWriter, write_tiff_bands
from impasto.colour import encode_srgb
from impasto.maps.preview import COLOURS, draw_map, draw_statuses, map_limits, map_title, preview_fit
from impasto.models import parse_model
from impasto.output import prepare_folder, write_json
from impasto.progress import progress
from impasto.store import STATUS_MEANING, Fit, open_fit

_BAND_ROWS = 256
_PREVIEW_PX = 1600
_CODES = 65535

_FILE_NAMES = {"residual_rms": "residual"}


@dataclass(frozen=True)
class MapFiles:
    """The files of one map.

    Parameters
    ----------
    name : str
        Name of the map in the store.
    exact : Path
        The numbers as they are: EXR, or TIFF for the status.
    tiff : Path
        16-bit TIFF; for the status the same file as `exact`.
    preview : Path
        A picture with a legend.
    encoding : str
        What the codes of the TIFF file mean, in words and as a formula.
    low, high : float
        Values of the lowest and the highest code; values beyond are cut in the TIFF file only.
    median : float or None
        Median over the pixels of the preview, for maps of one number.
    """

    name: str
    exact: Path
    tiff: Path
    preview: Path
    encoding: str
    low: float
    high: float
    median: float | None


@dataclass(frozen=True)
class MapsSummary:
    """What `maps` did.

    Parameters
    ----------
    out : Path
        The folder with the files.
    model : str
        The model.
    maps : tuple of MapFiles
        One entry per map.
    status : dict of str to int
        How many pixels ended in which way.
    seconds : float
    """

    out: Path
    model: str
    maps: tuple[MapFiles, ...]
    status: dict[str, int]
    seconds: float


def maps(
    store: str | PathLike[str],
    *,
    model: str,
    out: str | PathLike[str],
    show_progress: bool | None = None,
) -> MapsSummary:
    """Write every map of a fit as a float EXR file, a 16-bit TIFF file and a readable PNG picture.

    ``maps.json`` beside them says what each file's numbers mean. Maps are streamed in bands of rows.

    Parameters
    ----------
    store : path
        Store with a fit of `model`.
    model : str
        Name of the model.
    out : path
        Folder for the files, made if it is not there; files of the same names are replaced.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    MapsSummary

    Raises
    ------
    OptionError
        If there is no such model.
    StoreError
        If there is no such store or no such complete fit.
    OutputError
        If the files cannot be written.
    """
    started = time.perf_counter()
    spec = parse_model(model)
    fit = open_fit(Path(store), spec.name)
    folder = prepare_folder(out)
    height, width = fit.shape
    small = preview_fit(Path(store), spec.name, (height, width), _PREVIEW_PX)
    counts: dict[int, int] = {}
    written = []
    with progress("maps", len(fit.names), show=show_progress) as advance:
        for name in sorted(fit.names, key=lambda name: (name.endswith("_sd"), name)):
            preview = small.read(slice(0, small.shape[0]), slice(0, small.shape[1]), [name])[name]
            writer = _MapWriter(fit, name, preview, folder)
            if name == "status":
                written.append(writer.write_status(counts))
            else:
                written.append(writer.write())
            advance(1)
    summary = MapsSummary(
        out=folder,
        model=spec.name,
        maps=tuple(written),
        status={STATUS_MEANING.get(code, str(code)): count for code, count in sorted(counts.items())},
        seconds=time.perf_counter() - started,
    )
    _write_manifest(summary)
    return summary


class _MapWriter:
    """Writes the files of one map."""

    def __init__(self, fit: Fit, name: str, preview: NDArray[Any], folder: Path) -> None:
        self._fit = fit
        self._name = name
        self._preview = preview
        self._title = map_title(name)
        self._stem = folder / _FILE_NAMES.get(name, name)

    def _path(self, ending: str) -> Path:
        return self._stem.with_name(self._stem.name + ending)

    def _bands(self) -> Iterator[NDArray[Any]]:
        height, width = self._fit.shape
        for top in range(0, height, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, height))
            values = self._fit.read(rows, slice(0, width), [self._name])[self._name]
            yield values.reshape(values.shape[0], width, -1)

    def write(self) -> MapFiles:
        """Write the EXR, the TIFF and the preview of a map of numbers."""
        layers = 1 if self._preview.ndim == 2 else self._preview.shape[2]
        height, width = self._fit.shape
        letters = {1: ("Y",), 3: ("R", "G", "B")}.get(layers, tuple(str(n) for n in range(1, layers + 1)))
        with BandWriter(self._path(".exr"), height, width, letters, self._title) as writer:
            for band in self._bands():
                writer.write(band)
        low, high = map_limits(self._name, self._preview)
        encoding = self._write_tiff(low, high, layers)
        draw_map(self._path(".png"), self._name, self._preview, model=self._fit.attributes["model"])
        finite = self._preview[np.isfinite(self._preview)] if layers == 1 else np.empty(0)
        return MapFiles(
            name=self._name,
            exact=self._path(".exr"),
            tiff=self._path(".tif"),
            preview=self._path(".png"),
            encoding=encoding,
            low=low,
            high=high,
            median=float(np.median(finite)) if finite.size else None,
        )

    def _write_tiff(self, low: float, high: float, layers: int) -> str:
        colours = self._name in COLOURS and layers in (1, 3)
        if self._name == "normal":
            encoding = "n = 2 code / 65535 - 1 per axis x, y, z; code (0, 0, 0): no value"
        elif colours:
            encoding = f"sRGB; value = {high:.6g} * linear(code / 65535); code 0 also: no value"
        else:
            encoding = f"value = {low:.6g} + {high - low:.6g} (code - 1) / 65534; code 0: no value"

        def codes() -> Iterator[NDArray[np.uint16]]:
            for band in self._bands():
                missing = ~np.isfinite(band)
                if self._name == "normal":
                    scaled = (band + 1) / 2 * _CODES
                elif colours:
                    scaled = encode_srgb(band, 1 / high) * _CODES
                else:
                    scaled = 1 + (np.clip(band, low, high) - low) / (high - low) * (_CODES - 1)
                yield np.rint(np.where(missing, 0, np.clip(scaled, 0, _CODES))).astype(np.uint16)

        about = f"{self._title}. {encoding}"
        shape = (*self._fit.shape, layers)
        write_tiff_bands(self._path(".tif"), codes(), shape, np.uint16, description=about, srgb=colours)
        return encoding

    def write_status(self, counts: dict[int, int]) -> MapFiles:
        """Write the status map, whose codes are kept as they are, and add up `counts`."""

        def codes() -> Iterator[NDArray[np.uint8]]:
            for band in self._bands():
                for code, count in zip(*np.unique(band, return_counts=True), strict=True):
                    counts[int(code)] = counts.get(int(code), 0) + int(count)
                yield band

        encoding = "; ".join(f"{code} {meaning}" for code, meaning in STATUS_MEANING.items())
        path = self._path(".tif")
        write_tiff_bands(
            path, codes(), (*self._fit.shape, 1), np.uint8, description=f"{self._title}. {encoding}"
        )
        draw_statuses(self._path(".png"), self._preview, counts, model=self._fit.attributes["model"])
        return MapFiles("status", path, path, self._path(".png"), encoding, 0.0, 255.0, None)


def _write_manifest(summary: MapsSummary) -> None:
    """Write what the files hold beside them."""
    entries = {
        entry.name: {
            "exact": entry.exact.name,
            "tiff": entry.tiff.name,
            "preview": entry.preview.name,
            "tiff_encoding": entry.encoding,
        }
        for entry in summary.maps
    }
    content = {"model": summary.model, "status": summary.status, "maps": entries}
    write_json(summary.out / "maps.json", content)
