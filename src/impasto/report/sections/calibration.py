"""How the camera's numbers became relative radiance, and what was not calibrated."""

from __future__ import annotations

from collections.abc import Iterator

from impasto.page import Section
from impasto.report.subject import Subject
from impasto.store import ASSUMED_WHITE


def section(subject: Subject) -> Section:
    """Return what is known of response, scale, noise and colour; what is not known is said too."""
    page = Section("What was calibrated")
    page.table((), list(_facts(subject)), caption="From stored values to relative radiance", words=True)
    return page


def _facts(subject: Subject) -> Iterator[tuple[str, str]]:
    stack = subject.stack
    transfers = sorted({str(entry["transfer"]) for entry in stack.attributes["inputs"]})
    yield "response", ", ".join(transfers)
    if stack.absolute:
        yield "scale", "relative radiance 1 is a perfect white diffuser lit along its normal"
    else:
        yield "scale", "not calibrated to a white reference"
    levels = ", ".join("none" if level == float("inf") else f"{level:.4g}" for level in stack.clip_level)
    yield "clipped from", f"{levels} (relative radiance, per channel)"
    read, photon, relative = stack.noise
    yield "noise of a sample Y", f"variance {read:.3g}² + {photon:.3g} Y + ({relative:.3g} Y)²"
    rgb = ", ".join(f"{value:.3f}" for value in stack.light_rgb)
    source = stack.light_rgb_source
    known = "not known, assumed white" if source == ASSUMED_WHITE else f"{rgb} ({source})"
    yield "colour of the light", known
    colour = stack.attributes.get("camera_colour")
    yield (
        "camera's colours",
        str(colour["source"]) if colour else "not calibrated: shown as if they were sRGB",
    )
