"""Pictures arrive whole, unchanged, with their profile, or not at all."""

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

from impasto.band_writers import BandWriter, write_tiff_bands
from impasto.colour.profiles import profile
from impasto.errors import OutputError
from impasto.output import prepare_folder


def read(path):
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    return image.read_image(spec.format), spec


@pytest.mark.parametrize("channels", [("R", "G", "B"), ("Y",)])
def test_exr_holds_the_numbers_as_they_are(tmp_path, channels):
    values = np.random.default_rng(1).normal(0, 1e4, (37, 21, len(channels))).astype(np.float32)
    values[3, 4] = np.nan
    with BandWriter(tmp_path / "x.exr", 37, 21, channels) as writer:
        for start in range(0, 37, 10):
            writer.write(values[start : start + 10])
    stored, spec = read(tmp_path / "x.exr")
    np.testing.assert_array_equal(stored.reshape(values.shape), values)
    assert str(spec.format) == "float"
    assert [path.name for path in tmp_path.iterdir()] == ["x.exr"]


@pytest.mark.parametrize("channels", [("R", "G", "B"), ("Y",)])
def test_png_holds_codes_with_their_profile(tmp_path, channels):
    codes = np.random.default_rng(2).integers(0, 256, (20, 30, len(channels)))
    made = profile("srgb", grey=len(channels) == 1)
    with BandWriter(tmp_path / "x.png", 20, 30, channels, icc_profile=made) as writer:
        writer.write((codes / 255).astype(np.float32))
    stored, spec = read(tmp_path / "x.png")
    np.testing.assert_array_equal(stored.reshape(codes.shape), codes)
    assert bytes(spec.getattribute("ICCProfile")) == made


@pytest.mark.parametrize("channels", [1, 3])
def test_tiff_joins_uneven_bands(tmp_path, channels):
    codes = np.random.default_rng(3).integers(0, 65536, (150, 11, channels), dtype=np.uint16)
    bands = [codes[:1], codes[1:100], codes[100:101], codes[101:]]
    write_tiff_bands(tmp_path / "x.tif", bands, codes.shape, np.uint16, description="a map", srgb=True)
    with tifffile.TiffFile(tmp_path / "x.tif") as file:
        page = file.pages[0]
        np.testing.assert_array_equal(page.asarray().reshape(codes.shape), codes)
        assert page.description == "a map"
        assert page.tags["InterColorProfile"].value == profile("srgb", grey=channels == 1)


def test_an_interrupted_picture_leaves_nothing(tmp_path):
    def upper_half(after):
        with BandWriter(tmp_path / "x.exr", 10, 8, "RGB") as writer:
            writer.write(np.zeros((5, 8, 3), np.float32))
            after()

    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        upper_half(interrupt)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="row 5 of 10"):
        upper_half(lambda: None)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["x.png", "x.exr", "x.tif"])
def test_a_picture_that_gets_no_rows_leaves_nothing_and_no_complaint(tmp_path, capfd, name):
    with pytest.raises(KeyboardInterrupt), BandWriter(tmp_path / name, 10, 8, "RGB"):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        prepare_folder(tmp_path / "file")
    with pytest.raises(OutputError, match="cannot be written"):
        BandWriter(tmp_path / "absent" / "x.png", 5, 5, "RGB")
