"""EXR, PNG and JPEG photographs, read in bands."""

import struct
from itertools import pairwise

import numpy as np
import OpenImageIO as oiio
import pytest
from png_files import chunk, png

from icc_profiles import rgb, sampled_curve
from impasto.capture.photographs import read_photograph
from impasto.errors import CaptureError

HEIGHT, WIDTH = 75, 53


def write(path, pixels, kind, channels=None, attributes=(), **changed):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if channels:
        spec.channelnames = channels
    for key, value in changed.items():
        setattr(spec, key, value)
    for attribute in attributes:
        spec.attribute(*attribute)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    done = output.write_tiles if spec.tile_width else output.write_scanlines
    if spec.tile_width:
        assert done(spec.x, spec.x + spec.width, spec.y, spec.y + spec.height, 0, 1, pixels)
    else:
        assert done(spec.y, spec.y + spec.height, 0, pixels), output.geterror()
    assert output.close()
    return path


def read(path, rows):
    photograph, _ = read_photograph(path)
    bands = list(photograph.bands(rows))
    assert [row0 for row0, _ in bands] == list(range(0, photograph.height, rows))
    assert all(len(band) == rows for _, band in bands[:-1])
    whole = np.concatenate([band for _, band in bands])
    assert whole.shape == (photograph.height, photograph.width, photograph.channels)
    assert whole.dtype == photograph.dtype
    return whole


@pytest.mark.parametrize("compression", ["none", "zips", "zip", "piz"])
@pytest.mark.parametrize("tile", [0, 16])
@pytest.mark.parametrize(("kind", "channels"), [("half", "RGB"), ("float", "RGB"), ("float", "Y")])
def test_exr(tmp_path, rng, kind, channels, tile, compression):
    pixels = rng.normal(size=(HEIGHT, WIDTH, len(channels))).astype(np.float16).astype(np.float32)
    size = {"tile_width": tile, "tile_height": tile}
    path = write(tmp_path / "a.exr", pixels, kind, tuple(channels), [("compression", compression)], **size)
    for rows in (1, 20, 1000):
        np.testing.assert_array_equal(read(path, rows), pixels)
    assert read_photograph(path)[0].transfer == "linear"


def test_exr_keeps_missing_samples_and_large_values(tmp_path):
    pixels = np.array([[[np.nan], [np.inf], [-1.0], [1e6]]], np.float32)
    np.testing.assert_array_equal(read(write(tmp_path / "a.exr", pixels, "float", ("Y",)), 10), pixels)


def test_exr_channels_beside_the_colours_are_left_out(tmp_path, rng):
    pixels = rng.normal(size=(HEIGHT, WIDTH, 5)).astype(np.float32)
    path = write(tmp_path / "a.exr", pixels, "float", ("R", "G", "B", "A", "Z"))
    np.testing.assert_array_equal(read(path, 20), pixels[..., :3])
    assert "channels A, Z left out" in read_photograph(path)[1]


@pytest.mark.parametrize(
    ("channels", "changed", "reason"),
    [
        (("U", "V"), {}, "has the channels U, V"),
        (("R", "G"), {"full_width": 2 * WIDTH}, "data window"),
    ],
)
def test_other_kinds_of_exr_are_refused(tmp_path, channels, changed, reason):
    pixels = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    path = write(tmp_path / "a.exr", pixels, "float", channels, **changed)
    with pytest.raises(CaptureError, match=reason):
        read_photograph(path)


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png(tmp_path, rng, dtype, channels, interlaced):
    pixels = rng.integers(0, np.iinfo(dtype).max, (HEIGHT, WIDTH, channels), dtype, endpoint=True)
    path = tmp_path / "a.png"
    path.write_bytes(png(pixels, interlaced=interlaced))
    # Colours stay as they are under any alpha, and 16 bits stay 16.
    expected = pixels[..., :1] if channels < 3 else pixels[..., :3]
    for rows in (20, 1000):
        np.testing.assert_array_equal(read(path, rows), expected)
    photograph, notes = read_photograph(path)
    assert photograph.unit_rows == (HEIGHT if interlaced else 1)
    assert ("alpha channel left out" in notes) == (channels in (2, 4))


@pytest.mark.parametrize(
    ("dtype", "extra", "transfer"),
    [
        (np.uint8, b"", "srgb"),
        (np.uint16, b"", "linear"),
        (np.uint16, chunk(b"sRGB", b"\0"), "srgb"),
        (np.uint8, chunk(b"gAMA", struct.pack(">I", 100000)), "linear"),
        (np.uint8, chunk(b"gAMA", struct.pack(">I", 50000)), "gamma:2"),
        (np.uint8, chunk(b"sRGB", b"\0") + chunk(b"gAMA", struct.pack(">I", 45455)), "srgb"),
    ],
)
def test_png_transfer_function(tmp_path, dtype, extra, transfer):
    path = tmp_path / "a.png"
    path.write_bytes(png(np.zeros((4, 4, 3), dtype), extra=extra))
    photograph, notes = read_photograph(path)
    assert photograph.transfer == transfer
    assert notes[0].startswith(f"decoded as {transfer} (")


