"""Write pictures: PNG, TIFF, EXR and JPEG files, with an ICC profile where the format has room for one.

Each file is written under a temporary name and renamed when it is whole. Colours are given sRGB's primaries
until a camera's own are calibrated.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from impasto.colour.profiles import ProfileName, profile
from impasto.output import written_whole

Compression = Literal["deflate", "lzw", "zstd", "none"]

_TIFF_STRIP_ROWS = 64
_JPEG_QUALITY = 95
_CHANNEL_NAMES = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}


def write_png(
    path: str | os.PathLike[str], image: NDArray[Any], icc_profile: ProfileName | bytes | None = "srgb"
) -> None:
    """Write a PNG file of 8 or 16 bits.

    Parameters
    ----------
    path : path
    image : ndarray of shape (H, W) or (H, W, 1 or 3), uint8 or uint16
        Codes as they are to stand in the file; `impasto.colour.quantise` makes them from an `image_srgb`.
    icc_profile : {'srgb', 'linear'}, bytes or None
        Profile to embed, by name or as it is; None for data that are not colours.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    image = _checked(image, (np.uint8, np.uint16))
    attributes: dict[str, Any] = {"png:compressionLevel": 4}
    _write_with_oiio(path, image, "png", str(image.dtype), None, icc_profile, attributes)


def write_exr(
    path: str | os.PathLike[str],
    image: NDArray[np.floating],
    *,
    half: bool = False,
    channel_names: Sequence[str] | None = None,
) -> None:
    """Write an OpenEXR file of linear values, losslessly compressed.

    Parameters
    ----------
    path : path
    image : ndarray of shape (H, W) or (H, W, C), float
        Relative radiance, or any map; NaN stays NaN.
    half : bool
        Whether to store 16-bit floats (11 significant bits, up to 65504) instead of 32-bit ones.
    channel_names : sequence of str, optional
        By default Y, or R, G, B, by the number of channels.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    image = _checked(image, (np.float16, np.float32, np.float64)).astype(np.float32, copy=False)
    kind = "half" if half else "float"
    _write_with_oiio(
        path, image, "openexr", kind, channel_names, None, {"compression": "zip", "DateTime": ""}
    )


def write_tiff(
    path: str | os.PathLike[str],
    image: NDArray[Any],
    icc_profile: ProfileName | bytes | None = None,
    compression: Compression = "deflate",
    *,
    exposure_s: float | None = None,
) -> None:
    """Write a TIFF file of 8 or 16 bits or of 32-bit floats.

    Parameters
    ----------
    path : path
    image : ndarray of shape (H, W) or (H, W, 1 or 3), uint8, uint16 or float32
    icc_profile : {'srgb', 'linear'} or bytes, optional
        Profile to embed, by name or as it is; None for data that are not colours.
    compression : {'deflate', 'lzw', 'zstd', 'none'}, optional
        How the samples are packed, without loss; the first two with a predictor, zstd for speed without.
    exposure_s : float, optional
        Exposure time to note, as TIFF/EP does.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    import tifffile

    image = _checked(image, (np.uint8, np.uint16, np.float32))
    grey = image.shape[2] == 1
    with written_whole(Path(path)) as temporary:
        tifffile.imwrite(
            temporary,
            image[..., 0] if grey else image,
            photometric="minisblack" if grey else "rgb",
            compression=None if compression == "none" else compression,
            predictor=compression in ("deflate", "lzw"),
            rowsperstrip=_TIFF_STRIP_ROWS,
            iccprofile=_profile_bytes(icc_profile, grey),
            metadata=None,
            software="impasto",
            extratags=None if exposure_s is None else [exposure_tag(exposure_s)],
        )


def exposure_tag(exposure_s: float) -> tuple[int, str, int, tuple[int, int], bool]:
    """Return the tag ExposureTime of a TIFF file, as tifffile takes it."""
    return (33434, "2I", 1, (round(exposure_s * 1_000_000), 1_000_000), True)


def write_jpeg(path: str | os.PathLike[str], image: NDArray[np.uint8]) -> None:
    """Write a JPEG file of high quality, with its colours at full resolution.

    Parameters
    ----------
    path : path
    image : ndarray of shape (H, W) or (H, W, 1 or 3), uint8

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    import imagecodecs

    image = _checked(image, (np.uint8,))
    with written_whole(Path(path)) as temporary:
        temporary.write_bytes(imagecodecs.jpeg8_encode(image, level=_JPEG_QUALITY, subsampling="444"))


def _checked(image: NDArray[Any], dtypes: Sequence[type]) -> NDArray[Any]:
    """Return the image with three axes, contiguous; raise for a shape or type that the format cannot hold."""
    image = np.ascontiguousarray(image[..., None] if image.ndim == 2 else image)
    if image.ndim != 3 or 0 in image.shape or image.dtype not in dtypes:
        allowed = ", ".join(np.dtype(dtype).name for dtype in dtypes)
        raise ValueError(
            f"an image of shape {image.shape} and type {image.dtype} cannot be written; expected (H, W) or "
            f"(H, W, C) of {allowed}"
        )
    return image


def _profile_bytes(icc_profile: ProfileName | bytes | None, grey: bool) -> bytes | None:
    return profile(icc_profile, grey) if isinstance(icc_profile, str) else icc_profile


def _write_with_oiio(
    path: str | os.PathLike[str],
    image: NDArray[Any],
    format_name: str,
    kind: str,
    channel_names: Sequence[str] | None,
    icc_profile: ProfileName | bytes | None,
    attributes: dict[str, Any],
) -> None:
    import OpenImageIO as oiio

    height, width, channels = image.shape
    names = channel_names or _CHANNEL_NAMES.get(channels)
    if names is None or len(names) != channels:
        raise ValueError(f"{channels} channels need as many names, got {names}")
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.channelnames = tuple(names)
    for key, value in attributes.items():
        spec.attribute(key, value)
    data = _profile_bytes(icc_profile, channels == 1)
    if data is not None:
        spec.attribute("ICCProfile", f"uint8[{len(data)}]", np.frombuffer(data, np.uint8))
    with written_whole(Path(path)) as temporary:
        output = oiio.ImageOutput.create(format_name)
        assert output is not None  # both formats are built into OpenImageIO
        # A full disk may show only when the last rows are flushed, so closing is checked too.
        whole = output.open(str(temporary), spec) and output.write_image(image)
        if not (output.close() and whole):
            raise OSError(output.geterror() or "no reason given")
