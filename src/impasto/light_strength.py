"""How strong the lights of the photographs were, as a fit found it and tells it to lights between.

docs/store.md specifies the numbers; how they are found says `impasto.fit.strength`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from impasto.geometry import Lights
from impasto.residual import ResidualTerm, told


def scale_lights(attributes: Mapping[str, Any], lights: Lights) -> Lights:
    """Make lights as strong as the lamp of the photographs was around them, if a fit tells it.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    lights : Lights

    Returns
    -------
    Lights
        With intensities times exp(w(l) g(l)), g being the logarithm told for a light's direction l and w the
        share of the residual term that is left there: beyond the hull of the fitted lights strengths fade to
        those stated. `lights` itself, where the fit does not tell strengths.
    """
    term = ResidualTerm.of(attributes)
    if term is None or not (found := attributes["residual"].get("strength")):
        return lights
    logarithm = told(found, lights.direction, term.direction) * term.share(lights.direction)[:, None]
    return replace(lights, intensity=lights.intensity * np.exp(logarithm))


def scale_photographed(attributes: Mapping[str, Any], lights: Lights) -> Lights:
    """Make the lights of a stack as strong as a fit found them, and those that it left out as it tells them.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    lights : Lights
        All of the stack, as stated.

    Returns
    -------
    Lights
        Under them, renderings are as bright as the photographs, but for a trend over direction that may be
        the painting's.
    """
    told = scale_lights(attributes, lights)
    found = attributes.get("self_calibration")
    if found is None:
        return told
    strength = np.array(found["gain"]) / np.array(found["trend"])
    seen = [name not in attributes["options"]["exclude"] for name in lights.names]
    intensity = np.array(np.broadcast_to(told.intensity, (len(lights), strength.shape[1])))
    intensity[seen] = lights.intensity[seen] * strength
    return replace(lights, intensity=intensity)
