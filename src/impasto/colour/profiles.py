"""ICC profiles that pictures carry, of three primaries with a tone curve each."""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.colour.adaptation import WHITE_POINTS
from impasto.colour.primaries import SRGB
from impasto.colour.transfer import decode_srgb

ProfileName = Literal["srgb", "linear"]

# An ICC profile says when it was made; a fixed date keeps equal pictures equal byte for byte.
_DATE = np.array([2000, 1, 1, 0, 0, 0], dtype=">u2").tobytes()
_CURVE_SAMPLES = 4096


@cache
def profile(name: ProfileName, grey: bool = False) -> bytes:
    """Return an ICC profile with sRGB's primaries and white.

    Parameters
    ----------
    name : {'srgb', 'linear'}
        The tone curve: sRGB's, or a straight line.
    grey : bool
        Whether the profile is for pictures of one channel.
    """
    if name == "srgb" and not grey:
        return _made("srgb")
    curve: dict[str, Any] = {"gamma": 1.0} if name == "linear" else {"transferfunction": srgb_curve()}
    if grey:
        # The white of a grey profile is that of the connection space, D50, or it would be adapted twice.
        return _made("gray", whitepoint=WHITE_POINTS["D50"], **curve)
    return _made("rgb", whitepoint=WHITE_POINTS["D65"], primaries=tuple(np.ravel(SRGB)), **curve)


def display_profile(primaries: ArrayLike, white_xy: tuple[float, float], curves: NDArray[np.uint16]) -> bytes:
    """Return the ICC profile of a display without stray light.

    Parameters
    ----------
    primaries : array_like of shape (3, 2)
        CIE xy of red, green and blue.
    white_xy : (float, float)
        CIE xy of the white.
    curves : ndarray of shape (N,) or (3, N), uint16
        Light for evenly spaced drive values, one curve for all channels or one each; 65535 is white.
    """
    flat = tuple(float(value) for value in np.ravel(primaries))
    return _made("rgb", whitepoint=white_xy, primaries=flat, transferfunction=curves)


def srgb_curve() -> NDArray[np.uint16]:
    """Return sRGB's tone curve as `display_profile` takes it."""
    return sampled_curve(decode_srgb(drive_samples()))


def drive_samples() -> NDArray[np.float64]:
    """Return the drive values, 0 to 1, at which a tone curve is sampled for a profile."""
    return np.linspace(0, 1, _CURVE_SAMPLES)


def sampled_curve(linear: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return light at `drive_samples`, 0 to 1, as `display_profile` takes it."""
    return np.rint(np.clip(linear, 0, 1) * 65535).astype(np.uint16)


def _made(kind: str, **options: Any) -> bytes:
    import imagecodecs

    made = imagecodecs.cms_profile(kind, **options)
    return bytes(made[:24] + _DATE + made[36:])
