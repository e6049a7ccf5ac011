"""Pixels that are shown unasked, because they tell the range of what a painting does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impasto.errors import OptionError, Problem
from impasto.geometry import Array
from impasto.models import basis
from impasto.pixels import Pixels, luminance, render_pixels
from impasto.store import Fit, Stack

_BAND_ROWS = 256
# By the rank of the height of their highlight, and of what the model leaves unexplained.
_BY_HIGHLIGHT = {"high highlight": 0.99, "typical highlight": 0.5, "low highlight": 0.01}
_BY_RESIDUAL = {"poorly described": 0.99}


def telling_pixels(pixels: Pixels, fit: Fit, stack: Stack) -> dict[str, tuple[int, int]]:
    """Return a pixel with a high, a typical and a low highlight, and one that the model describes poorly.

    Parameters
    ----------
    pixels : Pixels
        Those to choose from.
    fit : Fit
        Theirs.
    stack : Stack

    Returns
    -------
    dict of str to (int, int)
        Column and row, by what the pixel tells. They are the 99th, 50th and 1st percentile of the highlight's
        height, and the 99th of the residual over the pixel's mean radiance.

    Raises
    ------
    OptionError
        If no pixel has all its parameters.
    """
    sample = pixels.select(pixels.whole)
    if not len(sample):
        raise OptionError(
            Problem(
                where=f"{stack.store}: {fit.group}",
                what="no pixel has a highlight that is known",
                do="Name pixels with --pixel, or fit lambert and look at its maps",
            )
        )
    ranks = {
        name: (values, rank)
        for values, wanted in (
            (highlight_height(sample, stack.camera.view_direction), _BY_HIGHLIGHT),
            (_relative_residual(fit, sample, stack), _BY_RESIDUAL),
        )
        for name, rank in wanted.items()
    }
    chosen = {
        name: int(np.argsort(values, kind="stable")[round(rank * (len(sample) - 1))])
        for name, (values, rank) in ranks.items()
    }
    return {name: (int(sample.column[number]), int(sample.row[number])) for name, number in chosen.items()}


def highlight_height(pixels: Pixels, view: Array) -> Array:
    """Return the relative radiance of the highlights, lit from their mirror direction, shape (P,)."""
    normal = pixels.normal.astype(np.float64)
    mirror = 2 * (normal @ view)[:, None] * normal - view
    _, lobes = basis(
        pixels.model,
        normal,
        mirror,
        np.tile(view, (len(pixels), 1)),
        pixels.shape,
        index=pixels.attributes["index_of_refraction"],
        fresnel=pixels.attributes["fresnel"],
    )
    return np.asarray(np.sum(pixels.specular * lobes, axis=1))


def _relative_residual(fit: Fit, pixels: Pixels, stack: Stack) -> Array:
    """Return each pixel's root mean square residual over its mean radiance as modelled."""
    height, width = fit.shape
    residual: NDArray[np.float32] = np.empty(len(pixels), np.float32)
    for top in range(0, height, _BAND_ROWS):
        rows = slice(top, min(top + _BAND_ROWS, height))
        here = (pixels.row >= rows.start) & (pixels.row < rows.stop)
        values = fit.read(rows, slice(0, width), ["residual_rms"])["residual_rms"]
        residual[here] = values[pixels.row[here] - top, pixels.column[here]]
    mean = luminance(render_pixels(pixels, stack.lights, stack.camera)).mean(axis=0)
    return np.asarray(residual / np.maximum(mean, 1e-9))
