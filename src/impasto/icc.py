"""Read the tone curves, the name and the kind of an ICC profile.

Only what linearisation and display need: profiles of the matrix/TRC and grey kinds hold one curve per channel
from device value to linear light [ICC.1:2022]_. Profiles that hold look-up tables mix the channels; no curves
are read from them, because a table per channel cannot stand for them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]

_HEADER_BYTES = 128
_CURVE_TAGS = {"GRAY": (b"kTRC",), "RGB": (b"rTRC", b"gTRC", b"bTRC")}
# Number of s15Fixed16 parameters of each function type of parametricCurveType.
_PARAMETER_COUNT = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}


def description(profile: bytes) -> str:
    """Return the profile's own name, such as ``sRGB IEC61966-2.1``; ``unnamed`` where it has none.

    Raises
    ------
    ValueError
        If the bytes are not an ICC profile.
    """
    tag = _tags(profile).get(b"desc", b"")
    text = ""
    if tag[:4] == b"desc" and len(tag) >= 12:  # profile versions up to 2.4
        (length,) = struct.unpack_from(">I", tag, 8)
        text = tag[12 : 12 + length].split(b"\0")[0].decode("latin-1")
    elif tag[:4] == b"mluc" and len(tag) >= 28:  # version 4: the first translation is the default
        length, offset = struct.unpack_from(">II", tag, 20)
        text = tag[offset : offset + length].decode("utf-16-be", errors="replace")
    return text.strip("\0 ") or "unnamed"


def colour_space(profile: bytes) -> str:
    """Return the colours that a profile describes, such as ``RGB``, ``GRAY`` or ``CMYK``."""
    return profile[16:20].decode("latin-1").strip()


def has_tables(profile: bytes) -> bool:
    """Tell whether a profile describes its device by look-up tables instead of a matrix and tone curves."""
    return any(name.startswith(b"A2B") or name.startswith(b"B2A") for name in _tags(profile))


def numbers(profile: bytes, tag: str) -> Array | None:
    """Return the numbers of a tag such as ``wtpt`` or ``chad``, None where the profile has no such tag."""
    data = _tags(profile).get(tag.encode("latin-1"))
    if data is None or data[:4] not in (b"XYZ ", b"sf32"):
        return None
    return np.frombuffer(data, ">i4", offset=8).astype(np.float64) / 65536


def curves(profile: bytes, values: Array) -> Array:
    """Return linear light for device values, per channel of the profile.

    Parameters
    ----------
    profile : bytes
        The ICC profile, of the matrix/TRC or the grey kind.
    values : ndarray of shape (N,), float64
        Device values, 0 to 1.

    Returns
    -------
    ndarray of shape (N, C), float64
        Linear light, 0 to 1; C is 1 for a grey profile and 3 for RGB.

    Raises
    ------
    ValueError
        If the profile is damaged, or is of a kind without one curve per channel.

    References
    ----------
    [ICC.1:2022]_ sections 8.3, 8.4 and 10.6, 10.18.
    """
    tags = _tags(profile)
    names = _CURVE_TAGS.get(colour_space(profile))
    if names is None:
        raise ValueError(f"it describes the colour space {colour_space(profile)}, not grey or RGB")
    if any(name not in tags for name in names):
        raise ValueError("it holds look-up tables instead of one tone curve per channel")
    return np.stack([_curve(tags[name])(values) for name in names], axis=1)


def _tags(profile: bytes) -> dict[bytes, bytes]:
    if len(profile) < _HEADER_BYTES + 4 or profile[36:40] != b"acsp":
        raise ValueError("it is not an ICC profile")
    (count,) = struct.unpack_from(">I", profile, _HEADER_BYTES)
    if _HEADER_BYTES + 4 + 12 * count > len(profile):
        raise ValueError("its table of tags is cut off")
    tags = {}
    for number in range(count):
        name, offset, size = struct.unpack_from(">4sII", profile, _HEADER_BYTES + 4 + 12 * number)
        if offset + size > len(profile):
            raise ValueError(f"its tag {name.decode('latin-1')} is cut off")
        tags[name] = profile[offset : offset + size]
    return tags


def _curve(tag: bytes) -> Curve:
    try:
        if tag[:4] == b"curv":
            return _sampled_curve(tag)
        if tag[:4] == b"para":
            return _parametric_curve(tag)
    except struct.error as error:
        raise ValueError("a tone curve is cut off") from error
    raise ValueError(f"a tone curve has the unknown type {tag[:4].decode('latin-1')}")


def _sampled_curve(tag: bytes) -> Curve:
    (count,) = struct.unpack_from(">I", tag, 8)
    samples = np.array(struct.unpack_from(f">{count}H", tag, 12), dtype=np.float64)
    if count == 0:
        return lambda x: x
    if count == 1:  # u8Fixed8Number: a gamma
        return lambda x: x ** (samples[0] / 256)
    return lambda x: np.interp(x, np.linspace(0, 1, count), samples / 65535)


def _parametric_curve(tag: bytes) -> Curve:
    (kind,) = struct.unpack_from(">H", tag, 8)
    if kind not in _PARAMETER_COUNT:
        raise ValueError(f"a parametric tone curve has the unknown function type {kind}")
    raw = struct.unpack_from(f">{_PARAMETER_COUNT[kind]}i", tag, 12)
    g, a, b, c, d, e, f = _as_full_form(kind, [value / 65536 for value in raw])

    def curve(x: Array) -> Array:
        # Both branches are computed everywhere: keep the power's base from going negative below d.
        power = np.maximum(a * x + b, 0.0) ** g + e
        return np.clip(np.where(x >= d, power, c * x + f), 0.0, 1.0)

    return curve


def _as_full_form(kind: int, parameters: list[float]) -> tuple[float, ...]:
    """Return (g, a, b, c, d, e, f) of function type 4: (aX+b)^g + e for X ≥ d, else cX + f."""
    if kind == 0:
        return (parameters[0], 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    g, a, b, *rest = parameters
    if kind in (1, 2):
        if a == 0:
            raise ValueError("a parametric tone curve divides by zero")
        offset = rest[0] if kind == 2 else 0.0
        return (g, a, b, 0.0, -b / a, offset, offset)
    c, d = rest[:2]
    e, f = rest[2:] if kind == 4 else (0.0, 0.0)
    return (g, a, b, c, d, e, f)
