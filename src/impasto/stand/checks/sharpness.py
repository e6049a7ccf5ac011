"""Is a photograph as sharp as the others?"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from impasto.stand.checks.finding import Finding
from impasto.stand.look import Look
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

# Bands of detail, as pairs of Gaussian widths in pixels: a blur of a pixel halves the first and leaves the
# second nearly as it is.
_FINE, _COARSE = (0.8, 1.6), (2.5, 5.0)

# The frame is compared in so many fields a side; a highlight that wanders blunts some of them, a blur all.
_FIELDS = 6
_QUANTILE = 0.7
# Steep relief and a gloss that comes and goes change the detail more than a blur does.
_LEAST_REFERENCES, _MOST_SPREAD = 3, 1.25
# A blur takes as much from every field. Where a loss is no larger than that of a blur of a pixel, fields that
# differ by more than this factor show that the light has changed instead.
_SLIGHT, _MOST_UNEVEN = 0.6, 1.22
# A blur of two pixels and more leaves no more than this share of the detail, whatever the light is.
_STRONGLY = 0.5

Band = NDArray[np.float64]


def sharpness(look: Look, references: Sequence[Look]) -> float | None:
    """Return how much fine detail a photograph has for its coarse detail, against others; 1 for as much.

    None where nobody can tell, because the others are fewer than three, or differ too much among themselves,
    or a slight loss is not the same all over the frame.

    Parameters
    ----------
    look : Look
    references : sequence of Look
        Photographs under lamps near to its own.

    Notes
    -----
    Detail is weighed by where the references have theirs, so that noise, dust and highlights count little,
    and compared field by field of the frame. Where the references differ among themselves, the least sharp
    of them sets the measure. Measured on photographs of an icon and of a plaster cat, each against four of
    those taken before it: originals have 0.97 or more, those blurred by a Gaussian of 1 px at most 0.83, of
    2 px 0.58, and fields of the former differ by a factor of 1.14.
    """
    if len(references) < _LEAST_REFERENCES:
        return None
    own, theirs = [], []
    for number in range(len(look.parts)):
        bands = [_bands(other, number) for other in references]
        weights = [np.sum(each, axis=0) for each in zip(*bands, strict=True)]
        fields = np.array([_fields(each, weights) for each in bands])
        usual = np.median(fields, axis=0)
        own.append(_fields(_bands(look, number), weights) / usual)
        theirs.append(fields / usual)
    bluntest, sharpest = np.quantile(np.concatenate(own), [1 - _QUANTILE, _QUANTILE])
    others = np.quantile(np.concatenate(theirs, axis=1), _QUANTILE, axis=1)
    if others.max() > _MOST_SPREAD * others.min():
        return None
    found = float(sharpest / min(1.0, others.min()))
    slight_and_uneven = _SLIGHT < found < 1 and sharpest > _MOST_UNEVEN * bluntest
    return None if slight_and_uneven else found


def blurred(
    look: Look, shot: Shot, references: Sequence[Look], limits: Limits, *, alike: bool
) -> list[Finding]:
    """Return whether a photograph is less sharp than those under lamps near its own.

    Parameters
    ----------
    look, shot
    references : sequence of Look
    limits : Limits
    alike : bool
        Whether it shows the edges that they show; if it does not, only a strong blur can be told.
    """
    found = sharpness(look, references)
    if found is None or found >= (1 - limits.blur if alike else _STRONGLY):
        return []
    least = f"at least {1 - limits.blur:.0%} planned"
    what = f"has {found:.0%} of the fine detail of photographs under lamps near its own, {least}"
    do = "See that focus and stand are locked and nobody walks about, then take it again"
    return [Finding("blurred", (shot.name,), what, do)]


@lru_cache(maxsize=60)
def _bands(look: Look, part: int) -> tuple[Band, Band]:
    """Return fine and coarse detail of a part; kept as `movement` keeps edges."""
    image = look.parts[part].astype(np.float64)
    window = np.sqrt(np.outer(np.hanning(image.shape[0]), np.hanning(image.shape[1])))
    fine, coarse = (
        gaussian_filter(image, narrow) - gaussian_filter(image, wide) for narrow, wide in (_FINE, _COARSE)
    )
    return np.abs(fine) * window, np.abs(coarse) * window


def _fields(bands: tuple[Band, Band], weights: Sequence[Band]) -> NDArray[np.float64]:
    """Return the ratio of fine to coarse detail in each field of the frame."""
    fine, coarse = (_sums(band * weight) for band, weight in zip(bands, weights, strict=True))
    return np.asarray((fine + 1e-12) / (coarse + 1e-12))


def _sums(image: Band) -> NDArray[np.float64]:
    rows, columns = image.shape[0] // _FIELDS, image.shape[1] // _FIELDS
    cut = image[: rows * _FIELDS, : columns * _FIELDS].reshape(_FIELDS, rows, _FIELDS, columns)
    return np.asarray(cut.sum(axis=(1, 3)).ravel())
