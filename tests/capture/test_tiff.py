"""TIFF photographs of all layouts, read in bands."""

import numpy as np
import pytest
import tifffile

from impasto.capture.photographs import read_photograph
from impasto.errors import CaptureError

HEIGHT, WIDTH = 37, 53
LAYOUTS = {
    "one strip": {"rowsperstrip": HEIGHT},
    "strips": {"rowsperstrip": 5},
    "tiles": {"tile": (16, 32)},
}


def pixels_of(rng, dtype, channels):
    shape = (HEIGHT, WIDTH, channels) if channels > 1 else (HEIGHT, WIDTH)
    if np.dtype(dtype).kind == "f":
        return rng.normal(size=shape).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, size=shape, dtype=dtype, endpoint=True)


def write(path, pixels, **options):
    options.setdefault("photometric", "rgb" if pixels.ndim == 3 else "minisblack")
    tifffile.imwrite(path, pixels, metadata=None, **options)
    return path


def read(path, rows):
    photograph, _ = read_photograph(path)
    bands = list(photograph.bands(rows))
    starts = [row0 for row0, _ in bands]
    assert starts == list(range(0, photograph.height, rows))
    assert all(len(band) == rows for _, band in bands[:-1])
    whole = np.concatenate([band for _, band in bands])
    assert whole.shape == (photograph.height, photograph.width, photograph.channels)
    assert whole.dtype == photograph.dtype
    assert whole.dtype.isnative
    return whole


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("compression", [None, "lzw", "zlib", "zstd"])
@pytest.mark.parametrize(
    ("dtype", "channels"), [("uint8", 3), ("uint16", 3), ("float32", 3), ("uint16", 1), ("float16", 1)]
)
def test_layouts_and_compressions(tmp_path, rng, layout, compression, dtype, channels):
    pixels = pixels_of(rng, dtype, channels)
    path = write(tmp_path / "a.tif", pixels, compression=compression, **LAYOUTS[layout])
    expected = pixels.reshape(HEIGHT, WIDTH, channels)
    for rows in (1, 7, 16, 1000):
        np.testing.assert_array_equal(read(path, rows), expected)


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("variant", ["big-endian", "planes", "predictor", "BigTIFF", "alpha", "grey alpha"])
def test_variants(tmp_path, rng, variant, layout, compression):
    pixels = pixels_of(rng, "uint16", {"alpha": 4, "grey alpha": 2}.get(variant, 3))
    expected = pixels[..., :1] if variant == "grey alpha" else pixels[..., :3]
    options = {
        "big-endian": {"byteorder": ">"},
        "planes": {"planarconfig": "separate"},
        "predictor": {"predictor": bool(compression)},
        "BigTIFF": {"bigtiff": True},
        "alpha": {"extrasamples": ["unassalpha"]},
        "grey alpha": {"extrasamples": ["unassalpha"], "photometric": "minisblack"},
    }[variant]
    stored = np.moveaxis(pixels, -1, 0) if variant == "planes" else pixels
    if variant == "grey alpha":
        options["planarconfig"] = "contig"
    path = write(tmp_path / "a.tif", stored, compression=compression, **options, **LAYOUTS[layout])
    for rows in (6, 1000):
        np.testing.assert_array_equal(read(path, rows), expected)
    assert (read_photograph(path)[1].count("alpha channel left out") == 1) == ("alpha" in variant)


def test_floating_point_predictor_and_double_precision(tmp_path, rng):
    pixels = pixels_of(rng, "float32", 3)
    write(tmp_path / "a.tif", pixels, compression="zstd", predictor=3, rowsperstrip=5)
    np.testing.assert_array_equal(read(tmp_path / "a.tif", 10), pixels)
    write(tmp_path / "b.tif", pixels.astype(np.float64))
    np.testing.assert_array_equal(read(tmp_path / "b.tif", 10), pixels)


def test_jpeg_inside_tiff(tmp_path):
    ramp = np.broadcast_to(np.linspace(0, 255, 64, dtype=np.uint8)[:, None, None], (64, 64, 3)).copy()
    path = write(tmp_path / "a.tif", ramp, compression="jpeg", rowsperstrip=16, subsampling=(2, 2))
    assert np.abs(read(path, 20).astype(int) - ramp).max() < 12


def test_unit_rows_say_what_is_decoded_at_once(tmp_path, rng):
    pixels = pixels_of(rng, "uint16", 3)

    def unit_rows(**options):
        return read_photograph(write(tmp_path / "a.tif", pixels, **options))[0].unit_rows

    assert unit_rows(rowsperstrip=HEIGHT) == 1  # uncompressed rows can be read one by one
    assert unit_rows(rowsperstrip=5, compression="zlib") == 5
    assert unit_rows(rowsperstrip=HEIGHT, compression="zlib") == HEIGHT
    assert unit_rows(tile=(16, 16), compression="zlib") == 16


