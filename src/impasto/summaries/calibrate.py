"""What the subcommands of `calibrate` say when they are done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from impasto.geometry import zenith_azimuth
from impasto.summaries.words import Row, count, percent

if TYPE_CHECKING:
    from impasto.calibrate.colour import Colour
    from impasto.calibrate.dark import Dark
    from impasto.calibrate.display import DisplayCalibration
    from impasto.calibrate.flat import Flat
    from impasto.calibrate.glare import Glare
    from impasto.calibrate.lights import LightsCalibration
    from impasto.calibrate.oecf import Oecf
    from impasto.calibrate.steadiness import Steadiness
    from impasto.calibrate.target import Target
    from impasto.calibrate.white import White


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


def dark_lines(found: Dark) -> Iterator[str]:
    """Yield what the camera reads without light."""
    level = ", ".join(percent(value) for value in found.level)
    yield f"without light the camera reads {level} of full scale, with noise of {percent(found.noise)}"
    yield f"{count(found.hot, 'hot pixel')}"
    yield f"{found.file} is ready"


def flat_lines(found: Flat) -> Iterator[str]:
    """Yield how uneven light and lens are, and what is left of it."""
    cards = f"{len(found.names)} lights" if found.names else "all lights, from one card"
    yield f"flat field of {cards}: up to {percent(found.before)} off the middle of the frame"
    yield f"left after correction: {percent(found.after)} (root mean square, largest of all channels)"
    if found.fall_off:
        yield "the fall-off of the lights at known positions is taken out: a fit accounts for it"
    yield from (f"note: {note}" for note in found.notes)
    yield f"{found.file} is ready; next: impasto stack PHOTOS STORE --flat {found.file}"


def white_lines(found: White) -> Iterator[str]:
    """Yield what a perfect white diffuser reads."""
    level = ", ".join(f"{value:.4f}" for value in found.radiance)
    yield f"a perfect white diffuser reads {level} of full scale under a light of intensity 1"
    rgb = ", ".join(f"{value:.3f}" for value in found.light_rgb)
    yield f"the light's colour in the camera's space: {rgb}"
    if found.lights > 1:
        yield f"{count(found.lights, 'light')} agree within {percent(found.spread)} (standard deviation)"
    yield f"{found.file} is ready; next: impasto stack PHOTOS STORE --white {found.file}"


def colour_table(found: Colour) -> tuple[Row, list[Row]]:
    """Return header and rows: the errors of each method."""
    rows: list[Row] = [
        (
            name,
            f"{fit.difference.mean():.2f}",
            f"{np.percentile(fit.difference, 95):.2f}",
            f"{fit.left_out.mean():.2f}",
            f"{np.percentile(fit.left_out, 95):.2f}",
        )
        for name, fit in found.fits.items()
    ]
    return ("CIEDE2000", "mean", "95th percentile", "mean, left out", "95th, left out"), rows


def colour_lines(found: Colour) -> Iterator[str]:
    """Yield which method is taken, and the worst patch."""
    fit = found.fits[found.chosen]
    worst = int(np.argmax(fit.difference))
    yield f"taken: {found.chosen}; worst patch {found.names[worst]}, {fit.difference[worst]:.2f}"
    yield f"{found.file} is ready; next: impasto stack PHOTOS STORE --colour {found.file}"


def target_lines(found: Target) -> Iterator[str]:
    """Yield what was found of a target, where to check it, and what takes the table."""
    seen = f"{found.name}: outlines of {found.seen} of {found.total} patches seen"
    if found.difference is not None:
        seen += f"; colours within {found.difference:.1f} CIELAB in the mean, after the best matrix"
    yield seen
    yield f"check the outlines in {found.picture}; correct boxes in {found.file} if they are off"
    if found.next_step is None:
        yield f"note: {found.file} does not say what is known: add a column density or reflectance"
    step = found.next_step or "oecf"
    yield f"{found.file} is ready; next: impasto calibrate {step} PHOTO {found.file} {step}.json --card PHOTO"


def display_lines(found: DisplayCalibration) -> Iterator[str]:
    """Yield how well the display is described."""
    difference = found.difference
    yield (
        f"{found.model}: CIEDE2000 mean {difference.mean():.2f}, 95th percentile "
        f"{np.percentile(difference, 95):.2f}, largest {difference.max():.2f} over {len(difference)} colours"
    )
    yield f"{found.file} is ready; next: impasto render … --display {found.file}"


def steadiness_lines(found: Steadiness) -> Iterator[str]:
    """Yield by how much the photographs are shifted, and which ones moved."""
    off = np.hypot(*found.shift_px.T)
    if np.isfinite(off).any():
        yield (
            f"{count(len(found.names), 'photograph')}: shifted by {np.nanmedian(off):.2f} px in the median, "
            f"known within about {np.nanmedian(found.uncertainty_px):.2f} px"
        )
        yield f"largest shift: {np.nanmax(off):.2f} px, {found.names[int(np.nanargmax(off))]}"
    if found.bumped:
        yield f"note: the camera was bumped before {found.bumped}: all from there on lie elsewhere"
    elif found.moved:
        yield f"note: shifted by more than half a pixel: {', '.join(found.moved)}"
    if found.turned:
        named = ", ".join(f"{name} ({moved:.1f} px in the corners)" for name, moved in found.turned.items())
        yield f"note: turned or scaled, which is not corrected: {named}"
    if found.unknown:
        named = ", ".join(found.unknown)
        yield f"note: shift not known, too little in common with the others or too far off: {named}"
    yield f"{found.file} is ready"
    if found.corrected:
        back = count(len(found.corrected), "photograph")
        yield f"to shift {back} back: impasto stack PHOTOS STORE --steadiness {found.file}"


def glare_lines(found: Glare) -> Iterator[str]:
    """Yield how much stray light there is."""
    share = ", ".join(percent(max(value, 0.0)) for value in found.share)
    yield f"stray light in the black trap: {share} of the bright surround, per channel"
    if found.much:
        yield "note: that lifts dark paints; clean the lens, shade it, and mask what is bright and not needed"
