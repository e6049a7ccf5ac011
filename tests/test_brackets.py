"""Exposures of one light merged into one radiance."""

import numpy as np
import pytest
import tifffile

import impasto
from impasto.capture.simulate import simulate
from impasto.capture.simulate.camera import Sensor
from impasto.errors import CaptureError
from impasto.stack.brackets import merge
from impasto.store import open_stack


@pytest.fixture(scope="module")
def bracketed(tmp_path_factory):
    """Return a capture of a glossy sample with three shorter exposures."""
    folder = tmp_path_factory.mktemp("brackets") / "photos"
    simulate(folder, sample="e", size=(96, 80), lights=5, brackets=3, exposure=1.0, calibration=False)
    return folder


def folders(bracketed):
    return sorted((bracketed / "brackets").iterdir(), key=lambda path: -int(path.name.removeprefix("ev")))


def test_merged_radiance_is_right_within_a_per_cent_over_four_decades():
    """Means of 4096 pixels each, from four exposures two stops apart and a fifth six stops shorter."""
    sensor = Sensor(exposure=1.0)
    rng = np.random.default_rng(1)
    truth = np.geomspace(3e-4, 30, 60, dtype=np.float32)
    image = np.repeat(truth[:, None], 4096, axis=1)[..., None]
    times = [2.0**ev for ev in (0, -2, -4, -6)]
    shots = []
    for time in times:
        codes = sensor.expose(image, rng, np.log2(time))
        shots.append(np.where(codes >= 0.99 * 65535, np.inf, codes / 65535).astype(np.float32))
    merged = merge(shots, times, sensor.read, sensor.photon)
    assert truth.max() / truth.min() > 1e4
    mean = merged.mean(axis=(1, 2))
    assert np.abs(mean / truth - 1).max() < 0.01


def test_a_stack_of_brackets_shows_highlights_that_one_exposure_clips(bracketed, tmp_path):
    impasto.stack(bracketed, tmp_path / "one.zarr")
    impasto.stack(bracketed, tmp_path / "all.zarr", brackets=folders(bracketed))
    one, merged = open_stack(tmp_path / "one.zarr"), open_stack(tmp_path / "all.zarr")
    assert merged.dtype == np.float32
    assert one.clipped_samples > 0
    assert merged.clipped_samples < one.clipped_samples / 4
    rows, columns = slice(0, 80), slice(0, 96)
    a, b = one.radiance(rows, columns), merged.radiance(rows, columns)
    usable = (a < one.clip_level) & (a > 0.02)
    assert np.median(np.abs(b / a - 1)[usable]) < 0.01
    # Where one exposure clips, a shorter one says what is there.
    shorter = (
        np.stack([tifffile.imread(path) for path in sorted(folders(bracketed)[0].glob("*.tif"))]) / 65535
    )
    lost = (a >= one.clip_level) & (shorter < 0.9)
    assert lost.sum() > 100
    assert np.abs(b[lost] / (4 * shorter[lost]) - 1).max() < 0.05
    assert np.median(np.abs(b[lost] / (4 * shorter[lost]) - 1)) < 0.01


def test_fits_take_a_stack_of_brackets(bracketed, tmp_path):
    impasto.stack(bracketed, tmp_path / "all.zarr", brackets=folders(bracketed))
    impasto.fit(tmp_path / "all.zarr", models=["torrance-sparrow"])


def test_a_run_of_brackets_is_taken_up_and_a_changed_exposure_seen(bracketed, tmp_path):
    first = impasto.stack(bracketed, tmp_path / "p.zarr", brackets=folders(bracketed)[:1])
    again = impasto.stack(bracketed, tmp_path / "p.zarr", brackets=folders(bracketed)[:1])
    assert not first.already
    assert again.already


def test_a_wrong_exposure_time_is_found(bracketed, tmp_path):
    wrong = tmp_path / "ev-2"
    wrong.mkdir()
    for path in folders(bracketed)[0].iterdir():
        (wrong / path.name).write_bytes(path.read_bytes())
    text = (wrong / "capture.toml").read_text()
    head, tail = text.split('file = "light-002.tif"')
    (wrong / "capture.toml").write_text(
        head + 'file = "light-002.tif"' + tail.replace("exposure_s = 0.025", "exposure_s = 0.05", 1)
    )
    with pytest.raises(
        CaptureError, match=r"light-002.tif: is stated to be exposed 0.5 times .* say 0.2[45]"
    ) as error:
        impasto.stack(bracketed, tmp_path / "p.zarr", brackets=[wrong])
    assert len(error.value.problems) == 1


def test_missing_exposures_are_listed(bracketed, tmp_path):
    short = tmp_path / "short"
    short.mkdir()
    image = tifffile.imread(bracketed / "light-000.tif")
    tifffile.imwrite(short / "light-000.tif", image, photometric="rgb")
    with pytest.raises(CaptureError) as error:
        impasto.stack(bracketed, tmp_path / "p.zarr", brackets=[short])
    assert "holds no exposure of light-001" in str(error.value)
    assert "has no exposure time" in str(error.value)
    assert len(error.value.problems) == 5
