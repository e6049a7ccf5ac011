"""Regions that nobody drew: pixels of like paint, found from the maps of a fit."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from impasto.errors import OptionError, Problem, raise_problems
from impasto.evaluate.regions import WHOLE, Regions, read_regions, sample_regions
from impasto.geometry import Array
from impasto.images import write_tiff
from impasto.maps.pictures import draw_status
from impasto.pixels import Pixels, read_pixels
from impasto.progress import progress
from impasto.store import Fit

MOST_CLUSTERS = 12
_SAMPLED = 20_000
_TRIALS = 8
_STEPS = 100
_BAND_ROWS = 256
# A specular magnitude that cannot be told from none.
_INVISIBLE = np.float32(1e-3)
_PREVIEW_PX = 1600


def choose_regions(
    fit: Fit, drawn: str | PathLike[str] | None, clusters: int | None, *, show: bool | None
) -> Regions | None:
    """Return the regions drawn in a picture, or as many clusters as asked for, or None without either.

    Parameters
    ----------
    fit : Fit
        Whose maps are clustered, and whose size a drawing must have.
    drawn : path, optional
    clusters : int, optional
    show : bool or None
        Whether to show a progress bar.

    Raises
    ------
    OptionError
        If both are given, or either cannot be used.
    """
    if drawn and clusters is not None:
        raise OptionError(
            Problem(
                "--regions and --clusters", "both divide the painting, expected one", "Leave one of them out"
            )
        )
    if clusters is not None:
        return cluster_regions(fit, clusters, show=show)
    return read_regions(Path(drawn), *fit.shape) if drawn else None


def cluster_regions(fit: Fit, count: int, *, show: bool | None) -> Regions:
    """Divide a painting into clusters of pixels whose diffuse colour and highlight are alike.

    Parameters
    ----------
    fit : Fit
    count : int
        How many, 2 to 12.
    show : bool or None
        Whether to show a progress bar.

    Returns
    -------
    Regions
        The largest cluster first; pixels that lack a parameter belong to none.

    Raises
    ------
    OptionError
        If `count` is out of range, or fewer pixels than that have all their parameters.

    Notes
    -----
    k-means [Lloyd1982]_ over 20,000 pixels, from the best of eight random starts, always the same. A pixel's
    features are the cube root of its diffuse magnitude per channel, nearly equal steps to the eye, and the
    logarithms of its specular magnitudes, those below 0.001 counting as that, and of its shape parameters;
    each has a standard deviation of 1.
    """
    from scipy.cluster.vq import kmeans2, vq

    raise_problems(OptionError, _count_problems(count))
    sample = sample_regions(fit, None, _SAMPLED, show=show)[WHOLE].pixels
    if len(sample) < count:
        raise OptionError(
            Problem(
                f"--clusters {count}",
                f"only {len(sample)} pixels of {fit.group} have all parameters, expected {count} or more",
                "Ask for fewer clusters, or draw the regions and use --regions",
            )
        )
    features = _features(sample)
    mean, scale = features.mean(axis=0), features.std(axis=0)
    scale[scale < 1e-9] = 1.0
    features = (features - mean) / scale
    trials = []
    for seed in range(_TRIALS):
        centres, label = kmeans2(features, count, iter=_STEPS, minit="++", missing="warn", seed=seed)
        trials.append((float(np.square(features - centres[label]).sum()), seed, centres))
    centres = min(trials)[2]
    height, width = fit.shape
    found = np.zeros((height, width), np.uint16)
    with progress("clusters", height, show=show) as advance:
        for top in range(0, height, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, height))
            pixels = read_pixels(fit, rows, slice(0, width))
            pixels = pixels.select(pixels.whole)
            if len(pixels):
                found[pixels.row, pixels.column] = 1 + vq((_features(pixels) - mean) / scale, centres)[0]
            advance(rows.stop - rows.start)
    order = np.argsort(-np.bincount(found.ravel(), minlength=1 + count)[1:], kind="stable")
    rank = np.zeros(1 + count, np.uint16)
    rank[1 + order] = np.arange(1, 1 + count)
    return Regions(tuple(f"cluster {number}" for number in range(1, 1 + count)), rank[found])


def write_regions(folder: Path, regions: Regions) -> list[Path]:
    """Write regions as ``clusters.tif``, their numbers, and as a picture; return both paths.

    Raises
    ------
    OutputError
        If they cannot be written.
    """
    files = [folder / "clusters.tif", folder / "clusters.png"]
    write_tiff(files[0], regions.label.astype(np.uint8), None)
    step = -(-max(regions.label.shape) // _PREVIEW_PX)
    draw_status(
        files[1],
        regions.label[::step, ::step],
        title="Pixels of like paint",
        meaning=dict(enumerate(["in no cluster", *regions.names])),
        counts=dict(enumerate(np.bincount(regions.label.ravel(), minlength=1 + len(regions.names)).tolist())),
    )
    return files


def _features(pixels: Pixels) -> Array:
    specular = np.maximum(pixels.specular, _INVISIBLE)
    lobes = np.log(np.concatenate([specular, pixels.shape], axis=1), dtype=np.float64)
    return np.concatenate([np.cbrt(pixels.diffuse, dtype=np.float64), lobes], axis=1)


def _count_problems(count: int) -> list[Problem]:
    if 2 <= count <= MOST_CLUSTERS:
        return []
    what = f"is not from 2 to {MOST_CLUSTERS}"
    return [Problem(f"--clusters {count}", what, "Give the number of paints that you expect to tell apart")]
