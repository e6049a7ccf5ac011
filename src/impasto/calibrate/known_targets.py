"""Colour targets that are found by themselves: how their patches lie, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from impasto.calibrate.patches import Array


@dataclass(frozen=True)
class KnownTarget:
    """A target of patches in rows.

    Parameters
    ----------
    data : str
        Name of its data in colour-science, which lists the patches row by row.
    across, down : int
        Patches in a row, and rows.
    grey_row : tuple of str
        Neutral patches that lie beside each other, from light to dark.
    greys : tuple of str
        All neutral patches of different reflectance, from light to dark.
    """

    data: str
    across: int
    down: int
    grey_row: tuple[str, ...]
    greys: tuple[str, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The patches, row by row."""
        return tuple(self._checker.data)

    @cached_property
    def xyz(self) -> Array:
        """XYZ of the patches, ndarray of shape (P, 3), Y = 1 for a perfect white."""
        import colour  # slow to import

        return np.asarray(colour.xyY_to_XYZ(np.array(list(self._checker.data.values()))))

    @cached_property
    def white_xyz(self) -> Array:
        """XYZ of a perfect white under the illuminant of the data, ndarray of shape (3,)."""
        import colour

        return np.asarray(colour.xy_to_XYZ(self._checker.illuminant))

    @cached_property
    def _checker(self):  # type: ignore[no-untyped-def]
        import colour

        return colour.CCS_COLOURCHECKERS[self.data]


_CLASSIC_GREYS = (
    "white 9.5 (.05 D)", "neutral 8 (.23 D)", "neutral 6.5 (.44 D)", "neutral 5 (.70 D)",
    "neutral 3.5 (1.05 D)", "black 2 (1.5 D)",
)  # fmt: skip

KNOWN_TARGETS = {
    "classic": KnownTarget("ColorChecker24 - After November 2014", 6, 4, _CLASSIC_GREYS, _CLASSIC_GREYS),
    "sg": KnownTarget(
        "ColorCheckerSG - After November 2014", 14, 10,
        ("E5", "F5", "G5", "H5", "I5", "J5"),
        ("E5", "J6", "F5", "I6", "G5", "H6", "H5", "G6", "I5", "F6", "J5", "E6"),
    ),
}  # fmt: skip
"""By the names that the program calls them."""
