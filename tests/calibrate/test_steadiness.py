"""Shifts between photographs, and stray light."""

import numpy as np
import pytest
import tifffile
from scipy.ndimage import shift

import impasto
from impasto.capture.simulate import simulate
from impasto.errors import CaptureError, OptionError


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steady") / "photos"
    simulate(folder, lights=8, size=(200, 160), calibration=False, seed=4)
    return folder


def moved(series, out, shifts):
    """Copy the photographs, each shifted to the right and down by so many pixels."""
    out.mkdir()
    for number, (columns, rows) in enumerate(shifts):
        image = tifffile.imread(series / f"light-{number:03d}.tif").astype(float)
        image = shift(image, (rows, columns, 0), order=3, mode="nearest")
        codes = np.clip(np.rint(image), 0, 65535).astype(np.uint16)
        tifffile.imwrite(out / f"light-{number:03d}.tif", codes, photometric="rgb")
    return out


def test_a_camera_that_stands_still_is_said_to(series, tmp_path):
    found = impasto.calibrate.steadiness(series, tmp_path / "s.json")
    assert found.moved == ()
    assert found.bumped == ""


def test_a_bump_is_found_and_named(series, tmp_path):
    shifts = [(0, 0)] * 5 + [(2.4, -1.3)] * 3
    found = impasto.calibrate.steadiness(moved(series, tmp_path / "p", shifts), tmp_path / "s.json")
    assert found.bumped == "light-005"
    step = np.median(found.shift_px[5:], axis=0) - np.median(found.shift_px[:5], axis=0)
    np.testing.assert_allclose(step, [2.4, -1.3], atol=0.3)


def test_one_photograph_off_is_named(series, tmp_path):
    shifts = [(0, 0)] * 8
    shifts[3] = (-3.0, 2.0)
    found = impasto.calibrate.steadiness(moved(series, tmp_path / "p", shifts), tmp_path / "s.json")
    assert found.moved == ("light-003",)
    assert found.bumped == ""


def test_a_series_needs_three_photographs(series, tmp_path):
    with pytest.raises(CaptureError, match="fewer than three"):
        impasto.calibrate.steadiness(series / "light-000.tif", tmp_path / "s.json")


def test_stray_light_is_the_trap_s_share_of_the_surround(tmp_path):
    """A lens that adds 1.5 % of the white card everywhere, and a sensor that reads 0.2 % without light."""
    image = np.full((80, 120, 3), 0.6)
    image[30:50, 50:70] = 0
    image = 0.002 + image + 0.015 * 0.6
    tifffile.imwrite(tmp_path / "trap.tif", np.rint(image * 65535).astype(np.uint16), photometric="rgb")
    black = np.full((80, 120, 3), round(0.002 * 65535), np.uint16)
    tifffile.imwrite(tmp_path / "cap.tif", black, photometric="rgb")
    found = impasto.calibrate.glare(
        tmp_path / "trap.tif", trap=(52, 32, 68, 48), bright=(5, 5, 40, 75), dark=tmp_path / "cap.tif"
    )
    np.testing.assert_allclose(found.share, 0.015 / 1.015, rtol=0.01)
    assert found.much
    with pytest.raises(OptionError, match="--trap: is no box"):
        impasto.calibrate.glare(tmp_path / "trap.tif", trap=(0, 0, 500, 1), bright=(5, 5, 40, 75))
