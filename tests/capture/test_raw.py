"""Raw files, written here as DNG and read by LibRaw."""

import json

import numpy as np
import pytest

import impasto
from impasto.capture import read_capture
from impasto.capture.photographs import read_photograph
from impasto.capture.simulate.dng import BLACK_LEVEL, WHITE_LEVEL, write_dng
from impasto.errors import CaptureError
from impasto.images import write_jpeg


def decoded(path, rows=1000):
    photograph, _ = read_photograph(path)
    return photograph, np.concatenate([band for _, band in photograph.bands(rows)])


def test_levels_and_colours_of_the_mosaic_come_back(tmp_path):
    """Black is subtracted, white is 65535, and the colours stay apart: no white balance, no matrix."""
    image = np.empty((60, 80, 3), np.uint16)
    image[:] = [5000, 20000, 60000]
    write_dng(tmp_path / "flat.dng", image)
    photograph, values = decoded(tmp_path / "flat.dng")
    assert (photograph.height, photograph.width, photograph.channels) == (60, 80, 3)
    assert photograph.transfer == "linear"
    # Half a step of the sensor's 14 bits, and LibRaw rounds down.
    np.testing.assert_allclose(values, image, atol=0.5 * 65535 / (WHITE_LEVEL - BLACK_LEVEL) + 1)


def test_the_mosaic_is_interpolated_linearly(tmp_path):
    y, x = np.mgrid[:60, :80]
    image = np.stack([2000 + 300 * x, 3000 + 200 * y, 1000 + 150 * (x + y)], axis=-1).astype(np.uint16)
    write_dng(tmp_path / "ramp.dng", image)
    _, values = decoded(tmp_path / "ramp.dng", rows=7)
    inner = slice(2, -2)
    np.testing.assert_allclose(values[inner, inner], image[inner, inner], atol=6)


def test_a_saturated_photosite_clips_the_samples_that_come_from_it(tmp_path):
    image = np.full((40, 40, 3), 30000, np.uint16)
    image[20, 20, 0] = 65535  # a red site: even row, even column
    image[10, 10, 1] = 65535  # a red site too, so its green is not seen
    write_dng(tmp_path / "spark.dng", image)
    _, values = decoded(tmp_path / "spark.dng")
    clipped = np.argwhere(values == 65535)
    assert {tuple(place) for place in clipped} == {(y, x, 0) for y in (19, 20, 21) for x in (19, 20, 21)}


def test_what_the_camera_noted_is_kept(tmp_path):
    write_dng(tmp_path / "one.dng", np.full((40, 40, 3), 9000, np.uint16), exposure_s=1 / 60)
    photograph, _ = read_photograph(tmp_path / "one.dng")
    assert photograph.exposure_s == pytest.approx(1 / 60, rel=1e-4)
    assert photograph.iso == 100
    assert photograph.camera == "impasto simulated camera"


@pytest.mark.parametrize("damage", ["cut", "text", "empty"])
def test_damaged_raw_files_are_named(tmp_path, damage):
    path = tmp_path / "bad.dng"
    write_dng(path, np.full((80, 80, 3), 9000, np.uint16))
    data = path.read_bytes()
    path.write_bytes({"cut": data[: len(data) // 2], "text": b"not a raw file", "empty": b""}[damage])
    with pytest.raises(CaptureError) as error:
        decoded(path)
    assert error.value.problems[0].where == "bad.dng"


def test_simulated_raw_files_go_through_the_pipeline(tmp_path):
    impasto.simulate(
        tmp_path / "photos", preset="swatches", dome=True, lights=14, size=(64, 48), format="dng"
    )
    assert len(list((tmp_path / "photos").glob("*.dng"))) == 14
    # Cameras write previews beside their raw files.
    preview = np.zeros((48, 64, 3), np.uint8)
    for path in list((tmp_path / "photos").glob("*.dng")):
        write_jpeg(path.with_suffix(".jpg"), preview)
    assert any("14 JPEG files" in note for note in read_capture(tmp_path / "photos").notes)
    store = tmp_path / "painting.zarr"
    impasto.stack(tmp_path / "photos", store)
    attributes = json.loads((store / "stack" / "zarr.json").read_text())["attributes"]
    assert attributes["inputs"][0]["camera"] == "impasto simulated camera"
    summary = impasto.fit(store, models=["torrance-sparrow"])
    assert summary.models[0].pixels.get("converged", 0) > 0.5 * 64 * 48


def test_half_size_takes_one_pixel_per_four_photosites(tmp_path):
    """Each colour is that of its own photosites, and a saturated one clips its colour in its pixel alone."""
    y, x = np.mgrid[:60, :80]
    image = np.stack([2000 + 300 * x, 3000 + 200 * y, 1000 + 150 * (x + y)], axis=-1).astype(np.uint16)
    image[20, 30, 0] = 65535
    write_dng(tmp_path / "half.dng", image)
    photograph, _ = read_photograph(tmp_path / "half.dng")
    half = photograph.halved()
    assert (half.height, half.width) == (30, 40)
    values = np.concatenate([band for _, band in half.bands(7)])
    assert [tuple(place) for place in np.argwhere(values == 65535)] == [(10, 15, 0)]
    green = (image[::2, 1::2, 1].astype(float) + image[1::2, ::2, 1]) / 2
    np.testing.assert_allclose(values[..., 1], green, atol=6)
    np.testing.assert_allclose(values[..., 2], image[1::2, 1::2, 2], atol=6)


def test_a_stack_at_half_size_has_pixels_twice_as_large(tmp_path):
    from impasto.capture.simulate import simulate

    photos = tmp_path / "photos"
    simulate(photos, preset="swatches", size=(48, 40), lights=3, format="dng", calibration=False)
    impasto.stack(photos, tmp_path / "p.zarr", half_size=True)
    stack = impasto.open(tmp_path / "p.zarr")["stack"]
    assert stack["radiance"].shape == (3, 20, 24, 3)
    assert stack.attrs["camera"]["mm_per_px"] == pytest.approx(2 * 100 / 40)
    simulate(tmp_path / "tiffs", preset="swatches", size=(48, 40), lights=3, calibration=False)
    with pytest.raises(CaptureError, match="is no raw file"):
        impasto.stack(tmp_path / "tiffs", tmp_path / "q.zarr", half_size=True)
