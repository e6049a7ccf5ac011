"""Small captures written with the real libraries."""

import numpy as np
import pytest
import tifffile


@pytest.fixture
def rng():
    return np.random.default_rng(12)


@pytest.fixture
def make_capture(tmp_path):
    """Return a function that writes a folder of tiny TIFF photographs and a light file."""

    def make(names=("a.tif", "b.tif", "c.tif"), lights=None, text=None, **changed):
        for number, name in enumerate(names):
            pixels = changed.get(name, np.full((4, 6, 3), 1000 * (number + 1), np.uint16))
            tifffile.imwrite(tmp_path / name, pixels, photometric="rgb" if pixels.ndim == 3 else "minisblack")
        if text is None:
            text = "".join(f"{name} 0.{number + 1} 0.2 0.9\n" for number, name in enumerate(names))
        (tmp_path / (lights or "dirs.lp")).write_text(text, encoding="utf-8")
        return tmp_path

    return make
