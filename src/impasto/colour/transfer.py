"""Transfer functions: from encoded values to linear light, and back for display.

A transfer function is named by a short text that goes into the store and the summaries: ``linear``, ``srgb``,
``gamma:2.2`` (linear = encoded ** 2.2), or ``icc:<the profile's name>`` together with the profile itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from impasto import icc
from impasto.errors import OptionError, Problem

TRANSFER_CHOICES = "linear, srgb, gamma:<number> or icc:<profile>"

# IEC 61966-2-1: a straight piece near black joined to a power of 2.4.
_SRGB_BREAK_LINEAR = 0.0031308
_SRGB_BREAK_ENCODED = 0.04045


def decode_srgb(image_srgb: ArrayLike) -> NDArray[np.float64]:
    """Return linear light for sRGB values.

    Parameters
    ----------
    image_srgb : ndarray of any shape
        Encoded values, 0 to 1.

    Returns
    -------
    ndarray of the same shape, float64
        Linear light, 0 to 1.

    References
    ----------
    [IEC61966-2-1]_, the exact piecewise function, not a power of 2.2.
    """
    encoded = np.asarray(image_srgb, dtype=np.float64)
    power = ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= _SRGB_BREAK_ENCODED, encoded / 12.92, power)


def encode_srgb(image_linear: NDArray[np.floating], exposure: float = 1.0) -> NDArray[Any]:
    """Return sRGB values for display.

    Values that the display cannot show are moved to the nearest that it can, and missing ones (NaN) become
    black; `impasto.colour.rendition` counts both, so that a picture never hides them.

    Parameters
    ----------
    image_linear : ndarray of any shape
        Relative radiance; 1 is displayed as white.
    exposure : float
        Factor on the radiance.

    Returns
    -------
    ndarray of the same shape, float32 or, for float64 input, float64
        Encoded values, 0 to 1.

    References
    ----------
    [IEC61966-2-1]_
    """
    kind = np.result_type(image_linear, np.float32)
    linear = np.clip(np.nan_to_num(np.asarray(image_linear, dtype=kind) * exposure, nan=0.0), 0.0, 1.0)
    power = 1.055 * linear ** (1 / 2.4) - 0.055
    encoded: NDArray[Any] = np.where(linear <= _SRGB_BREAK_LINEAR, 12.92 * linear, power)
    return encoded


def quantise(image_srgb: NDArray[np.floating], dtype: DTypeLike = np.uint8) -> NDArray[np.unsignedinteger]:
    """Round values from 0 to 1 to the codes of an unsigned integer type.

    Parameters
    ----------
    image_srgb : ndarray of any shape
        Encoded values, 0 to 1, as `encode_srgb` returns them.
    dtype : dtype
        uint8 or uint16.
    """
    dtype = np.dtype(dtype)
    return np.rint(np.asarray(image_srgb, np.float64) * np.iinfo(dtype).max).astype(dtype)


def linearisation_table(
    transfer: str, dtype: DTypeLike, icc_profile: bytes | None = None
) -> NDArray[np.float64]:
    """Return the linear light of every code that a photograph can hold.

    Parameters
    ----------
    transfer : str
        Name of the transfer function, as `Photograph.transfer` gives it.
    dtype : dtype
        uint8 or uint16, as the photograph is stored.
    icc_profile : bytes, optional
        The profile itself, where `transfer` starts with ``icc:``.

    Returns
    -------
    ndarray of shape (256 or 65536,) or (256 or 65536, C), float64
        Relative radiance, 0 to 1. The second axis is there where the profile's channels have different
        curves.

    Raises
    ------
    OptionError
        If the name is unknown, the profile is missing, damaged or not made of one curve per channel, or the
        dtype is not an unsigned integer of 8 or 16 bits.
    """
    dtype = np.dtype(dtype)
    if dtype not in (np.uint8, np.uint16):
        raise _unusable(transfer, f"has no table for {dtype} values", "Tables exist for uint8 and uint16")
    encoded = np.linspace(0.0, 1.0, np.iinfo(dtype).max + 1)
    if transfer == "linear":
        return encoded
    if transfer == "srgb":
        return decode_srgb(encoded)
    if transfer.startswith("gamma:"):
        return encoded ** _gamma(transfer)
    if transfer.startswith("icc:"):
        if icc_profile is None:
            raise _unusable(transfer, "names a profile that is not there", "Pass the profile's bytes as well")
        try:
            table = icc.curves(icc_profile, encoded)
        except ValueError as error:
            raise _unusable(
                transfer,
                f"cannot be decoded by tone curves: {error}",
                'Export with a matrix profile such as sRGB, or state transfer = "srgb" (or "linear", or a '
                "gamma) under [photographs] in a TOML light file",
            ) from error
        same = bool((table == table[:, :1]).all())
        return np.ascontiguousarray(table[:, 0]) if same else table
    raise _unusable(transfer, "is not a known transfer function", f"Use {TRANSFER_CHOICES}")


def _gamma(transfer: str) -> float:
    try:
        gamma = float(transfer.removeprefix("gamma:"))
    except ValueError:
        gamma = float("nan")
    if not 0.0 < gamma < float("inf"):
        raise _unusable(transfer, "needs a number above 0 after the colon", "Write it like gamma:2.2")
    return gamma


def _unusable(transfer: str, what: str, do: str) -> OptionError:
    return OptionError(Problem(where=f"transfer function {transfer}", what=what, do=do))
