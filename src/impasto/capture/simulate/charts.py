"""Charts of known reflectance: a grey scale and a colour chart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from impasto.geometry import Array

_COLUMNS = 6
_CARD_REFLECTANCE = 0.03


@dataclass(frozen=True)
class Chart:
    """Patches of known reflectance on a black card.

    Parameters
    ----------
    names : tuple of str
    reflectance : ndarray of shape (P, 3)
        In the camera's space, linear sRGB.
    known : dict of str to ndarray of shape (P,)
        What the chart's maker states, one column of the table each.
    """

    names: tuple[str, ...]
    reflectance: Array
    known: dict[str, Array]

    def boxes(self, size: tuple[int, int]) -> list[tuple[int, int, int, int]]:
        """Return first row, first column, end row and end column of each patch in an image of (H, W)."""
        rows = -(-len(self.names) // _COLUMNS)
        height, width = size
        boxes = []
        for number in range(len(self.names)):
            row, column = divmod(number, _COLUMNS)
            boxes.append((
                round((row + 0.1) * height / rows), round((column + 0.1) * width / _COLUMNS),
                round((row + 0.9) * height / rows), round((column + 0.9) * width / _COLUMNS),
            ))  # fmt: skip
        return boxes

    def image(self, size: tuple[int, int]) -> Array:
        """Return the chart's reflectance, ndarray of shape (H, W, 3)."""
        image = np.full((*size, 3), _CARD_REFLECTANCE)
        for (top, left, bottom, right), reflectance in zip(self.boxes(size), self.reflectance, strict=True):
            image[top:bottom, left:right] = reflectance
        return image

    def table(self, size: tuple[int, int]) -> str:
        """Return the chart as CSV: name, box, and what is known."""
        lines = [",".join(["patch", "row0_px", "column0_px", "row1_px", "column1_px", *self.known])]
        for number, (name, box) in enumerate(zip(self.names, self.boxes(size), strict=True)):
            values = [f"{values[number]:.6f}" for values in self.known.values()]
            lines.append(",".join([name, *(str(edge) for edge in box), *values]))
        return "\n".join(lines) + "\n"


@cache
def grey_scale() -> Chart:
    """Return a grey scale of 20 steps of density 0.15, from 98 % to 0.14 %: 2.85 decades."""
    density = -np.log10(0.98) + 0.15 * np.arange(20)
    names = tuple(f"grey {number}" for number in range(1, 21))
    return Chart(names, np.repeat(10 ** -density[:, None], 3, axis=1), {"density": density})


@cache
def colour_chart() -> Chart:
    """Return the classic colour chart of 24 patches.

    Notes
    -----
    Colours are those that colour-science lists for charts made since November 2014, adapted from D50 to D65.
    The camera's space is linear sRGB: a patch outside it is moved to its boundary, and the X, Y and Z stated
    are those of the patch as moved.
    """
    import colour  # slow to import

    listed = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    srgb = colour.RGB_COLOURSPACES["sRGB"]
    adapt = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        colour.xy_to_XYZ(listed.illuminant), colour.xy_to_XYZ(srgb.whitepoint), transform="Bradford"
    )
    xyz = colour.xyY_to_XYZ(np.array(list(listed.data.values()))) @ adapt.T
    rgb = np.clip(xyz @ srgb.matrix_XYZ_to_RGB.T, 0, 1)
    xyz = rgb @ np.linalg.inv(srgb.matrix_XYZ_to_RGB).T
    known = {f"{axis}_D65": xyz[:, number] for number, axis in enumerate("XYZ")}
    return Chart(tuple(listed.data), rgb, known)
