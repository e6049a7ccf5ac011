"""Displays, printers and working spaces that an ICC profile describes, through Little CMS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto import icc
from impasto.colour.adaptation import adaptation_matrix
from impasto.errors import OptionError, Problem

Array = NDArray[np.float64]

# Differences in Lab between a colour and what is shown for it, from which on it counts as outside the gamut:
# those of Little CMS's own gamut check, for matrix profiles and, whose tables are coarse, for the others.
_OUTSIDE_MATRIX = 1.0
_OUTSIDE_TABLE = 5.0

# The white of the profile connection space [ICC.1:2022]_.
_D50 = (0.9642, 1.0, 0.8249)

# A drive this near to 0 or 1 may stand for a colour beyond.
_AT_END = 1e-4


@dataclass(frozen=True, eq=False)
class IccDisplay:
    """A device that an ICC profile describes, shown colours relative to its white.

    Parameters
    ----------
    profile : bytes
        The profile, of the RGB kind.
    name : str
        What summaries call it.
    """

    profile: bytes
    name: str

    @property
    def black(self) -> Array:
        """Nothing: the profile itself says what black shows."""
        return np.zeros(3)

    @cached_property
    def _adapted(self) -> Array:
        """The matrix by which the profile's maker adapted what the device shows to D50.

        As Little CMS finds it: the tag ``chad``; in display profiles before version 4, Bradford's adaptation
        of the white stated.
        """
        stated, white = icc.numbers(self.profile, "chad"), icc.numbers(self.profile, "wtpt")
        if stated is not None:
            return stated.reshape(3, 3)
        if white is not None and self.profile[8] < 4 and self.profile[12:16] == b"mntr":
            return adaptation_matrix(white, _D50, "bradford")
        return np.eye(3)

    @cached_property
    def _to_d50(self) -> Array:
        """The matrix from light to XYZ under D50, scaled so that full light is white.

        For profiles with tables this is an approximation, which serves to tell what is too bright.
        """
        corners = np.vstack([np.eye(3), np.ones(3)])
        shown = _transform(corners, self.profile, _built_in("xyz"), "rgb", "xyz").T
        return np.asarray(shown[:, :3] * np.linalg.solve(shown[:, :3], shown[:, 3]))

    @cached_property
    def matrix(self) -> Array:
        """XYZ of the primaries, as for `Display`."""
        return np.asarray(np.linalg.solve(self._adapted, self._to_d50))

    def encode(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Return the drive for light; see `Display`."""
        xyz = linear @ self._to_d50.T.astype(linear.dtype, copy=False)
        return np.asarray(np.clip(_transform(xyz, _built_in("xyz"), self.profile, "xyz", "rgb"), 0, 1))

    def decode(self, drive: ArrayLike) -> Array:
        """Return the XYZ for drives; see `Display`."""
        d50 = _transform(np.asarray(drive, np.float64), self.profile, _built_in("xyz"), "rgb", "xyz")
        return np.asarray(np.linalg.solve(self._adapted, d50.reshape(-1, 3).T).T.reshape(d50.shape))

    def outside(
        self, linear: NDArray[Any], drive: NDArray[Any], asked: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Tell which colours it cannot show; see `Display`."""
        result = asked & ((drive <= _AT_END) | (drive >= 1 - _AT_END)).any(axis=-1)
        xyz = linear[result] @ self._to_d50.T.astype(linear.dtype)
        wanted = _transform(xyz, _built_in("xyz"), _built_in("lab4"), "xyz", "lab")
        shown = _transform(drive[result], self.profile, _built_in("lab4"), "rgb", "lab")
        limit = _OUTSIDE_TABLE if icc.has_tables(self.profile) else _OUTSIDE_MATRIX
        result[result] = np.linalg.norm(wanted - shown, axis=-1) > limit
        return result


def icc_display(profile: bytes, where: str) -> IccDisplay:
    """Return the device that a profile describes.

    Parameters
    ----------
    profile : bytes
    where : str
        Where the profile comes from, for messages.

    Raises
    ------
    OptionError
        If the bytes are not an ICC profile, or one that shows no RGB colours.
    """
    do = "Give the profile that the display's calibration made, or srgb or display-p3"
    try:
        display = IccDisplay(profile, icc.description(profile))
        space = icc.colour_space(profile)
    except ValueError as error:
        raise OptionError(Problem(where, f"cannot be used: {error}", do)) from error
    if space != "RGB":
        raise OptionError(Problem(where, f"is a profile of {space} colours, expected RGB", do))
    try:
        display.encode(np.ones((1, 3)))
        display.decode(np.ones((1, 3)))
    except (RuntimeError, ValueError) as error:
        raise OptionError(Problem(where, "cannot be used in both directions by Little CMS", do)) from error
    return display


def _built_in(name: str) -> bytes:
    import imagecodecs

    return bytes(imagecodecs.cms_profile(name))


def _transform(
    colours: NDArray[Any], source: bytes, target: bytes, source_space: str, target_space: str
) -> NDArray[Any]:
    """Convert colours of shape (..., 3) in their own float type, relative to both whites."""
    import imagecodecs

    if not colours.size:
        return colours
    return np.asarray(
        imagecodecs.cms_transform(
            np.ascontiguousarray(colours.reshape(1, -1, 3)),
            source,
            target,
            colorspace=source_space,
            outcolorspace=target_space,
            outdtype=colours.dtype,
            intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
        )
    ).reshape(colours.shape)
