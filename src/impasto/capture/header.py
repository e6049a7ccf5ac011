"""What the header of an image file says, whatever the format."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Header:
    """The header of one image file.

    Parameters
    ----------
    height, width : int
        Size in pixels, as stored: an orientation in the file's metadata is not applied.
    channels : int
        1 or 3; an alpha channel does not count.
    dtype : dtype
        uint8, uint16 or float32, as `bands` gives the pixels (half floats are widened).
    unit_rows : int
        Rows that the format makes a reader decode at once: bands of fewer rows need the memory of this many.
    declared_transfer : str or None
        The transfer function that the file states otherwise than by a profile.
    icc_profile : bytes or None
        The embedded profile.
    exposure_s, f_number, iso : float or None
        Exposure as the camera noted it.
    camera, lens, taken : str or None
        Make and model of the camera, the lens, and the time of the photograph, as the camera noted them.
    orientation : int
        The EXIF orientation, 1 to 8; 1 is upright.
    whole_size : (int, int) or None
        Width and height of a raw file whose mosaic is read at half size, as one pixel per red, two green and
        blue photosites.
    remarks : tuple of str
        What is left out on reading, such as an alpha channel.
    """

    height: int
    width: int
    channels: int
    dtype: np.dtype
    unit_rows: int
    declared_transfer: str | None = None
    icc_profile: bytes | None = field(default=None, repr=False)
    exposure_s: float | None = None
    f_number: float | None = None
    iso: float | None = None
    camera: str | None = None
    lens: str | None = None
    taken: str | None = None
    orientation: int = 1
    whole_size: tuple[int, int] | None = None
    remarks: tuple[str, ...] = ()

    @property
    def half_size(self) -> bool:
        """Whether a raw file is read at half size."""
        return self.whole_size is not None


class UnreadableError(Exception):
    """An image file that cannot be read; `what` and `do` are the parts of the `Problem` that it becomes."""

    def __init__(
        self, what: str, do: str = "Copy it again from the camera, or leave it out with --exclude"
    ) -> None:
        super().__init__(what)
        self.what = what
        self.do = do
