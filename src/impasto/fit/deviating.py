"""Samples far from the model that lie in no shadow: dust, hands, reflections of something else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from impasto.fit.procedure import Findings

# A sample deviates if it is further from the model than this share of it, and than so many times what is
# usual for its pixel: a model that is wrong everywhere is no dirt.
_SHARE = 0.25
_TIMES = 6.0

# From these shares on, of all samples and of a photograph's, a note tells of them.
_WORTH_TELLING = 0.001
_MANY = 0.02


def deviating(
    measured: NDArray[np.float32],
    radiance: NDArray[np.float32],
    noise: tuple[float, float, float],
    left_out: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return which samples (L, N) deviate from a model far more than the others of their pixel.

    Parameters
    ----------
    measured, radiance : ndarray of shape (L, N, C), float32
        Of the photographs, NaN where a sample is missing or clipped, and of the model.
    noise : tuple of float
        (read, photon, relative); see `store.Stack.noise`.
    left_out : ndarray of shape (L, N), bool
        Samples in shadow, which do not count.

    Notes
    -----
    What is usual for a pixel is the median of its distances in standard deviations of the noise, over 0.6745,
    as for a Gaussian, but at least 1.
    """
    read, photon, relative = noise
    level = np.maximum(measured, np.float32(0.0))
    variance = (read**2 + photon * level + np.square(relative * level)).mean(axis=2) / measured.shape[2]
    expected = radiance.mean(axis=2)
    off = np.abs(measured.mean(axis=2) - expected)
    off[left_out] = np.nan
    sigmas = off / np.sqrt(variance)
    known = np.isfinite(sigmas)
    usual = np.full(sigmas.shape[1], np.inf)
    some = known.any(axis=0)
    usual[some] = np.maximum(np.nanmedian(sigmas[:, some], axis=0) / 0.6745, 1.0)
    found: NDArray[np.bool_] = known & (sigmas > _TIMES * usual) & (off > _SHARE * expected)
    return found


def tell_deviating(found: NDArray[np.bool_], names: Sequence[str]) -> Findings:
    """Say how many samples deviate, and of which photographs many do.

    Parameters
    ----------
    found : ndarray of shape (L, N), bool
        Of a sample of pixels.
    names : sequence of str, length L
        Of the photographs.
    """
    share, of_light = float(found.mean()), found.mean(axis=1)
    attributes = {"deviating": round(share, 6)}
    many = [
        f"{name} ({100 * part:.2g} %)" for name, part in zip(names, of_light, strict=True) if part > _MANY
    ]
    if share < _WORTH_TELLING and not many:
        return Findings(attributes)
    where = f", most in {', '.join(many)}" if many else ""
    return Findings(
        attributes,
        (
            f"{100 * share:.2g} % of the samples are far from the model and in no shadow{where}: dust, a "
            "hand, or the reflection of something else? --loss cauchy keeps them from pulling their pixels "
            "away, --exclude leaves a photograph out",
        ),
    )
