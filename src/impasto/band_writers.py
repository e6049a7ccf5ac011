"""Write pictures in bands of rows as they are computed, so that no whole picture has to be in memory.

A file is written under a temporary name and renamed when its last row is in it. `impasto.images` writes
pictures that are in memory anyway.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.colour import quantise
from impasto.colour.profiles import profile
from impasto.errors import OutputError
from impasto.output import output_error, partial_path, written_whole

_TIFF_STRIP_ROWS = 64
_DTYPES = {".exr": "float", ".png": "uint8", ".tif": "uint16"}


class BandWriter:
    """Write an EXR, PNG or TIFF file from bands of rows, top to bottom.

    The type of the samples follows from the file's ending: .exr holds float32 as given; .png holds 8 bits and
    .tif 16, from values that are encoded already (0 to 1).

    Parameters
    ----------
    path : path
        The file, which is there when the writer closes without an exception.
    height, width : int
        Size of the picture.
    channels : sequence of str
        Their names: ``("R", "G", "B")``, or one.
    description : str, optional
        What the picture shows; kept in the file.
    icc_profile : bytes, optional
        What encoded values mean; none for data that are not colours.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        height: int,
        width: int,
        channels: Sequence[str],
        description: str = "",
        icc_profile: bytes | None = None,
    ) -> None:
        import OpenImageIO as oiio

        self.path = Path(path)
        self._height = height
        self._row = 0
        self._dtype = _DTYPES[self.path.suffix.lower()]
        spec = oiio.ImageSpec(width, height, len(channels), self._dtype)
        spec.channelnames = tuple(channels)
        spec.attribute("Software", "impasto")
        if description:
            spec.attribute("ImageDescription", description)
        if icc_profile is not None:
            data = np.frombuffer(icc_profile, np.uint8)
            spec.attribute("ICCProfile", f"uint8[{len(data)}]", data)
        if self._dtype != "uint8":
            spec.attribute("compression", "zip")
            spec.attribute("DateTime", "")
        self._temporary = partial_path(self.path)
        output: Any = oiio.ImageOutput.create(self.path.suffix[1:].lower())
        self._output, self._spec = output, spec
        try:
            self._temporary.touch()
        except OSError as error:
            raise output_error(self.path, error.strerror or str(error)) from error

    def write(self, band: NDArray[np.floating]) -> None:
        """Write the next rows.

        Parameters
        ----------
        band : ndarray of shape (rows, W, C), float32
            Linear values for EXR, encoded ones from 0 to 1 for the others.

        Raises
        ------
        OutputError
            If the disk refuses them.
        """
        stop = self._row + band.shape[0]
        exact = self._dtype == "float"
        pixels = np.ascontiguousarray(band, np.float32) if exact else quantise(band, self._dtype)
        # Not before there are pixels: libpng complains to the terminal about files that never get any.
        if self._row == 0 and not self._output.open(str(self._temporary), self._spec):
            raise self._failed()
        if not self._output.write_scanlines(self._row, stop, 0, pixels):
            raise self._failed()
        self._row = stop

    def __enter__(self) -> BandWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        closed = self._output.close()
        if kind is not None:
            self._temporary.unlink(missing_ok=True)
            return
        if not closed or self._row != self._height:
            reason = self._failed()
            self._temporary.unlink(missing_ok=True)
            raise reason
        self._temporary.replace(self.path)

    def _failed(self) -> OutputError:
        reason = self._output.geterror().strip().split("\n")[0]
        return output_error(self.path, reason or f"row {self._row} of {self._height}")


def write_tiff_bands(
    path: str | PathLike[str],
    bands: Iterable[NDArray[Any]],
    shape: tuple[int, int, int],
    dtype: Any,
    *,
    description: str = "",
    srgb: bool = False,
) -> None:
    """Write a TIFF file of unsigned integers from bands of rows.

    Parameters
    ----------
    path : path
        The file.
    bands : iterable of ndarray of shape (rows, W, C)
        The rows, top to bottom, of `dtype`.
    shape : (H, W, C)
        Size of the whole picture; C is 1, 2 or 3.
    dtype : dtype
        uint8 or uint16.
    description : str, optional
        What the codes mean; kept in the file.
    srgb : bool, optional
        Whether the codes are sRGB, which adds the ICC profile.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    import tifffile

    path = Path(path)
    height, width, channels = shape
    with written_whole(path) as temporary:
        tifffile.imwrite(
            temporary,
            data=_strips(bands),
            shape=(height, width, channels) if channels > 1 else (height, width),
            dtype=np.dtype(dtype),
            photometric="rgb" if channels == 3 else "minisblack",
            # Two lobes are two samples of a pixel, not two pictures.
            planarconfig="contig" if channels > 1 else None,
            extrasamples=("unspecified",) * (channels - 1) if channels == 2 else None,
            compression="zlib",
            predictor=True,
            rowsperstrip=_TIFF_STRIP_ROWS,
            description=description or None,
            software="impasto",
            metadata=None,
            iccprofile=profile("srgb", grey=channels == 1) if srgb else None,
            bigtiff=height * width * channels * np.dtype(dtype).itemsize > 3 << 30,
        )


def _strips(bands: Iterable[NDArray[Any]]) -> Iterator[bytes]:
    """Cut bands into the compressed strips of a TIFF file, joining what is left of one with the next."""
    import imagecodecs

    def compressed(strip: NDArray[Any]) -> bytes:
        return bytes(imagecodecs.zlib_encode(imagecodecs.delta_encode(strip, axis=1).tobytes()))

    rest: NDArray[Any] | None = None
    for band in bands:
        joined = band if rest is None or not len(rest) else np.concatenate([rest, band])
        whole = len(joined) // _TIFF_STRIP_ROWS * _TIFF_STRIP_ROWS
        for start in range(0, whole, _TIFF_STRIP_ROWS):
            yield compressed(joined[start : start + _TIFF_STRIP_ROWS])
        rest = joined[whole:]
    if rest is not None and len(rest):
        yield compressed(rest)
