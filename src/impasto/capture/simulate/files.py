"""The images that a simulation writes, in the format of their ending."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from impasto.capture.simulate.dng import write_dng
from impasto.images import Compression, write_exr, write_jpeg, write_png, write_tiff
from impasto.output import prepare_folder

ENDINGS = {"tiff": ".tif", "png": ".png", "jpeg": ".jpg", "exr": ".exr", "dng": ".dng"}


def write_image(
    path: Path,
    image: NDArray[Any],
    compression: Compression = "zstd",
    *,
    exposure_s: float | None = None,
) -> None:
    """Write an image in the format of its ending.

    Parameters
    ----------
    path : Path
        Ending in .tif, .png, .jpg, .exr or .dng; its folder is made if need be.
    image : ndarray of shape (H, W) or (H, W, C)
        uint8 or uint16; float32 for .exr.
    compression : {'zstd', 'deflate', 'lzw', 'none'}, optional
        For .tif only.
    exposure_s : float, optional
        Exposure time to note, in .tif and .dng files.

    Raises
    ------
    OutputError
        If the file cannot be written; nothing is left behind.
    """
    prepare_folder(path.parent)
    if path.suffix == ".tif":
        write_tiff(path, image, None, compression, exposure_s=exposure_s)
    elif path.suffix == ".jpg":
        write_jpeg(path, image)
    elif path.suffix == ".png":
        write_png(path, image, None)
    elif path.suffix == ".dng":
        write_dng(path, image, exposure_s=exposure_s)
    else:
        write_exr(path, image)
