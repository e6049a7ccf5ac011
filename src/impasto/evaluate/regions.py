"""Regions of a painting, drawn as an image, and samples of their pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.capture.photographs import read_photograph
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.pixels import Pixels, join_pixels, read_pixels
from impasto.progress import progress
from impasto.store import Fit

WHOLE = "whole painting"
_MOST = 256
_BAND_ROWS = 256


@dataclass(frozen=True)
class Regions:
    """Which region each pixel belongs to.

    Parameters
    ----------
    names : tuple of str
    label : ndarray of shape (H, W), uint16
        Number of the region in `names`, counted from 1; 0 is outside of all.
    """

    names: tuple[str, ...]
    label: NDArray[np.uint16]


def read_regions(path: Path, height: int, width: int) -> Regions:
    """Read regions that were drawn over a picture of the painting.

    Black is outside; every other grey or colour is one region, named by its number or, in colour, by its
    code such as ``#ff8000``.

    Parameters
    ----------
    path : Path
        PNG, TIFF, EXR or JPEG of the painting's size; JPEG blurs edges and is refused.
    height, width : int

    Raises
    ------
    OptionError
        If it is no image, of another size, empty, or has more colours than a drawing.
    """
    where = f"regions {path}"
    if not path.is_file():
        raise OptionError(Problem(where, "does not exist or is no file", "Give the picture of the regions"))
    try:
        if path.suffix.lower() in (".jpg", ".jpeg"):
            raise OptionError(
                Problem(where, "is a JPEG, which mixes colours at the edges", "Save the drawing as PNG")
            )
        image, _ = read_photograph(path, "linear")
        if (image.height, image.width) != (height, width):
            raise OptionError(
                Problem(
                    where,
                    f"is {image.width} x {image.height} pixels, and the painting {width} x {height}",
                    "Draw over a map or a rendering of the painting, at full size",
                )
            )
        values = np.concatenate([band for _, band in image.bands(height)])
    except (CaptureError, KeyError) as error:
        told = (
            error.problems[0].what if isinstance(error, CaptureError) else "is not an image that can be read"
        )
        raise OptionError(Problem(where, told, "Save the drawing as PNG")) from error
    colours, index = np.unique(values.reshape(height * width, -1), axis=0, return_inverse=True)
    drawn = colours.any(axis=1)
    if not drawn.any():
        raise OptionError(Problem(where, "is black everywhere", "Paint each region in a colour of its own"))
    if drawn.sum() > _MOST:
        raise OptionError(
            Problem(
                where,
                f"has {drawn.sum()} colours, at most {_MOST} are regions",
                "Draw without soft edges (no anti-aliasing), on black",
            )
        )
    number = np.where(drawn, np.cumsum(drawn), 0).astype(np.uint16)
    digits = 2 * values.dtype.itemsize
    names = tuple(
        str(colour[0]) if len(set(colour.tolist())) == 1 else "#" + "".join(f"{v:0{digits}x}" for v in colour)
        for colour in colours[drawn]
    )
    return Regions(names, number[index].reshape(height, width))


def check_inside(pixels: Sequence[tuple[int, int]], height: int, width: int) -> None:
    """Check that pixels, as column and row, lie in a painting.

    Raises
    ------
    OptionError
        Listing all that do not.
    """
    raise_problems(
        OptionError,
        [
            Problem(
                where=f"--pixel {column},{row}",
                what=f"lies outside of the painting, which has {width} columns and {height} rows",
                do=f"Count from 0: column up to {width - 1}, row up to {height - 1}",
            )
            for column, row in pixels
            if not (0 <= column < width and 0 <= row < height)
        ],
    )


@dataclass(frozen=True)
class Sample:
    """Pixels drawn from a region.

    Parameters
    ----------
    pixels : Pixels
        A random choice of those that have all their parameters.
    known, unknown : int
        How many pixels of the region have all their parameters, and how many have not.
    """

    pixels: Pixels
    known: int
    unknown: int


def sample_regions(fit: Fit, regions: Regions | None, size: int, *, show: bool | None) -> dict[str, Sample]:
    """Draw pixels from the whole painting and from each region, in one pass over the fit.

    Parameters
    ----------
    fit : Fit
    regions : Regions, optional
    size : int
        At most this many pixels from each; every pixel is as likely as the others, and the choice is the same
        each time.
    show : bool or None
        Whether to show a progress bar.

    Returns
    -------
    dict of str to Sample
        The whole painting first.
    """
    height, width = fit.shape
    names = [WHOLE, *(regions.names if regions else ())]
    samples: dict[str, Sample] = {}
    keys: dict[str, NDArray[np.float64]] = {}
    with progress("Reading pixels", height, show=show) as advance:
        for top in range(0, height, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, height))
            pixels = read_pixels(fit, rows, slice(0, width))
            pixels = pixels.select(pixels.whole)
            label = regions.label[rows] if regions else np.zeros((rows.stop - top, width), np.uint16)
            of_pixel = label[pixels.row - top, pixels.column]
            key = np.random.default_rng(top).random(len(pixels))
            for number, name in enumerate(names):
                member = of_pixel == number if number else np.ones(len(pixels), bool)
                area = int(np.count_nonzero(label == number)) if number else label.size
                found = Sample(pixels.select(member), int(member.sum()), area - int(member.sum()))
                found, keys[name] = _lowest(found, key[member], samples.get(name), keys.get(name), size)
                samples[name] = found
            advance(rows.stop - top)
    return samples


def _lowest(
    new: Sample,
    new_keys: NDArray[np.float64],
    old: Sample | None,
    old_keys: NDArray[np.float64] | None,
    size: int,
) -> tuple[Sample, NDArray[np.float64]]:
    """Return the pixels of two samples that have the lowest keys, and these keys."""
    if old is None or old_keys is None:
        pixels, keys, known, unknown = new.pixels, new_keys, new.known, new.unknown
    else:
        pixels, keys = join_pixels([old.pixels, new.pixels]), np.concatenate([old_keys, new_keys])
        known, unknown = old.known + new.known, old.unknown + new.unknown
    kept = np.sort(np.argsort(keys, kind="stable")[:size])
    return Sample(pixels.select(kept), known, unknown), keys[kept]
