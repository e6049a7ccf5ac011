"""An animated picture of the painting under a moving light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.colour import quantise
from impasto.colour.profiles import profile
from impasto.colour.rendition import Rendition
from impasto.output import written_whole

_LONGEST_PX = 1024
_FRAME_MS = 90
_QUALITY = 88


class Animation:
    """Collect frames from bands of rows, and save them as an animated WebP file of 8 bits.

    Frames are reduced by a power of two, averaged in linear light, until their longer side fits 1024 pixels;
    so a frame takes at most 3 MB of memory.

    Parameters
    ----------
    path : Path
        The file to write.
    height, width : int
        Size of the renderings.
    rendition : Rendition
        How their radiance is shown.
    """

    def __init__(self, path: Path, height: int, width: int, rendition: Rendition) -> None:
        self.path = path
        self._rendition = rendition
        self._factor = 1
        while max(height, width) > _LONGEST_PX * self._factor:
            self._factor *= 2
        self._size = (height // self._factor, width // self._factor)
        self._frames: dict[int, NDArray[np.uint8]] = {}

    def add(self, frame: int, rows: slice, radiance: NDArray[np.float32]) -> None:
        """Take in rows of a frame.

        Parameters
        ----------
        frame : int
            Number of the frame.
        rows : slice
            Which rows; they start at a multiple of 32.
        radiance : ndarray of shape (rows, W, C), float32
            Relative radiance.
        """
        height, width = self._size
        factor = self._factor
        target = self._frames.setdefault(frame, np.zeros((height, width, 3), np.uint8))
        first = rows.start // factor
        whole = min(radiance.shape[0] // factor, height - first)
        blocks = radiance[: whole * factor, : width * factor].reshape(whole, factor, width, factor, -1)
        target[first : first + whole] = quantise(self._rendition(blocks.mean(axis=(1, 3))).drive)

    def save(self) -> None:
        """Write the file, whole or not at all.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from PIL import Image

        frames: list[Any] = [Image.fromarray(frame) for _, frame in sorted(self._frames.items())]
        with written_whole(self.path) as temporary:
            frames[0].save(
                temporary,
                format="WEBP",
                save_all=True,
                append_images=frames[1:],
                duration=_FRAME_MS,
                loop=0,
                quality=_QUALITY,
                icc_profile=self._rendition.profile if self._rendition.channels == 3 else profile("srgb"),
            )
