"""Files that a simulation writes, each under a passing name first so that none is ever half there."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import OutputError, Problem
from impasto.images import write_exr, write_png

ENDINGS = {"tiff": ".tif", "png": ".png", "jpeg": ".jpg", "exr": ".exr"}
_PASSING = ".partial"


def make_folder(path: Path) -> None:
    """Make a folder and those above it; raise `OutputError` if that fails."""
    with _told(path):
        path.mkdir(parents=True, exist_ok=True)


def sweep(folder: Path) -> None:
    """Remove what an interrupted run left under passing names."""
    for path in folder.rglob(f".*{_PASSING}"):
        path.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8; raise `OutputError` if that fails."""
    _write_whole(path, lambda passing: passing.write_text(text, encoding="utf-8", newline="\n"))


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file; raise `OutputError` if that fails."""
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def write_image(path: Path, image: NDArray[Any], compression: str = "zstd") -> None:
    """Write an image in the format of its ending.

    Parameters
    ----------
    path : Path
        Ending in .tif, .png, .jpg or .exr; its folder is made if need be.
    image : ndarray of shape (H, W) or (H, W, C)
        uint8 or uint16; float32 for .exr.
    compression : str
        ``zstd``, ``deflate``, ``lzw`` or ``none``; for .tif only.

    Raises
    ------
    OutputError
        If the file cannot be written; nothing is left behind.
    """
    make_folder(path.parent)
    if path.suffix == ".tif":
        _write_whole(path, lambda passing: _write_tiff(passing, image, compression))
    elif path.suffix == ".jpg":
        _write_whole(path, lambda passing: _write_jpeg(passing, image))
    elif path.suffix == ".png":
        write_png(path, image, None)
    else:
        write_exr(path, image)


def _write_tiff(path: Path, image: NDArray[Any], compression: str) -> None:
    import tifffile  # slow to import

    tifffile.imwrite(
        path,
        image,
        photometric="rgb" if image.ndim == 3 else "minisblack",
        compression=None if compression == "none" else compression,
        rowsperstrip=64,
        metadata=None,
        software="impasto",
    )


def _write_jpeg(path: Path, image: NDArray[Any]) -> None:
    import imagecodecs  # slow to import

    path.write_bytes(imagecodecs.jpeg8_encode(np.ascontiguousarray(image), level=95, subsampling="444"))


def _write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make a file beside `path`, then move it there."""
    make_folder(path.parent)
    passing = path.with_name(f".{path.name}{_PASSING}")
    try:
        with _told(path):
            write(passing)
            os.replace(passing, path)
    finally:
        passing.unlink(missing_ok=True)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turn the system's errors about `path` into ours."""
    try:
        yield
    except OSError as error:
        raise OutputError(
            Problem(
                str(path),
                f"cannot be written: {error.strerror or error}",
                "Check that the folder may be written to and has room",
            )
        ) from error
