"""What the desk shows: how far the capture is, and the photograph just taken."""

from __future__ import annotations

import io
from collections.abc import Collection, Sequence

import numpy as np

from impasto.colour.transfer import encode_srgb, quantise
from impasto.stand.checks.finding import Finding
from impasto.stand.desk import Desk
from impasto.stand.look import Look
from impasto.stand.steps import Shot

_QUALITY = 85
_CLIPPED_RGBA = (255, 0, 60, 190)


def show_progress(
    desk: Desk, shots: Sequence[Shot], kept: Collection[str], now: Shot | None, again: Collection[str]
) -> None:
    """Show what is done, what is being done, what comes next and what is to be taken again."""
    left = [shot for shot in shots if shot.name not in kept]
    after = [shot for shot in left if now is None or shot.name != now.name]
    desk.show(
        total=len(shots),
        done=len(shots) - len(left),
        now=None if now is None else {"name": now.name, "label": now.label},
        next=[{"name": shot.name, "label": shot.label} for shot in after[:4]],
        again=[f"{shot.name}: {shot.label}" for shot in left if shot.name in again],
    )


def show_photograph(desk: Desk, shot: Shot, look: Look, findings: Sequence[Finding]) -> None:
    """Show a photograph with its histogram, what is clipped in it, and what is wrong with it."""
    pictures = {"photograph.jpg": _jpeg(look), "clipped.png": _overlay(look)}
    desk.show(
        photograph={
            "name": shot.name,
            "label": shot.label,
            "clipped": look.clipped,
            "bright": look.bright,
            "histogram": look.histogram.tolist(),
            "findings": [{"check": each.check, "what": each.what, "do": each.do} for each in findings],
        }
    )
    desk.show_pictures(pictures)


def _jpeg(look: Look) -> bytes:
    import imagecodecs

    # For looking only: encoded as sRGB, whatever the camera's colours are.
    codes = quantise(encode_srgb(look.reduced))
    return bytes(imagecodecs.jpeg8_encode(codes[..., 0] if codes.shape[2] == 1 else codes, level=_QUALITY))


def _overlay(look: Look) -> bytes:
    """Return a picture that is transparent but where samples are clipped."""
    from PIL import Image

    overlay = np.zeros((*look.reduced_clipped.shape, 4), np.uint8)
    overlay[look.reduced_clipped] = _CLIPPED_RGBA
    data = io.BytesIO()
    Image.fromarray(overlay, "RGBA").save(data, "PNG")
    return data.getvalue()
