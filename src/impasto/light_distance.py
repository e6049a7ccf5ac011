"""At what distance a fit found the lights of its photographs, and renderings their lights.

docs/store.md specifies the numbers; how they are found says `impasto.fit.light_distances`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from impasto.geometry import Array, Camera, Lights
from impasto.residual import told


def place_lights(
    attributes: Mapping[str, Any], size: tuple[int, int], lights: Lights, camera: Camera
) -> tuple[Lights, Camera]:
    """Put distant lights where a fit found those of the photographs, if it found them near.

    Parameters
    ----------
    attributes : mapping
        Of the fit.
    size : tuple of int
        Height and width of the painting in pixels.
    lights : Lights
    camera : Camera

    Returns
    -------
    Lights, Camera
        Lights that have a position keep it. Where nothing is known of the camera's scale, lengths are in
        pixels from here on.
    """
    found = _found(attributes)
    if found is None:
        return lights, camera
    scale = camera.mm_per_px or 1.0
    distance = _distance(found, lights.direction) * max(size) * scale
    stated = np.isfinite(lights.position_mm)
    position = np.where(stated, lights.position_mm, lights.direction * distance[:, None])
    return replace(lights, position_mm=position), replace(camera, mm_per_px=scale)


def without_distance(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes of a fit with which lights that are stated as distant are rendered so."""
    calibration = {**attributes.get("self_calibration", {}), "distances": {}}
    return {**attributes, "self_calibration": calibration}


def only_told(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return those attributes of a fit that say where its renderings put distant lights, if it says so."""
    told = _found(attributes)
    return {} if told is None else {"self_calibration": {"distances": {"told": dict(told)}}}


def _found(attributes: Mapping[str, Any]) -> Mapping[str, Any] | None:
    told = attributes.get("self_calibration", {}).get("distances", {}).get("told")
    return told if isinstance(told, Mapping) else None


def _distance(found: Mapping[str, Any], direction: Array) -> Array:
    """Return the distances (L,) of lights in directions (L, 3), over the longer side of the painting."""
    logarithm = np.full(len(direction), np.log(found["distance"]))
    if "table" in found or "weights" in found:
        logarithm += told(found, direction, found.get("direction", []))[:, 0]
    result: Array = np.exp(logarithm)
    return result