def test_exposure_orientation_and_pages(tmp_path, rng):
    path = tmp_path / "a.tif"
    pixels = pixels_of(rng, "uint16", 3)
    tags = [(33434, "2I", 1, (1, 60), True), (33437, "2I", 1, (80, 10), True), (274, "H", 1, 6, True)]
    with tifffile.TiffWriter(path) as writer:
        writer.write(pixels, photometric="rgb", extratags=tags, metadata=None)
        writer.write(pixels[::2, ::2], photometric="rgb", metadata=None)
    photograph, notes = read_photograph(path)
    assert photograph.exposure_s == pytest.approx(1 / 60)
    assert photograph.f_number == pytest.approx(8)
    assert photograph.iso is None
    assert (photograph.height, photograph.width) == (HEIGHT, WIDTH)
    assert any("orientation 6" in note and "without turning" in note for note in notes)
    assert "only the first of 2 pages read" in notes


@pytest.mark.parametrize("compression", [None, "lzw", "zlib", "zstd"])
def test_truncated_file_is_refused_before_decoding(tmp_path, rng, compression):
    path = write(tmp_path / "cut.tif", pixels_of(rng, "uint16", 3), compression=compression, rowsperstrip=5)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(CaptureError, match=r"cut\.tif: is cut off: it should have \d+ bytes"):
        read_photograph(path)


@pytest.mark.parametrize("compression", [None, "zlib", "zstd"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_truncation_shows_while_decoding(tmp_path, rng, compression, layout):
    path = write(
        tmp_path / "bad.tif", pixels_of(rng, "uint16", 3), compression=compression, **LAYOUTS[layout]
    )
    photograph, _ = read_photograph(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(CaptureError, match=r"bad\.tif: .* Copy it again"):
        list(photograph.bands(10))


def test_file_replaced_after_its_header_was_read(tmp_path, rng):
    path = write(tmp_path / "a.tif", pixels_of(rng, "uint16", 3))
    photograph, _ = read_photograph(path)
    path.write_bytes(b"II*\0")
    with pytest.raises(CaptureError, match=r"a\.tif: has changed since its header was read"):
        list(photograph.bands(10))
    path.unlink()
    with pytest.raises(CaptureError, match=r"a\.tif: cannot be read: .*No such file"):
        list(photograph.bands(10))


def test_damage_shows_while_decoding(tmp_path, rng):
    path = write(tmp_path / "bad.tif", pixels_of(rng, "uint16", 3), compression="zlib", rowsperstrip=5)
    photograph, _ = read_photograph(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2 : len(content) // 2 + 50] = b"\xaa" * 50
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=r"bad\.tif: cannot be decoded at strip or tile \d"):
        list(photograph.bands(10))


def test_strips_that_were_never_written_are_refused(tmp_path, rng):
    path = write(tmp_path / "a.tif", pixels_of(rng, "uint8", 3), compression="zlib", rowsperstrip=5)
    with tifffile.TiffFile(path, mode="r+b") as tiff:
        tag = tiff.pages.first.tags["StripByteCounts"]
        tag.overwrite((*tag.value[:-1], 0))
    with pytest.raises(CaptureError, match="lacks 1 of its 8 strips"):
        read_photograph(path)


@pytest.mark.parametrize(
    ("pixels", "options", "reason"),
    [
        (np.zeros((8, 8, 4), np.uint8), {"photometric": "separated"}, "SEPARATED pixels"),
        (np.zeros((8, 8), np.uint8), {"photometric": "miniswhite"}, "MINISWHITE pixels"),
        (np.zeros((8, 8), np.int16), {}, "int16"),
        (np.zeros((8, 8), bool), {}, "1-bit"),
    ],
    ids=["CMYK", "white is zero", "signed", "bits"],
)
def test_other_kinds_of_tiff_are_refused(tmp_path, pixels, options, reason):
    path = write(tmp_path / "a.tif", pixels, **options)
    with pytest.raises(CaptureError, match=reason):
        read_photograph(path)


@pytest.mark.parametrize("content", [b"", b"II*\0", b"II*\0\xff\xff\xff\x7f", b"\xff\xd8\xff not a TIFF"])
def test_not_a_tiff(tmp_path, content):
    (tmp_path / "a.tif").write_bytes(content)
    with pytest.raises(CaptureError, match=r"a\.tif: is not a readable TIFF file"):
        read_photograph(tmp_path / "a.tif")
