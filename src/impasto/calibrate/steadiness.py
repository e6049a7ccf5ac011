"""Find out whether the camera moved between the photographs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_gradient_magnitude

from impasto.calibrate.files import Subject, subject_of, write_calibration
from impasto.calibrate.registration import register
from impasto.calibrate.shots import one_by_one, photographs_in
from impasto.errors import CaptureError, Problem
from impasto.geometry import Array

# Parts of the frame that are compared, so that its middle says as much as its edges, and their size.
_WINDOW_PX = 512
_WINDOWS = ((0.5, 0.5), (0.2, 0.2), (0.2, 0.8), (0.8, 0.2), (0.8, 0.8))
# Photographs of smaller frames have too little detail to be told from those of something else.
_LEAST_PX = 96
# A photograph that lies further off than this has moved.
_MOVED_PX = 0.5
# One that lies off by more than so many standard deviations can be shifted back.
_SIGNIFICANT = 3.0


@dataclass(frozen=True)
class Steadiness:
    """What `calibrate.steadiness` found.

    Parameters
    ----------
    file : Path
    names : tuple of str, length L
    shift_px : ndarray of shape (L, 2)
        Columns and rows by which the content of each photograph lies to the right of and below its usual
        place; NaN where that cannot be told.
    uncertainty_px : ndarray of shape (L,)
        Standard deviation of each component of the shift.
    moved : tuple of str
        Photographs that lie off by more than half a pixel.
    bumped : str
        The photograph from which on all lie elsewhere, "" if there is none.
    corrected : tuple of str
        Photographs that `stack` shifts back, because they lie off by more than thrice the uncertainty.
    unknown : tuple of str
        Photographs that show too little in common with the others, or lie too far off them.
    turned : dict of str to float
        Photographs that are turned or scaled against the others, and by how many pixels in the corners.
    """

    file: Path
    names: tuple[str, ...]
    shift_px: Array
    uncertainty_px: Array
    moved: tuple[str, ...]
    bumped: str
    corrected: tuple[str, ...]
    unknown: tuple[str, ...]
    turned: dict[str, float]


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
        If photographs cannot be read or differ in size, there are fewer than three, or most have too little
        in common.
    OutputError
        If the file cannot be written.

    Notes
    -----
    A first guess comes from phase correlation of the edges, which the lights change less than the
    brightness, in five parts of the frame, against the mean of all photographs; `register` refines it.

    References
    ----------
    [GuizarSicairos2008]_
    """
    paths = photographs_in(Path(photos), exclude)
    if len(paths) < 3:
        raise CaptureError(
            Problem(str(photos), "holds fewer than three photographs", "Give the whole series")
        )
    made_from: list[dict[str, Any]] = []
    seen: list[list[NDArray[np.float32]]] = []
    subject, size = Subject(), (0, 0)
    for shot in one_by_one(paths):
        luminance = shot.luminance()
        if not seen:
            subject, size = subject_of([shot], size=True), luminance.shape
        seen.append([np.array(luminance[part], np.float32) for part in part_slices(*size)])
        made_from.append(shot.provenance)
    parts = list(zip(*seen, strict=True))
    rough = _coarse(parts)
    found = register(parts, _corners(size), float(np.hypot(*size)) / 2, rough)
    names = tuple(path.stem for path in paths)
    shift = found.shift_px[:, ::-1]
    known = np.isfinite(shift[:, 0])
    off = np.where(known, np.hypot(*shift.T), 0.0)
    if min(size) >= _LEAST_PX and np.count_nonzero(known) < max(3, len(paths) / 2):
        lost = ", ".join(np.array(names)[~known][:5].tolist())
        what = f"holds {np.count_nonzero(~known)} of {len(paths)} photographs with too little in common with "
        what += f"the others: {lost}"
        raise CaptureError(Problem(str(photos), what, "Give one series of one painting under all lights"))
    turned = found.turned_px > _MOVED_PX
    correct = known & ~turned & (off > _SIGNIFICANT * np.nan_to_num(found.uncertainty_px))
    corrected = tuple(np.array(names)[correct].tolist())
    moved = tuple(np.array(names)[off > _MOVED_PX].tolist())
    write_calibration(
        Path(out),
        "steadiness",
        {
            "shift_px": {name: _json(at) for name, at in zip(names, shift, strict=True)},
            "uncertainty_px": {
                name: None if np.isnan(one) else round(float(one), 4)
                for name, one in zip(names, found.uncertainty_px, strict=True)
            },
            "moved": list(moved),
            "corrected": list(corrected),
            "turned_px": {
                name: round(float(one), 3)
                for name, one in zip(names, found.turned_px, strict=True)
                if one > _MOVED_PX
            },
        },
        subject=subject,
        made_from=made_from,
    )
    return Steadiness(
        file=Path(out),
        names=names,
        shift_px=shift,
        uncertainty_px=found.uncertainty_px,
        moved=moved,
        bumped=_bumped(np.where(known[:, None], shift, rough[:, ::-1]), names),
        corrected=corrected,
        unknown=tuple(np.array(names)[~known].tolist()),
        turned={
            name: float(one) for name, one in zip(names, found.turned_px, strict=True) if one > _MOVED_PX
        },
    )


def _coarse(parts: Sequence[Sequence[NDArray[np.floating]]]) -> Array:
    """Return rows and columns by which photographs lie off the mean of all, to a pixel or so."""
    from skimage.registration import phase_cross_correlation

    found = []
    for levels in parts:
        shown = [edges(log_level(level)) for level in levels]
        reference = np.mean(shown, axis=0)
        found.append([
            -phase_cross_correlation(reference, one, upsample_factor=10, normalization=None)[0]
            for one in shown
        ])  # fmt: skip
    shift = np.median(found, axis=0)
    return np.asarray(shift - np.median(shift, axis=0))


def _corners(size: tuple[int, ...]) -> Array:
    """Return row and column of each part's first pixel, from the middle of the frame."""
    height, width = size
    return np.array([
        (down.start - (height - 1) / 2, across.start - (width - 1) / 2)
        for down, across in part_slices(height, width)
    ])  # fmt: skip


def _json(shift: Array) -> list[float] | None:
    # A thousandth of a pixel is below what can be measured.
    return None if np.isnan(shift).any() else [round(float(one), 3) for one in shift]


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
