"""Relative exposures of the photographs of a capture, from the light file or the EXIF data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from impasto.capture.lights import LightRow
from impasto.capture.photographs import Photograph
from impasto.errors import Problem
from impasto.geometry import Array

# Exposures closer than this are one setting written in two ways, such as 1/60 and 0.0167.
_SAME = 0.005


def relative_exposure(
    rows: Sequence[LightRow], photographs: Sequence[Photograph]
) -> tuple[Array, list[str], list[Problem]]:
    """Return how much longer each photograph was exposed than most.

    Twice the exposure reads as twice the radiance, as twice the light would: it is counted as intensity.

    Returns
    -------
    exposure : ndarray of shape (L,), float64
        Product of time, sensitivity and aperture area relative to the most frequent one.
    notes : list of str
    problems : list of Problem
        Photographs of unknown exposure beside others whose exposures differ.
    """
    pairs = list(zip(rows, photographs, strict=True))
    exposure = np.ones(len(pairs))
    notes: list[str] = []
    problems: list[Problem] = []
    settings: list[tuple[str, str, list[float | None], Callable[[Array], Array]]] = [
        (
            "exposure time",
            "s",
            [row.exposure_s or photograph.exposure_s for row, photograph in pairs],
            lambda time: time,
        ),
        (
            "aperture (f-number)",
            "",
            [photograph.f_number for photograph in photographs],
            lambda number: number**-2,
        ),
        ("sensitivity (ISO)", "", [photograph.iso for photograph in photographs], lambda iso: iso),
    ]
    for title, unit, values, factor in settings:
        known = np.array([value for value in values if value])
        if not known.size or known.max() <= known.min() * (1 + _SAME):
            continue
        unknown = [photograph for photograph, value in zip(photographs, values, strict=True) if not value]
        problems += [
            Problem(
                photograph.path.name,
                f"has no {title}, and the others have different ones",
                "Give exposure_s for every light in a TOML or CSV light file, or restore the EXIF data",
            )
            for photograph in unknown
        ]
        if not unknown:
            exposure *= factor(known)
            notes.append(
                f"{title} differs, {known.min():.4g} to {known.max():.4g} {unit}".rstrip()
                + ": counted as intensity of the lights"
            )
    if problems:
        return np.ones(len(pairs)), [], problems
    return exposure / _most_frequent(exposure), notes, []


def _most_frequent(exposure: Array) -> float:
    if not exposure.size:
        return 1.0
    steps = np.round(np.log(exposure) / _SAME).astype(int)
    step, _ = Counter(steps.tolist()).most_common(1)[0]
    return float(exposure[steps == step][0])