def smooth(channels=3):
    ramp = np.linspace(0, 255, 320 * 400).reshape(320, 400).astype(np.uint8)
    return np.stack([ramp] * channels, axis=-1)


@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg(tmp_path, channels):
    path = write(tmp_path / "a.jpg", smooth(channels), "uint8", attributes=[("CompressionQuality", 98)])
    expected = oiio.ImageInput.open(str(path)).read_image("uint8")
    for rows in (1, 64, 1000):
        np.testing.assert_array_equal(read(path, rows), expected)
    assert np.abs(read(path, 1000).astype(int) - smooth(channels)).max() < 8


def test_progressive_jpeg_is_decoded_as_a_whole(tmp_path):
    assert read_photograph(write(tmp_path / "a.jpg", smooth(), "uint8"))[0].unit_rows == 1
    path = write(tmp_path / "b.jpg", smooth(), "uint8", attributes=[("jpeg:progressive", 1)])
    assert read_photograph(path)[0].unit_rows == 320
    np.testing.assert_array_equal(read(path, 64), oiio.ImageInput.open(str(path)).read_image("uint8"))


def test_exposure_profile_and_orientation(tmp_path):
    profile = rgb(sampled_curve(np.linspace(0, 1, 50) ** 2), name="Wide")
    path = write(
        tmp_path / "a.jpg",
        smooth(),
        "uint8",
        attributes=[
            ("ExposureTime", 1 / 60),
            ("FNumber", 8.0),
            ("Exif:PhotographicSensitivity", 200),
            ("Orientation", 3),
            ("ICCProfile", f"uint8[{len(profile)}]", np.frombuffer(profile, np.uint8)),
        ],
    )
    photograph, notes = read_photograph(path)
    assert photograph.exposure_s == pytest.approx(1 / 60, rel=1e-3)
    assert photograph.f_number == pytest.approx(8)
    assert photograph.iso == 200
    assert photograph.transfer == "icc:Wide"
    assert photograph.icc_profile == profile
    assert any("orientation 3" in note for note in notes)
    stated, _ = read_photograph(path, transfer="srgb")
    assert stated.transfer == "srgb"


def test_profile_that_no_table_can_stand_for(tmp_path):
    profile = rgb(sampled_curve([0, 1])).replace(b"rTRC", b"A2B0")
    attributes = [("ICCProfile", f"uint8[{len(profile)}]", np.frombuffer(profile, np.uint8))]
    path = write(tmp_path / "a.jpg", smooth(), "uint8", attributes=attributes)
    with pytest.raises(CaptureError, match=r"a\.jpg: .*look-up tables.*state transfer"):
        read_photograph(path)
    assert read_photograph(path, transfer="gamma:1.8")[0].transfer == "gamma:1.8"


def written(tmp_path, ending, rng):
    noise = rng.integers(0, 255, (320, 400, 3)).astype(np.uint8)
    kind = "float" if ending == ".exr" else "uint8"
    pixels = noise.astype(np.float32) if ending == ".exr" else noise
    return write(tmp_path / f"cut{ending}", pixels, kind)


@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_missing_end_is_noticed_before_decoding(tmp_path, rng, ending):
    path = written(tmp_path, ending, rng)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(CaptureError, match=rf"cut\{ending}: is cut off"):
        read_photograph(path)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".exr"])
@pytest.mark.parametrize("rows", [40, 1000])
def test_truncation_shows_while_decoding(tmp_path, rng, ending, rows):
    path = written(tmp_path, ending, rng)
    photograph, _ = read_photograph(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(CaptureError, match=rf"cut\{ending}: cannot be (decoded|opened)"):
        list(photograph.bands(rows))


def test_truncated_jpeg_with_an_end_marker_shows_while_decoding(tmp_path, rng):
    """The library returns full arrays here, and reports nothing on the reads after the one at the end."""
    path = written(tmp_path, ".jpg", rng)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2] + b"\xff\xd9")
    photograph, _ = read_photograph(path)
    starts = []
    with pytest.raises(CaptureError, match=r"cut\.jpg: cannot be decoded in rows \d+ to \d+ of 320"):
        starts += [row0 for row0, _ in photograph.bands(16)]
    assert all(after > before for before, after in pairwise(starts))


@pytest.mark.parametrize("ending", [".png", ".jpg", ".jpeg", ".exr"])
@pytest.mark.parametrize("content", [b"", b"not a picture" * 100])
def test_not_a_picture(tmp_path, ending, content):
    path = tmp_path / f"a{ending}"
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=rf"a\{ending}: "):
        read_photograph(path)
