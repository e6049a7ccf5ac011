"""Find out whether the camera moved between the photographs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_gradient_magnitude

from impasto.calibrate.files import subject_of, write_calibration
from impasto.calibrate.shots import photographs_in, read_shot
from impasto.errors import CaptureError, Problem
from impasto.geometry import Array

# Parts of the frame that are compared, so that its middle says as much as its edges, and their size.
_WINDOW_PX = 512
_WINDOWS = ((0.5, 0.5), (0.2, 0.2), (0.2, 0.8), (0.8, 0.2), (0.8, 0.8))
_FINENESS = 50
# A photograph that lies further off than this has moved.
_MOVED_PX = 0.5


@dataclass(frozen=True)
class Steadiness:
    """What `calibrate.steadiness` found.

    Parameters
    ----------
    file : Path
    names : tuple of str, length L
    shift_px : ndarray of shape (L, 2)
        Columns and rows by which the content of each photograph lies to the right of and below its usual
        place.
    moved : tuple of str
        Photographs that lie off by more than half a pixel.
    bumped : str
        The photograph from which on all lie elsewhere, "" if there is none.
    """

    file: Path
    names: tuple[str, ...]
    shift_px: Array
    moved: tuple[str, ...]
    bumped: str


def steadiness(
    photos: str | PathLike[str], out: str | PathLike[str], *, exclude: Iterable[str] = ()
) -> Steadiness:
    """Measure by how much the photographs of a series are shifted against each other.

    Parameters
    ----------
    photos : path
        Folder of photographs, in the order in which they were taken.
    out : path
        The calibration file to write, such as ``steadiness.json``.
    exclude : iterable of str, optional
        Photographs to leave out.

    Returns
    -------
    Steadiness

    Raises
    ------
    CaptureError
        If photographs cannot be read, or there are fewer than three.
    OutputError
        If the file cannot be written.

    Notes
    -----
    Phase correlation of the edges, which the lights change less than the brightness, in five parts of the
    frame; each photograph is compared with the mean of those before it, and with its predecessor.

    References
    ----------
    [GuizarSicairos2008]_
    """
    from skimage.registration import phase_cross_correlation

    paths = photographs_in(Path(photos), exclude)
    if len(paths) < 3:
        raise CaptureError(
            Problem(str(photos), "holds fewer than three photographs", "Give the whole series")
        )
    first = read_shot(paths[0])
    seen: list[list[NDArray[np.float64]]] = []
    made_from = []
    for path in paths:
        shot = first if path == paths[0] else read_shot(path)
        if shot.codes.shape != first.codes.shape:
            raise CaptureError(Problem(path.name, f"has another size than {paths[0].name}", "Leave it out"))
        luminance = shot.linear().mean(axis=2)
        seen.append([edges(log_level(luminance[part])) for part in part_slices(*luminance.shape)])
        made_from.append(shot.provenance)
    mean = [np.mean([one[part] for one in seen], axis=0) for part in range(len(seen[0]))]
    shifts = []
    for one in seen:
        found = [
            phase_cross_correlation(reference, part, upsample_factor=_FINENESS, normalization=None)[0]
            for reference, part in zip(mean, one, strict=True)
        ]
        rows, columns = -np.median(found, axis=0)
        shifts.append((columns, rows))
    shift = np.array(shifts)
    shift -= np.median(shift, axis=0)
    names = tuple(path.stem for path in paths)
    off = np.hypot(*shift.T)
    moved = tuple(name for name, distance in zip(names, off, strict=True) if distance > _MOVED_PX)
    bumped = _bumped(shift, names)
    write_calibration(
        Path(out),
        "steadiness",
        {
            "shift_px": {name: at.tolist() for name, at in zip(names, shift, strict=True)},
            "moved": list(moved),
        },
        subject=subject_of([first], size=True),
        made_from=made_from,
    )
    return Steadiness(Path(out), names, shift, moved, bumped)


def part_slices(height: int, width: int) -> list[tuple[slice, slice]]:
    """Return the rows and columns of the parts of a frame that are compared: all of it if it is small."""
    if min(height, width) <= _WINDOW_PX:
        return [(slice(0, height), slice(0, width))]
    parts = []
    for down, across in _WINDOWS:
        top = int(np.clip(down * height - _WINDOW_PX / 2, 0, height - _WINDOW_PX))
        left = int(np.clip(across * width - _WINDOW_PX / 2, 0, width - _WINDOW_PX))
        parts.append((slice(top, top + _WINDOW_PX), slice(left, left + _WINDOW_PX)))
    return parts


def log_level(image: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the logarithm of a luminance, in which light and dark parts have like edges."""
    return np.asarray(np.log(np.maximum(image, 0) + 0.05 * float(image.mean()) + 1e-9))


def edges(level: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the edges of a logarithm of luminance, fading out towards the image's border."""
    edges = gaussian_gradient_magnitude(level.astype(np.float64), 1.0)
    edges -= edges.mean()
    taper = np.outer(np.hanning(edges.shape[0]), np.hanning(edges.shape[1]))
    return np.asarray(edges * taper / max(float(edges.std()), 1e-12))


def _bumped(shift: Array, names: tuple[str, ...]) -> str:
    """Return the photograph from which on all lie elsewhere than those before."""
    best, name = 0.0, ""
    for at in range(1, len(shift)):
        before, after = shift[:at], shift[at:]
        apart = float(np.hypot(*(np.median(after, axis=0) - np.median(before, axis=0))))
        within = max(float(np.abs(before - np.median(before, axis=0)).max()),
                     float(np.abs(after - np.median(after, axis=0)).max()))  # fmt: skip
        if apart > max(_MOVED_PX, 2 * within) and apart - within > best:
            best, name = apart - within, names[at]
    return name
