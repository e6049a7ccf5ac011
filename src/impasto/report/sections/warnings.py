"""What a reader has to bear in mind before believing the rest."""

from __future__ import annotations

from collections.abc import Iterator

from impasto.arm import find_arm
from impasto.page import Section
from impasto.report.subject import Subject
from impasto.store import STATUS_MEANING
from impasto.summaries.words import count, percent

_CLIPPED_SHARE = 0.01
_TROUBLED_SHARE = 0.05
_FEW_LIGHTS = 12
_HARMLESS = STATUS_MEANING[0]


def section(subject: Subject) -> Section | None:
    """Return the warnings of all stages, and those that follow from what is in the store."""
    found = [*_found(subject), *subject.stack.attributes.get("notes", ())]
    for model, fit in subject.fits.items():
        found += [f"{model}: {note}" for note in fit.attributes.get("notes", ())]
    if not found:
        return None
    page = Section("What to bear in mind")
    page.notes("Assumed, left out or not known", list(dict.fromkeys(found)))
    return page


def _found(subject: Subject) -> Iterator[str]:
    stack = subject.stack
    lights, height, width, channels = stack.shape
    if not stack.absolute:
        yield (
            "no white reference: relative radiance is in shares of the capture's own scale, so diffuse "
            "magnitudes are no albedos and gloss is relative"
        )
    if lights < _FEW_LIGHTS:
        yield f"{count(lights, 'photograph')} are few: highlights between the lights are not seen"
    clipped = stack.clipped_samples / (lights * height * width * channels)
    if clipped > _CLIPPED_SHARE:
        yield (
            f"{percent(clipped)} of the samples are clipped; they entered no fit, and the highlights there "
            "may be higher than the maps say"
        )
    if find_arm(stack.lights.direction).planar:
        yield "the lights lie in one plane: normals out of that plane are known less well than in it"
    for model, fit in subject.fits.items():
        pixels = fit.attributes["pixels"]
        for status, number in pixels.items():
            share = number / max(sum(pixels.values()), 1)
            if status != _HARMLESS and share > _TROUBLED_SHARE:
                yield f"{model}: {percent(share)} of the pixels ended with the status “{status}”"
