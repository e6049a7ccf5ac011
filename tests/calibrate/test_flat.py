"""Flat fields, dark frames and white references, and what a stack makes of them."""

import json

import numpy as np
import pytest

import impasto
from impasto.capture.simulate import simulate
from impasto.errors import CaptureError, OptionError
from impasto.store import open_stack

BOX = (20, 20, 60, 60)


@pytest.fixture(scope="module")
def near(tmp_path_factory):
    """Return a capture of white paint by a camera that vignettes, under lamps 500 mm away."""
    folder = tmp_path_factory.mktemp("flat") / "photos"
    simulate(
        folder, preset="swatches", lights=3, size=(192, 144), light_distance_mm=500, vignetting=0.3, seed=2
    )
    return folder


@pytest.fixture(scope="module")
def lens(near):
    """Return the flat field of the lens alone, the fall-off of the lamps taken out."""
    out = near.parent / "lens.json"
    impasto.calibrate.flat(near / "calibration" / "flat", out, lights=near / "capture.toml")
    return out


def whole(store):
    stack = open_stack(store)
    _, height, width, _ = stack.shape
    return stack, stack.radiance(slice(0, height), slice(0, width))


def stacked_card(near, tmp_path, **calibration):
    """Stack the photographs of the even card as if they were the painting's."""
    photos = tmp_path / "cards"
    photos.mkdir()
    for path in (near / "calibration" / "flat").iterdir():
        (photos / path.name).write_bytes(path.read_bytes())
    (photos / "capture.toml").write_bytes((near / "capture.toml").read_bytes())
    impasto.stack(photos, tmp_path / "card.zarr", **calibration)
    return whole(tmp_path / "card.zarr")


