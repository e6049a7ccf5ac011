"""Files that a simulation writes, each under a passing name first so that none is ever half there."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import CaptureError, Problem

ENDINGS = {"tiff": ".tif", "png": ".png", "jpeg": ".jpg", "exr": ".exr"}
_PASSING = ".partial"


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make a file beside `path`, then move it there.

    Raises
    ------
    CaptureError
        If the disk is full or the folder cannot be written; nothing is left behind.
    """
    # The ending stays last, because writers of images choose the format by it.
    passing = path.with_name(f".{path.stem}{_PASSING}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(passing)
        os.replace(passing, path)
    except OSError as error:
        raise CaptureError(
            Problem(
                str(path),
                f"cannot be written: {error.strerror or error}",
                "Free some space or choose another folder",
            )
        ) from error
    finally:
        passing.unlink(missing_ok=True)


def sweep(folder: Path) -> None:
    """Remove what an interrupted run left under passing names."""
    for path in folder.rglob(f".*{_PASSING}.*"):
        path.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8."""
    write_whole(path, lambda passing: passing.write_text(text, encoding="utf-8", newline="\n"))


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file."""
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def write_image(path: Path, image: NDArray[Any], compression: str = "zstd") -> None:
    """Write an image in the format of its ending.

    Parameters
    ----------
    path : Path
        Ending in .tif, .png, .jpg or .exr.
    image : ndarray of shape (H, W) or (H, W, C)
        uint8 or uint16 for integer formats, float32 for .exr and .tif.
    compression : str
        ``zstd``, ``deflate``, ``lzw`` or ``none``; for .tif only.
    """
    writers = {".tif": _write_tiff, ".png": _write_png, ".jpg": _write_jpeg, ".exr": _write_exr}
    writer = writers[path.suffix]
    write_whole(path, lambda passing: writer(passing, np.ascontiguousarray(image), compression))


def _write_tiff(path: Path, image: NDArray[Any], compression: str) -> None:
    import tifffile  # slow to import, as are the other writers

    tifffile.imwrite(
        path,
        image,
        photometric="rgb" if image.ndim == 3 else "minisblack",
        compression=None if compression == "none" else compression,
        rowsperstrip=64,
        metadata=None,
        software="impasto simulate",
    )


def _write_png(path: Path, image: NDArray[Any], _: str) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.png_encode(image, level=3))


def _write_jpeg(path: Path, image: NDArray[Any], _: str) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.jpeg8_encode(image, level=95, subsampling="444"))


def _write_exr(path: Path, image: NDArray[Any], _: str) -> None:
    import OpenImageIO as oiio

    height, width = image.shape[:2]
    channels = image.shape[2] if image.ndim == 3 else 1
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec.channelnames = ("R", "G", "B")[:channels] if channels > 1 else ("Y",)
    spec.attribute("compression", "zip")
    output = oiio.ImageOutput.create(str(path))
    if output is None or not output.open(str(path), spec) or not output.write_image(image):
        raise OSError(oiio.geterror() if output is None else output.geterror())
    if not output.close():
        raise OSError(output.geterror())
