"""Write what a sensor sees as a raw file: a Bayer mosaic in Adobe's digital negative."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray

from impasto.images import exposure_tag
from impasto.output import written_whole

BLACK_LEVEL = 512
WHITE_LEVEL = 16383

_CFA = 32803


def write_dng(
    path: Path,
    image: NDArray[np.uint16],
    *,
    exposure_s: float | None = None,
    iso: int = 100,
    camera: str = "simulated camera",
) -> None:
    """Write an image as an uncompressed DNG file of 14 bits, red first.

    Parameters
    ----------
    path : Path
    image : ndarray of shape (H, W, 3), uint16
        Linear, 65535 where the sensor is saturated.
    exposure_s : float, optional
        Exposure time to note.
    iso : int, optional
        To note.
    camera : str, optional
        Model to note; its make is "impasto".

    Raises
    ------
    OutputError
        If the file cannot be written; nothing is left behind.

    References
    ----------
    [DNG1.7]_
    """
    with written_whole(path) as temporary:
        tifffile.imwrite(
            temporary,
            _mosaic(image),
            photometric=_CFA,
            extratags=_tags(exposure_s, iso, camera),
            metadata=None,
            software=False,
        )


def _mosaic(image: NDArray[np.uint16]) -> NDArray[np.uint16]:
    seen = np.empty(image.shape[:2], np.float64)
    for row, column, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        seen[row::2, column::2] = image[row::2, column::2, channel]
    counts = BLACK_LEVEL + seen / 65535 * (WHITE_LEVEL - BLACK_LEVEL)
    return np.rint(counts).astype(np.uint16)


def _tags(exposure_s: float | None, iso: int, camera: str) -> list[tuple[int, str, int, Any, bool]]:
    def rationals(*values: float) -> tuple[int, ...]:
        return tuple(part for value in values for part in (round(value * 1_000_000), 1_000_000))

    tags: list[tuple[int, str, int, Any, bool]] = [
        (254, "I", 1, 0, True),  # the full picture
        (271, "s", 0, "impasto", True),
        (272, "s", 0, camera, True),
        (274, "H", 1, 1, True),
        (33421, "H", 2, (2, 2), True),  # size of the colour filter array
        (33422, "B", 4, bytes([0, 1, 1, 2]), True),
        (34855, "H", 1, iso, True),  # ISO
        (50706, "B", 4, bytes([1, 4, 0, 0]), True),
        (50707, "B", 4, bytes([1, 1, 0, 0]), True),
        (50708, "s", 0, f"impasto {camera}", True),
        (50713, "H", 2, (2, 2), True),
        (50714, "I", 4, (BLACK_LEVEL,) * 4, True),
        (50717, "I", 1, WHITE_LEVEL, True),
        (50721, "2i", 9, rationals(1, 0, 0, 0, 1, 0, 0, 0, 1), True),  # XYZ to camera
        (50728, "2I", 3, rationals(1, 1, 1), True),  # neutral
        (50778, "H", 1, 23, True),  # of D50
    ]
    if exposure_s is not None:
        tags.append(exposure_tag(exposure_s))
    return sorted(tags)
