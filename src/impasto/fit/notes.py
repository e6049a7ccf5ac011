"""What a joint fit says, in words, of what it found by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.fit.self_calibration import Calibration


def calibration_notes(found: Calibration) -> tuple[str, ...]:
    """Return what was found of strength, distance and direction of the lights."""
    departure = 100 * np.abs(np.exp(found.departure.mean(axis=1)) - 1)
    directions: tuple[str, ...] = ()
    if found.directions:
        error = found.directions["left_out_db"]
        turned = np.array(found.directions["turned_deg"])
        directions = (
            f"self-calibration: directions turned by {_rms(turned):.2f}° (rms), {turned.max():.1f}° at most, "
            f"meet lights left out to {error['corrected']:.2f} dB, the stated ones to {error['stated']:.2f} "
            f"dB: {'the turned ones are used' if found.directions['used'] else 'the stated ones stay'}",
        )
    return (
        *_distance_notes(found.distances),
        *directions,
        "self-calibration: the strengths of the lights depart from their trend over direction by "
        f"{_rms(departure):.1f} % (rms), {departure.max():.0f} % at most. The attribute "
        "self_calibration lists them; --no-self-calibrate takes the lights as stated",
    )


def sharing_notes(found: dict[str, Any]) -> tuple[str, ...]:
    """Return how far pixels rest on others of their paint; `found` are `Sharing.attributes`."""
    return (
        f"reflectance sharing: {100 * found['shown']:.0f} % of the pixels show how wide their highlight is; "
        "the others lean on those around them that have the same diffuse colour",
    )


def _distance_notes(found: dict[str, Any]) -> tuple[str, ...]:
    if not found:
        return ()
    if "left_out_db" not in found:
        return ("self-calibration: the lights are too far away for the photographs to tell their distance",)
    error, own = found["left_out_db"], found["own"]
    used = {
        "stated": "distant, as stated",
        "common": f"{found['common']:.2f} times the picture's longer side away",
        "own": f"{min(own):.2f} to {max(own):.2f} times the picture's longer side away",
    }[found["used"]]
    return (
        f"self-calibration: lights left out are met to {error['stated']:.2f} dB by distant ones, as stated, "
        f"to {error['common']:.2f} dB by lights at one distance, and to {error['own']:.2f} dB by lights at a "
        f"distance each: they are taken to be {used}",
    )


def residual_notes(found: dict[str, Any]) -> tuple[str, ...]:
    """Return what the residual term brings; `found` is the attribute ``residual`` of the fit."""
    error = found["left_out_db"]
    strength = (
        "residual: neighbouring lights tell how strong the lamp was around a direction. Renderings are under "
        "lights as strong as stated, and follow the lamp with render --as-photographed",
    )
    return (
        f"residual: lights left out one by one are met to {error['with_residual']:.1f} dB instead of the "
        f"model's {error['model']:.1f} dB, with length {found['length']:.2g} and noise {found['noise']:.2g}; "
        f"{found['components']} components keep {100 * found['kept']:.1f} % of it. Outside the hull of the "
        "lights it fades to nothing",
        *(strength if "strength" in found else ()),
    )


def _rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.square(values).mean()))
