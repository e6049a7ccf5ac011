"""Are the highlights covered well enough? A coarse fit while the capture grows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.angles.highlights import highlight_widths_deg
from impasto.angles.identifiability import identify
from impasto.angles.photographed import camera_for
from impasto.angles.surfaces import USUAL_NOISE
from impasto.fit import fit_tile
from impasto.geometry import Camera, Lights
from impasto.models import parse_model
from impasto.pixels import pixels_of_maps
from impasto.stack.brackets import merge
from impasto.stand.look import Look
from impasto.store import STATUS_MEANING

LEAST_LIGHTS = 8
_MODEL = "torrance-sparrow"
_USABLE = {"converged", "at a bound", "step limit"}


@dataclass(frozen=True)
class Coverage:
    """What a coarse fit says of the highlights.

    Parameters
    ----------
    lights : int
        So many it was made from.
    pixels : int
        Coarse pixels with a highlight that could be fitted.
    narrowest_deg : float
        Width of the narrowest highlights (5th percentile), full width at half height, in angles of the light.
    gap_deg : float
        Highlights narrower than this fall between the lights.
    seen : float
        Share of the pixels with a light in the upper half of their highlight.
    sentences : tuple of str
        What the lights do not tell.
    """

    lights: int
    pixels: int
    narrowest_deg: float
    gap_deg: float
    seen: float
    sentences: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Whether the narrowest highlights meet a light wherever they lie."""
        return self.narrowest_deg >= self.gap_deg


def coverage(radiance: NDArray[np.float32], lights: Lights, camera: Camera) -> Coverage | None:
    """Fit a coarse picture of the painting, and say whether its highlights meet enough lights.

    Parameters
    ----------
    radiance : ndarray of shape (L, N, C), float32
        Relative radiance of N coarse pixels, NaN where it is not known; see `coarse_radiance`.
    lights : Lights
    camera : Camera

    Returns
    -------
    Coverage or None
        None for fewer than eight lights, or where no pixel has a highlight.
    """
    if len(lights) < LEAST_LIGHTS:
        return None
    model = parse_model(_MODEL)
    count, channels = radiance.shape[1:]
    in_plane = camera_for(lights, camera)
    maps = fit_tile(
        model,
        radiance,
        lights=lights,
        camera=in_plane,
        light_rgb=np.ones(channels),
        clip_level=np.full(channels, np.inf),
        noise=USUAL_NOISE,
    )
    usable = np.array([STATUS_MEANING[int(status)] in _USABLE for status in maps["status"]])
    usable &= np.isfinite(maps["c"].reshape(count, -1)).all(axis=1)
    usable &= np.isfinite(maps["normal"]).all(axis=1) & (maps["specular"].reshape(count) > 0)
    if not usable.any():
        return None
    kept = {name: values[usable] for name, values in maps.items() if len(values) == count}
    attributes = {
        "model": _MODEL,
        "light_rgb": [1.0] * channels,
        "index_of_refraction": 1.5,
        "fresnel": "facet",
    }
    places = np.flatnonzero(usable)
    pixels = pixels_of_maps(attributes, (1, count), np.zeros_like(places), places, kept)
    found = identify(pixels, lights, camera, USUAL_NOISE)
    narrowest, *_ = highlight_widths_deg(pixels, in_plane.view_direction)
    seen = sum(kind.seen for kind in found.kinds) / len(found.kinds)
    return Coverage(len(lights), len(places), narrowest, found.gap_deg, float(seen), found.sentences)


def coarse_radiance(exposures: Sequence[Sequence[tuple[Look, float]]]) -> NDArray[np.float32]:
    """Return the radiance of coarse pixels, merged over the exposures of each light.

    Parameters
    ----------
    exposures : sequence of sequence of (Look, float)
        Per light its photographs, `thinned`, with their exposure times.

    Returns
    -------
    ndarray of shape (L, N, C), float32
        For the exposure of the first photograph; NaN where all are clipped.
    """
    read, photon, _ = USUAL_NOISE
    first = exposures[0][0][1]
    merged = [
        merge([look.reduced for look, _ in light], [time / first for _, time in light], read, photon)
        for light in exposures
    ]
    stacked = np.stack(merged).astype(np.float32)
    stacked[~np.isfinite(stacked)] = np.nan
    return stacked.reshape(len(stacked), -1, stacked.shape[-1])
