"""Pictures written to files, read back by other libraries."""

import imagecodecs
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

from impasto import icc
from impasto.colour import decode_srgb
from impasto.colour.profiles import profile
from impasto.errors import OutputError
from impasto.images import write_exr, write_png, write_tiff


def oiio_read(path, kind):
    image = oiio.ImageInput.open(str(path))
    return image.read_image(kind), image.spec()


def codes(rng, dtype, channels):
    return rng.integers(0, np.iinfo(dtype).max, (31, 17, channels), dtype, endpoint=True)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3])
def test_png(tmp_path, dtype, channels):
    image = codes(np.random.default_rng(1), dtype, channels)
    write_png(tmp_path / "a.png", image)
    np.testing.assert_array_equal(imagecodecs.png_decode((tmp_path / "a.png").read_bytes()), image.squeeze())
    read, spec = oiio_read(tmp_path / "a.png", image.dtype.name)
    np.testing.assert_array_equal(read, image)
    assert bytes(spec.getattribute("ICCProfile")) == profile("srgb", grey=channels == 1)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 3])
def test_tiff(tmp_path, dtype, channels):
    image = codes(np.random.default_rng(2), np.uint16, channels).astype(dtype)
    write_tiff(tmp_path / "a.tif", image, "linear")
    with tifffile.TiffFile(tmp_path / "a.tif") as tiff:
        page = tiff.pages.first
        assert page.dtype == dtype
        assert page.iccprofile == profile("linear", grey=channels == 1)
        np.testing.assert_array_equal(page.asarray(), image.squeeze())
    write_tiff(tmp_path / "data.tif", image[..., 0])
    assert tifffile.TiffFile(tmp_path / "data.tif").pages.first.iccprofile is None


@pytest.mark.parametrize(("half", "tolerance"), [(False, 0), (True, 2**-11)])
@pytest.mark.parametrize("channels", [1, 3])
def test_exr(tmp_path, half, tolerance, channels):
    image = np.random.default_rng(3).normal(size=(31, 17, channels)).astype(np.float32)
    image[0, 0] = np.nan
    write_exr(tmp_path / "a.exr", image, half=half)
    read, spec = oiio_read(tmp_path / "a.exr", "float")
    np.testing.assert_allclose(read, image, rtol=tolerance, atol=1e-6 if half else 0)
    assert spec.channelnames == (("Y",) if channels == 1 else ("R", "G", "B"))
    assert str(spec.format) == ("half" if half else "float")


def test_exr_channel_names(tmp_path):
    write_exr(tmp_path / "a.exr", np.zeros((4, 4, 2), np.float32), channel_names=("U", "V"))
    assert oiio_read(tmp_path / "a.exr", "float")[1].channelnames == ("U", "V")
    with pytest.raises(ValueError, match="2 channels need as many names"):
        write_exr(tmp_path / "a.exr", np.zeros((4, 4, 2), np.float32))


@pytest.mark.parametrize("grey", [False, True])
def test_profiles_hold_the_curves_that_they_name(grey):
    values = np.linspace(0, 1, 201)
    for name, expected in (("srgb", decode_srgb(values)), ("linear", values)):
        np.testing.assert_allclose(icc.curves(profile(name, grey)[:], values)[:, 0], expected, atol=2e-5)


def test_colour_engines_accept_the_profiles():
    red = np.zeros((1, 1, 3), np.uint16)
    red[..., 0] = 65535
    moved = imagecodecs.cms_transform(
        red, profile("linear"), profile("srgb"), colorspace="rgb", outcolorspace="rgb"
    )
    np.testing.assert_allclose(moved, red, atol=50)  # the same primaries, to 1e-3


@pytest.mark.parametrize(("name", "half"), [("srgb", 0.5), ("linear", 0.7354)])
def test_grey_profiles_are_neutral(name, half):
    grey = np.array([[0, 32768, 65535]], np.uint16)
    shown = imagecodecs.cms_transform(
        grey, profile(name, grey=True), profile("srgb"), colorspace="gray", outcolorspace="rgb"
    )
    expected = np.array([0, half, 1])[:, None] * [1, 1, 1]
    np.testing.assert_allclose(shown[0] / 65535, expected, atol=2e-3)


@pytest.mark.parametrize("writer", [write_png, write_tiff, write_exr])
def test_equal_pictures_are_equal_files(tmp_path, writer):
    image = np.zeros((8, 8, 3), np.float32 if writer is write_exr else np.uint16)
    writer(tmp_path / "a", image)
    writer(tmp_path / "b", image)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("writer", [write_png, write_tiff, write_exr])
def test_failure_leaves_nothing_behind_and_keeps_what_was_there(tmp_path, writer):
    image = np.zeros((8, 8, 3), np.float32 if writer is write_exr else np.uint16)
    with pytest.raises(OutputError, match="cannot be written"):
        writer(tmp_path / "lost" / "a.file", image)
    (tmp_path / "a.file").mkdir()  # a folder in the way makes the last step fail
    with pytest.raises(OutputError, match="cannot be written"):
        writer(tmp_path / "a.file", image)
    assert [path.name for path in tmp_path.iterdir()] == ["a.file"]


@pytest.mark.parametrize(
    ("writer", "image"),
    [
        (write_png, np.zeros((4, 4, 3), np.float32)),
        (write_png, np.zeros((4, 4, 3, 1), np.uint8)),
        (write_tiff, np.zeros((4, 4, 3), np.int64)),
        (write_exr, np.zeros((4, 4, 3), np.uint8)),
        (write_exr, np.zeros((0, 4, 3), np.float32)),
    ],
)
def test_images_that_the_format_cannot_hold(tmp_path, writer, image):
    with pytest.raises(ValueError, match="cannot be written"):
        writer(tmp_path / "a", image)
    assert not list(tmp_path.iterdir())
