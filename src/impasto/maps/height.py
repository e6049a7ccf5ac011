"""Write the relief that the normals of a fit make, as a picture or as a mesh."""

from __future__ import annotations

import time
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.band_writers import write_tiff_bands
from impasto.errors import OptionError, Problem, raise_problems
from impasto.images import write_tiff
from impasto.maps.integration import integrate_normals
from impasto.maps.mesh import write_ply, write_stl
from impasto.models import parse_model
from impasto.store import open_fit, open_stack

_ENDINGS = (".tif", ".tiff", ".stl", ".ply")
# A mesh of this many vertices takes 100 MB as STL and is what programs for meshes still handle with ease.
_MESH_VERTICES = 1_000_000
_CODES = 65535


@dataclass(frozen=True)
class HeightSummary:
    """What `height` did.

    Parameters
    ----------
    out : Path
        The file.
    unit : str
        ``mm``, or ``px`` where the stack does not know its scale.
    low, high : float
        Least and largest height, in that unit; the mean is 0.
    pitch : float
        Distance of neighbours in the file, in that unit.
    rows, columns : int
        Size of the height map in the file.
    encoding : str
        What the numbers in the file mean.
    seconds : float
    """

    out: Path
    unit: str
    low: float
    high: float
    pitch: float
    rows: int
    columns: int
    encoding: str
    seconds: float


def height(
    store: str | PathLike[str],
    *,
    model: str,
    out: str | PathLike[str],
    bits: int = 32,
    step: int | None = None,
) -> HeightSummary:
    """Write the relief whose slopes fit the normals best, in mm where the stack knows its scale.

    Parameters
    ----------
    store : path
        Store with a fit of `model`.
    model : str
        Name of the model.
    out : path
        File to write: .tif, or .stl or .ply for a mesh of triangles.
    bits : int, optional
        Of the TIFF file: 32 (floats, the heights themselves) or 16 (codes, explained in the file).
    step : int, optional
        Every how many pixels the file has a height; by default 1 in TIFF files, and in meshes as many as
        leave no more than a million vertices. In between lies the mean.

    Returns
    -------
    HeightSummary

    Raises
    ------
    OptionError
        If there is no such model, or an option has a value that is not possible.
    StoreError
        If there is no such store or no such complete fit.
    OutputError
        If the file cannot be written.

    Notes
    -----
    The normals are integrated by least squares, see `integrate_normals`: details are as good as the normals,
    and slow undulations of the whole are not, because errors add up along the way. All pixels are in memory
    at once, about 100 bytes each.
    """
    started = time.perf_counter()
    path = Path(out)
    ending = path.suffix.lower()
    raise_problems(OptionError, _problems(path, bits, step))
    spec = parse_model(model)
    fit = open_fit(Path(store), spec.name)
    mm_per_px = open_stack(Path(store)).camera.mm_per_px
    rows, columns = fit.shape
    relief = integrate_normals(fit.read(slice(0, rows), slice(0, columns), ["normal"])["normal"])
    mesh = ending in (".stl", ".ply")
    if step is None:
        step = max(1, int(np.ceil(np.sqrt(relief.size / _MESH_VERTICES)))) if mesh else 1
    if min(relief.shape) < 2 * step:
        what = f"is {step}, and the painting has {columns} x {rows} px"
        raise OptionError(Problem("--step", what, "Choose a smaller one"))
    scale = mm_per_px or 1.0
    values = _thinned(relief, step) * np.float32(scale)
    unit = "mm" if mm_per_px else "px"
    low, high = float(values.min()), float(values.max())
    pitch = step * scale
    encoding = f"{unit} towards the viewer, 0 in the mean"
    if ending == ".stl":
        write_stl(path, values, pitch)
    elif ending == ".ply":
        write_ply(path, values, pitch)
    elif bits == 32:
        write_tiff(path, values)
    else:
        span = max(high - low, 1e-9)
        encoding = f"height = {low:.6g} + {span:.6g} code / {_CODES} {encoding}"
        codes = np.rint((values - low) / span * _CODES).astype(np.uint16)
        write_tiff_bands(path, [codes[:, :, None]], (*codes.shape, 1), np.uint16, description=encoding)
    return HeightSummary(
        out=path,
        unit=unit,
        low=low,
        high=high,
        pitch=pitch,
        rows=values.shape[0],
        columns=values.shape[1],
        encoding=encoding,
        seconds=time.perf_counter() - started,
    )


def _problems(path: Path, bits: int, step: int | None) -> list[Problem]:
    problems = []
    if path.suffix.lower() not in _ENDINGS:
        what = f"ends in {path.suffix or 'nothing'!r}, expected {', '.join(_ENDINGS)}"
        problems.append(Problem(f"--out {path}", what, "Choose one of these formats"))
    if bits not in (16, 32):
        problems.append(Problem("--bits", f"is {bits}, expected 16 or 32", "Leave it out for 32"))
    if step is not None and step < 1:
        problems.append(Problem("--step", f"is {step}, expected 1 or more", "Leave it out"))
    return problems


def _thinned(relief: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """Return the means of squares of `step` pixels; what is over at the right and below is left out."""
    rows, columns = (size // step for size in relief.shape)
    squares = relief[: rows * step, : columns * step].reshape(rows, step, columns, step)
    result: NDArray[np.float32] = squares.mean(axis=(1, 3))
    return result