def departure(radiance):
    """Return the largest departure of the mean over blocks of 12 x 12 pixels from the middle's level."""
    light, height, width, channels = radiance.shape
    blocks = radiance.reshape(light, height // 12, 12, width // 12, 12, channels).mean(axis=(2, 4))
    middle = blocks[:, 5:7, 7:9].mean(axis=(1, 2), keepdims=True)
    return np.abs(blocks / middle - 1).max()


def test_a_flat_field_leaves_less_than_half_a_per_cent(near, tmp_path):
    """Without positions, a card under each light corrects lens and fall-off together."""
    photos = tmp_path / "photos"
    photos.mkdir()
    for path in (near / "calibration" / "flat").iterdir():
        (photos / path.name).write_bytes(path.read_bytes())
    (photos / "lights.lp").write_bytes((near / "truth" / "lights.lp").read_bytes())
    found = impasto.calibrate.flat(near / "calibration" / "flat", tmp_path / "flat.json")
    assert found.before > 0.2
    impasto.stack(photos, tmp_path / "plain.zarr")
    impasto.stack(photos, tmp_path / "flat.zarr", flat=tmp_path / "flat.json")
    assert departure(whole(tmp_path / "plain.zarr")[1]) > 0.2
    assert departure(whole(tmp_path / "flat.zarr")[1]) < 0.005


def test_the_fall_off_of_lamps_at_known_positions_is_left_to_the_fit(near, lens, tmp_path):
    """What is left of the card is what a white diffuser under those lamps shows."""
    stack, radiance = stacked_card(near, tmp_path, flat=lens)
    height, width = radiance.shape[1:3]
    px = stack.camera.mm_per_px
    y, x = np.mgrid[:height, :width]
    place = np.stack([(x - (width - 1) / 2) * px, ((height - 1) / 2 - y) * px, np.zeros(x.shape)], axis=-1)
    for light in range(len(radiance)):
        towards = stack.lights.position_mm[light] - place
        expected = towards[..., 2] / np.linalg.norm(towards, axis=-1) ** 3
        assert departure((radiance[light] / expected[..., None])[None]) < 0.005


def test_clipped_samples_stay_clipped_wherever_the_flat_field_lifts(near, lens, tmp_path):
    import tifffile

    photos = tmp_path / "photos"
    photos.mkdir()
    (photos / "capture.toml").write_bytes((near / "capture.toml").read_bytes())
    for path in near.glob("light-*.tif"):
        image = tifffile.imread(path)
        image[3:6, 3:6] = 65535
        image[70:73, 90:93] = 65535
        tifffile.imwrite(photos / path.name, image, photometric="rgb")
    impasto.stack(photos, tmp_path / "p.zarr", flat=lens)
    stack, radiance = whole(tmp_path / "p.zarr")
    clipped = radiance >= stack.clip_level
    assert clipped[:, 3:6, 3:6].all()
    assert clipped[:, 70:73, 90:93].all()
    assert stack.clipped_samples >= 3 * 2 * 9 * 3


def test_a_flat_field_that_removes_what_the_fit_models_is_refused(near, tmp_path):
    impasto.calibrate.flat(near / "calibration" / "flat", tmp_path / "flat.json")
    with pytest.raises(CaptureError, match=r"corrects the fall-off of the lights too"):
        impasto.stack(near, tmp_path / "p.zarr", flat=tmp_path / "flat.json")


def test_calibrations_of_others_are_refused_all_at_once(near, lens, tmp_path):
    content = json.loads(lens.read_text())
    content["for"] |= {"size": [1000, 700]}
    (tmp_path / "size.json").write_text(json.dumps(content))
    dark = impasto.calibrate.dark(near / "calibration" / "dark.tif", tmp_path / "dark.json").file
    content = json.loads(dark.read_text())
    content["impasto_calibration"] = 99
    dark.write_text(json.dumps(content))
    with pytest.raises(CaptureError) as error:
        impasto.stack(near, tmp_path / "p.zarr", flat=tmp_path / "size.json", dark=dark, white=lens)
    told = str(error.value)
    assert "is for 1000 x 700 pixels, and these photographs have 192 x 144 pixels" in told
    assert "is of version 99" in told
    assert "is a calibration of kind flat, expected white" in told
    assert not (tmp_path / "p.zarr").exists()


def test_another_camera_and_iso_are_told_apart():
    from impasto.calibrate.files import Subject

    mine, theirs = Subject(camera="A 1", iso=100.0), Subject(camera="B 2", iso=400.0, size=(3, 2))
    assert mine.differences(theirs) == [
        "camera A 1, and these photographs have camera B 2",
        "ISO 100, and these photographs have ISO 400",
    ]
    assert Subject().differences(theirs) == []


def test_a_white_reference_makes_the_stack_absolute(near, lens, tmp_path):
    """Lamps of unknown strength: the light file gives positions alone."""
    plain = (near / "capture.toml").read_text()
    lines = [line for line in plain.splitlines() if not line.startswith("gain")]
    (tmp_path / "lights.toml").write_text("\n".join(lines))
    cards = near / "calibration" / "flat"
    found = impasto.calibrate.white(
        cards,
        tmp_path / "white.json",
        box=(86, 62, 106, 82),
        lights=tmp_path / "lights.toml",
        reflectance=1.0,
    )
    assert found.lights == 3
    np.testing.assert_allclose(found.light_rgb, 1, atol=2e-3)
    photos = tmp_path / "photos"
    photos.mkdir()
    for path in near.glob("light-*.tif"):
        (photos / path.name).write_bytes(path.read_bytes())
    (photos / "capture.toml").write_bytes((tmp_path / "lights.toml").read_bytes())
    summary = impasto.stack(photos, tmp_path / "w.zarr", white=found.file, flat=lens)
    assert any(
        "colours" in note and "scale" not in note for note in summary.notes if "not calibrated" in note
    )
    stack, radiance = whole(tmp_path / "w.zarr")
    assert stack.absolute
    assert stack.light_rgb_source == "white reference"
    # The simulator's own statement: 1 for a white diffuser that faces a light of intensity 1.
    impasto.stack(near, tmp_path / "stated.zarr", flat=lens)
    stated, expected = whole(tmp_path / "stated.zarr")
    assert not stated.absolute
    usable = expected < stated.clip_level
    gain = np.broadcast_to(stated.lights.intensity[:, None, None, :], expected.shape)
    usable &= expected > 0.01
    ratio = radiance[usable] * gain[usable] / expected[usable]
    assert np.median(ratio) == pytest.approx(1, abs=0.01)


def test_what_is_not_calibrated_is_said(near, tmp_path):
    summary = impasto.stack(near, tmp_path / "p.zarr")
    (note,) = [note for note in summary.notes if note.startswith("not calibrated")]
    assert "vignetting" in note
    assert "albedo, gloss and κ are relative" in note
    assert "the camera's colours" in note


def test_bad_cards_and_boxes_are_named(near, tmp_path):
    cards = near / "calibration"
    with pytest.raises(CaptureError, match=r"dark.tif: reads .* of full scale"):
        impasto.calibrate.flat(cards / "dark.tif", tmp_path / "f.json")
    with pytest.raises(CaptureError, match="expected less than 5%"):
        impasto.calibrate.dark(cards / "white_card.tif", tmp_path / "d.json")
    with pytest.raises(OptionError) as error:
        impasto.calibrate.white(
            cards / "flat",
            tmp_path / "w.json",
            box=(0, 0, 999, 9),
            lights=near / "capture.toml",
            reflectance=7,
        )
    assert len(error.value.problems) == 2


def test_a_dark_level_that_differs_over_the_frame_does_not_tilt_the_flat_field(tmp_path):
    import tifffile

    rising = np.linspace(0.01, 0.05, 300)[None, :, None] * np.ones((200, 300, 3))
    for name, image in (("dark", rising), ("card", 0.5 + rising)):
        tifffile.imwrite(tmp_path / f"{name}.tif", np.uint16(65535 * image), photometric="rgb")
    impasto.calibrate.dark(tmp_path / "dark.tif", tmp_path / "dark.json")
    for dark in ("dark.tif", "dark.json"):
        found = impasto.calibrate.flat(tmp_path / "card.tif", tmp_path / "f.json", dark=tmp_path / dark)
        assert found.before < 1e-3
