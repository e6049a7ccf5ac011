"""From radiance to what a display is sent: camera colour, exposure, adaptation, highlights, display.

What a display cannot show is moved to what it can by a stated rule, and counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from impasto.colour.adaptation import Adaptation, adaptation_matrix
from impasto.colour.camera import CameraColour, camera_colour, colour_terms
from impasto.colour.displays import Display, SrgbCurves, srgb_display
from impasto.colour.profiles import profile

HighlightRule = Literal["clip", "shoulder"]
HIGHLIGHT_RULES: tuple[str, ...] = get_args(HighlightRule)

SHOULDER_START = 0.8
"""Share of the display's white from which on the soft shoulder compresses."""

# Clipped samples may be infinite, which a matrix would turn into NaN.
_BRIGHTEST = 1e6


@dataclass(frozen=True)
class Shown:
    """A picture as a display is sent it, and where it is not what it should be.

    Parameters
    ----------
    drive : ndarray of shape (H, W, C), float32
        0 to 1.
    too_bright : ndarray of shape (H, W), bool
        Brighter than the display's white in a primary at least, before the rule for highlights.
    outside : ndarray of shape (H, W), bool
        Not too bright, but outside the display's gamut; shown in the nearest colour it can make.
    missing : ndarray of shape (H, W), bool
        Without a value; shown black.
    """

    drive: NDArray[np.float32]
    too_bright: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    missing: NDArray[np.bool_]


class Rendition:
    """How radiance is shown on a display.

    Parameters
    ----------
    display : Display, optional
        sRGB by default.
    camera : CameraColour, optional
        What the radiance means; without one, its channels are taken for sRGB's.
    channels : int
        Of the radiance: 3, or 1, which is shown grey.
    exposure : float
        Factor on the radiance; 1 shows relative radiance 1 as the display's white.
    white_xyz : ndarray of shape (3,), optional
        XYZ of what is shown in the colour of the display's white; by default, `camera.white_xyz`.
    adaptation : {'cat16', 'bradford'}
        How colours follow from that white to the display's.
    highlights : {'clip', 'shoulder'}
        What happens to colours brighter than the display's white: each primary is cut at its full light; or
        the pixel's brightest primary is compressed smoothly from 0.8 on, never to reach 1, and the others in
        the same proportion, which keeps the hue.

    Attributes
    ----------
    display : Display
    camera : CameraColour
    white_xy : (float, float)
        CIE xy of what is shown in the colour of the display's white.
    channels : int
        Of the pictures: 1 where grey radiance is shown with sRGB's curve, else 3.
    profile : bytes
        The ICC profile that the pictures carry.
    matrix : ndarray of shape (3, K) or None
        From the terms of the radiance, times the exposure, to the light of each primary; None where these
        are the same.
    """

    def __init__(
        self,
        display: Display | None = None,
        *,
        camera: CameraColour | None = None,
        channels: int = 3,
        exposure: float = 1.0,
        white_xyz: NDArray[np.float64] | None = None,
        adaptation: Adaptation = "cat16",
        highlights: HighlightRule = "clip",
    ) -> None:
        self.display = srgb_display() if display is None else display
        self.camera = camera or camera_colour(None)
        white = self.camera.white_xyz if white_xyz is None else white_xyz
        self.white_xy = (float(white[0] / white.sum()), float(white[1] / white.sum()))
        self._highlights = highlights
        self._exposure = np.float32(exposure)
        curves = getattr(self.display, "curves", None)
        self.channels = 1 if channels == 1 and isinstance(curves, SrgbCurves) else 3
        self.profile = profile("srgb", grey=True) if self.channels == 1 else self.display.profile
        self.matrix: NDArray[np.float32] | None = None
        self._black = np.zeros(self.channels, np.float32)
        if self.channels == 3:
            shown_white = self.display.matrix.sum(axis=1) + self.display.black
            to_xyz = self.camera.white_xyz[:, np.newaxis] if channels == 1 else self.camera.matrix
            matrix = np.linalg.solve(
                self.display.matrix, adaptation_matrix(white, shown_white, adaptation) @ to_xyz
            )
            self._black = np.linalg.solve(self.display.matrix, self.display.black).astype(np.float32)
            unity = matrix.shape == (3, 3) and np.allclose(matrix, np.eye(3), rtol=0, atol=1e-9)
            if not unity or self._black.any():
                self.matrix = matrix.astype(np.float32)

    def __call__(self, radiance: NDArray[np.float32]) -> Shown:
        """Return the picture of radiance of shape (H, W, C)."""
        linear = np.minimum(radiance * self._exposure, np.float32(_BRIGHTEST))
        if self.matrix is not None:
            linear = colour_terms(linear, self.matrix.shape[1]) @ self.matrix.T - self._black
        peak = linear[..., 0]
        for primary in range(1, linear.shape[-1]):
            peak = np.maximum(peak, linear[..., primary])
        missing = np.isnan(peak)
        linear = self._within_white(np.where(missing[..., np.newaxis], np.float32(0), linear), peak)
        drive = self.display.encode(linear)
        too_bright = peak > 1
        outside = self.display.outside(linear, drive, ~(too_bright | missing))
        return Shown(drive, too_bright, outside, missing)

    def _within_white(self, linear: NDArray[np.float32], peak: NDArray[np.float32]) -> NDArray[np.float32]:
        if self._highlights == "clip":
            return np.minimum(linear, np.float32(1))
        room = np.float32(1 - SHOULDER_START)
        over = np.maximum(peak - np.float32(SHOULDER_START), 0)
        compressed = np.float32(SHOULDER_START) + room * (1 - np.exp(-over / room))
        factor = np.where(over > 0, compressed / np.where(over > 0, peak, 1), 1)
        return np.asarray(linear * factor[..., np.newaxis], dtype=np.float32)
