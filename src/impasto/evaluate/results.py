"""The errors of models by held-out light, and how several rounds of fits are taken together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from impasto.evaluate.baselines import BaselineErrors
from impasto.evaluate.errors import ImageErrors, mean_errors
from impasto.evaluate.shares import ErrorShares


@dataclass(frozen=True)
class LightErrors:
    """The errors under one light.

    Parameters
    ----------
    name : str
        The photograph's name.
    zenith_deg, azimuth_deg : float
        Where the light stood.
    errors : ImageErrors
        How far the rendering is from the photograph.
    """

    name: str
    zenith_deg: float
    azimuth_deg: float
    errors: ImageErrors


@dataclass(frozen=True)
class ModelErrors:
    """The errors of one model.

    Parameters
    ----------
    model : str
        The model's name.
    procedure : str
        How it was fitted.
    refitted : bool
        Whether it was fitted anew without the held-out photographs; false where the fit in the store had not
        seen them anyway.
    lights : tuple of LightErrors
        One entry per held-out photograph.
    mean : ImageErrors
        The mean over them.
    without_residual : ImageErrors or None
        The mean of the model alone, where the fit describes what it leaves over too.
    as_photographed : ImageErrors or None
        The mean under lights as strong as a lamp held by hand was around them, where the fit tells it; all
        else is under lights as strong as stated.
    shares : ErrorShares or None
        Whose the error is, of the model alone; None by the paper's procedure.
    """

    model: str
    procedure: str
    refitted: bool
    lights: tuple[LightErrors, ...]
    mean: ImageErrors
    without_residual: ImageErrors | None = None
    as_photographed: ImageErrors | None = None
    shares: ErrorShares | None = None


def join_models(found: Sequence[ModelErrors]) -> ModelErrors:
    """Return the errors of one model over all rounds, each with other photographs held out."""
    lights = tuple(entry for part in found for entry in part.lights)
    alone = [part.without_residual for part in found]
    # A round that tells no strengths renders under lights as strong as stated.
    strong = [part.as_photographed or part.mean for part in found]
    weights = [len(part.lights) for part in found]
    return replace(
        found[0],
        refitted=any(part.refitted for part in found),
        lights=lights,
        mean=mean_errors([entry.errors for entry in lights]),
        without_residual=_weighted([entry for entry in alone if entry is not None], weights)
        if all(entry is not None for entry in alone)
        else None,
        as_photographed=_weighted(strong, weights) if any(part.as_photographed for part in found) else None,
        shares=_join_shares([part.shares for part in found if part.shares is not None]),
    )


def join_baselines(found: Sequence[Sequence[BaselineErrors]]) -> tuple[BaselineErrors, ...]:
    """Return the errors of each method over all rounds; methods that some round lacked are left out."""
    by_name = [{entry.method: entry for entry in part} for part in found]
    joined = []
    for first in found[0]:
        if not all(first.method in part for part in by_name):
            continue
        parts = [part[first.method] for part in by_name]
        lights = tuple(entry for part in parts for entry in part.lights)
        scale = " or ".join(sorted({part.scale for part in parts}))
        count = max(part.coefficients for part in parts)
        joined.append(BaselineErrors(first.method, count, scale, lights, mean_errors(lights)))
    return tuple(joined)


def _weighted(means: Sequence[ImageErrors], weights: Sequence[int]) -> ImageErrors:
    return mean_errors([mean for mean, weight in zip(means, weights, strict=True) for _ in range(weight)])


def _join_shares(found: Sequence[ErrorShares]) -> ErrorShares | None:
    """Return the shares of the squared error of all rounds together, which add to 1 as those of each do."""
    if not found:
        return None
    squared = np.array([part.samples * part.rms**2 for part in found])
    total = float(squared.sum())
    samples = sum(part.samples for part in found)
    # Without any error all shares are the same: what is known of it is noise.
    weights = squared if total else np.ones_like(squared)
    shares = {
        source: float(np.average([getattr(part, source) for part in found], weights=weights))
        for source in ("model", "lights", "shadows", "noise", "sampling")
    }
    return ErrorShares(
        **shares,
        photographs=sum(part.photographs for part in found),
        pixels=max(part.pixels for part in found),
        samples=samples,
        shadowed=float(np.mean([part.shadowed for part in found])),
        rms=float(np.sqrt(total / max(samples, 1))),
    )
