"""What `render` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count, percent

if TYPE_CHECKING:
    from impasto.render import RenderSummary


def render_lines(summary: RenderSummary) -> Iterator[str]:
    """Yield what `render` wrote, and what the display pictures cannot show."""
    kinds = " and ".join(sorted({path.suffix[1:].upper() for path in summary.files} - {"WEBP"}))
    yield f"{count(len(summary.lights), 'rendering')} of {summary.model} in {summary.out} as {kinds}"
    if summary.animation:
        yield f"animated (8 bits): {summary.animation}"
    if any(path.suffix != ".exr" for path in summary.files):
        x, y = summary.white_xy
        yield (
            f"shown on {summary.display} at exposure {summary.exposure:g}, white x {x:.4f} y {y:.4f} adapted "
            f"by {summary.adaptation}; camera colour: {summary.camera_colour}"
        )
    if summary.lamp_untold:
        yield "the fit does not tell how strong the lamp was: the lights are as strong as stated"
    if summary.too_bright > 0:
        rule = "cut" if summary.highlights == "clip" else "compressed by a soft shoulder"
        yield (
            f"brighter than the display's white: up to {percent(summary.too_bright)} of a picture's pixels, "
            f"{rule}; the EXR files hold them"
        )
    if summary.out_of_gamut > 0:
        yield (
            f"outside the display's gamut: up to {percent(summary.out_of_gamut)} of a picture's pixels, cut "
            "to its edge"
        )
    if summary.missing_pixels:
        yield f"{count(summary.missing_pixels, 'pixel')} without a fit: missing in EXR, black on display"
    if summary.matte_pixels:
        yield f"{count(summary.matte_pixels, 'pixel')} without an identified highlight: rendered matte"
