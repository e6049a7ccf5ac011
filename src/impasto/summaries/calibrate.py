"""What the subcommands of `calibrate` say when they are done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from impasto.geometry import zenith_azimuth
from impasto.summaries.words import Row, count, percent

if TYPE_CHECKING:
    from impasto.calibrate.lights import LightsCalibration
    from impasto.calibrate.oecf import Oecf


def lights_table(found: LightsCalibration) -> tuple[Row, list[Row]]:
    """Return header and rows: where each light stands, and how far the spheres disagree on it."""
    zenith, azimuth = (np.degrees(angle) for angle in zenith_azimuth(found.lights.direction))
    distance = np.linalg.norm(found.lights.position_mm, axis=1)
    rows: list[Row] = [
        (
            name,
            f"{zenith[row]:.1f}",
            f"{azimuth[row]:.1f}",
            f"{distance[row]:.0f} ± {found.position_sd_mm[row]:.0f}" if np.isfinite(distance[row]) else "far",
            f"{found.disagreement_deg[row]:.2f}" if np.isfinite(found.disagreement_deg[row]) else "",
            " ".join(f"{gain:.3f}" for gain in found.lights.intensity[row]),
        )
        for row, name in enumerate(found.names)
    ]
    return ("light", "zenith °", "azimuth °", "distance mm", "spheres differ °", "intensity"), rows


def lights_lines(found: LightsCalibration) -> Iterator[str]:
    """Yield what was found besides the table of the lights."""
    for number, sphere in enumerate(found.spheres, start=1):
        column, row, radius = sphere.circle
        how = "given" if np.isnan(sphere.residual_px) else f"outline within {sphere.residual_px:.2f} px"
        yield f"sphere {number}: column {column:.1f}, row {row:.1f}, radius {radius:.1f} px, {how}"
    if np.isfinite(found.disagreement_deg).any():
        yield f"the spheres differ by {np.nanmedian(found.disagreement_deg):.2f}° in the median"
    for name in found.doubtful:
        yield f"note: the spheres do not agree on {name}; look at spheres.png, and leave it out with --drop"
    if found.dropped:
        yield f"left out on request: {', '.join(found.dropped)}"
    yield from (f"note: {note}" for note in found.notes)
    yield f"{count(len(found.names), 'light')} in {found.folder}: check {found.folder / 'spheres.png'}"
    yield f"next: impasto stack PHOTOS STORE --lights {found.folder / 'lights.toml'}"


def oecf_lines(found: Oecf) -> Iterator[str]:
    """Yield how the camera responds, and how well that is known."""
    yield f"{count(found.patches, 'patch reading')} over {found.decades:.1f} decades of radiance"
    yield f"the function follows them within {percent(found.residual)} (root mean square)"
    yield f"a straight line would be off by up to {percent(found.nonlinearity)}"
    noise = found.noise
    yield (
        f"noise: variance = {noise['read']:.2g}² + {noise['photon']:.2g} · Y + ({noise['relative']:.2g} · Y)²"
    )
    for channel, (low, high) in enumerate(found.response.measured):
        top = found.response(found.response.measured.T)[1, channel]
        yield f"channel {channel + 1}: measured from code {low:.0f} to {high:.0f}, {top:.0%} of full scale"
    yield from (f"note: {note}" for note in found.notes)
    yield f"{found.file} is ready; look at {found.plot}"
    if not found.linear:
        yield f"next: impasto stack PHOTOS STORE --oecf {found.file}"
