"""How strong the lights of the photographs were, as far as a fit tells it to lights between.

docs/store.md specifies the numbers; how they are found says `impasto.fit.strength`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from impasto.geometry import Lights
from impasto.residual import ResidualTerm, told


def as_photographed(attributes: Mapping[str, Any], lights: Lights) -> Lights:
    """Make lights as strong as a lamp held by hand was around them.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    lights : Lights

    Returns
    -------
    Lights
        As they are, where the fit does not tell how strong the lights around a direction were. Beyond the
        hull of the lights that were fitted strengths fade to those stated, as the residual term does.
    """
    term = ResidualTerm.of(attributes)
    found = attributes["residual"].get("strength") if term else None
    if term is None or found is None:
        return lights
    logarithm = told(found, lights.direction, term.direction) * term.share(lights.direction)[:, None]
    return replace(lights, intensity=lights.intensity * np.exp(logarithm))
