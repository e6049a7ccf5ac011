"""The classic colour target found by itself: turned, tilted, spoilt, and not there."""

import csv
import json

import numpy as np
import pytest
import tifffile
from tests.calibrate.shots import take_shots
from tests.calibrate.targets import painting, photograph, scattered
from typer.testing import CliRunner

import impasto
from impasto.calibrate.find_target import find_target
from impasto.calibrate.known_targets import KNOWN_TARGETS
from impasto.calibrate.patches import read_patches
from impasto.capture.simulate.charts import colour_chart
from impasto.cli.commands import app
from impasto.errors import CaptureError, OptionError

CLASSIC = KNOWN_TARGETS["classic"]


def assert_found(radiance, middles):
    """Each box lies about its own patch's middle, which no other patch's is near."""
    found = find_target(radiance, "chart", CLASSIC)
    assert found.names == colour_chart().names
    boxes = np.array(found.boxes, float)
    centres = (boxes[:, :2] + boxes[:, 2:] - 1) / 2
    step = np.hypot(*(middles[1] - middles[0]))
    assert np.hypot(*(centres - middles).T).max() < 0.06 * step
    assert (boxes[:, 2:] - boxes[:, :2]).min() > 0.3 * step
    return found


@pytest.mark.parametrize("angle", [-10, 0, 10])
@pytest.mark.parametrize("turns", range(4))
def test_it_is_found_in_all_orientations(turns, angle):
    assert_found(*photograph(turns=turns, angle_deg=angle))


@pytest.mark.parametrize("turns", range(4))
def test_it_is_found_in_perspective(turns):
    assert_found(*photograph(turns=turns, angle_deg=5, perspective=0.25))


@pytest.mark.parametrize(
    "spoilt", [{"noise": 0.03}, {"gain": (0.05, 0.09, 0.02)}, {"around": 0.031}, {"haze": 0.15}]
)
def test_it_is_found_in_noise_in_the_dark_on_a_black_ground_and_in_haze(spoilt):
    assert_found(*photograph(**spoilt))


def test_the_boxes_hold_one_patch_only():
    """What is read in each is the patch's own reflectance, under even light, of a camera without noise."""
    radiance, _ = photograph(turns=1, angle_deg=8, perspective=0.2, gain=(1, 1, 1), noise=0)
    found = find_target(radiance, "chart", CLASSIC)
    light = 1 + 0.2 * np.arange(radiance.shape[1]) / radiance.shape[1]
    even = radiance / light[None, :, None]
    for (left, top, right, bottom), known in zip(found.boxes, colour_chart().reflectance, strict=True):
        np.testing.assert_allclose(even[top:bottom, left:right] - known, 0, atol=0.005)


@pytest.mark.parametrize("turns", range(4))
def test_a_mirrored_one_is_refused(turns):
    with pytest.raises(CaptureError, match=r"chart: shows the target mirrored\. Do not mirror"):
        find_target(photograph(turns=turns, mirrored=True)[0], "chart", CLASSIC)


def test_a_covered_patch_is_named():
    with pytest.raises(
        CaptureError, match=r"patch dark skin: is off the target's data by \d+ CIELAB"
    ) as error:
        find_target(photograph(covered=np.s_[:100, :200])[0], "chart", CLASSIC)
    assert {problem.where for problem in error.value.problems} == {"patch dark skin", "patch light skin"}
    assert "by hand" in error.value.problems[0].do


def test_something_light_on_the_black_patch_is_not_laid_to_the_others():
    with pytest.raises(CaptureError) as error:
        find_target(photograph(covered=np.s_[300:, 500:])[0], "chart", CLASSIC)
    assert [problem.where for problem in error.value.problems] == ["patch black 2 (1.5 D)"]


@pytest.mark.parametrize("covered", [np.s_[:, 300:], np.s_[100:, :]])
def test_one_that_is_mostly_covered_is_refused(covered):
    with pytest.raises(CaptureError, match="by hand"):
        find_target(photograph(covered=covered)[0], "chart", CLASSIC)


def test_low_contrast_is_refused():
    """Where half of all light is glare, its colours are no measure of the camera's."""
    with pytest.raises(CaptureError, match="by hand"):
        find_target(photograph(haze=0.6)[0], "chart", CLASSIC)


@pytest.mark.parametrize(
    "radiance",
    [painting(), painting(seed=8), scattered(), scattered(seed=5), np.full((300, 400, 3), 0.4),
     np.zeros((300, 400, 3))],
)  # fmt: skip
def test_nothing_is_found_where_there_is_none(radiance):
    with pytest.raises(CaptureError, match=r"painting: shows .*by hand"):
        find_target(radiance, "painting", CLASSIC)


def test_a_photograph_without_colour_is_refused():
    with pytest.raises(CaptureError, match="is grey, expected three channels"):
        find_target(np.ones((300, 400, 1)), "chart", CLASSIC)


@pytest.fixture
def photo(tmp_path):
    path = tmp_path / "chart.tif"
    radiance, _ = photograph(turns=2, angle_deg=-6, perspective=0.15, gain=(0.5, 0.7, 0.4))
    tifffile.imwrite(path, np.rint(radiance * 60000).astype(np.uint16), photometric="rgb")
    return path


def test_the_table_feeds_the_camera_s_colour(photo, tmp_path):
    table, out = tmp_path / "chart.csv", tmp_path / "colour.json"
    result = CliRunner().invoke(app, ["calibrate", "target", str(photo), str(table)])
    assert result.exit_code == 0, result.output
    assert "of 24 patches seen" in result.output
    assert (tmp_path / "chart.png").stat().st_size > 10_000
    found = impasto.calibrate.colour(photo, table, out, white="white 9.5 (.05 D)")
    assert found.names == colour_chart().names
    content = json.loads(out.read_text())
    with table.open() as lines:
        boxes = [[int(row[edge]) for edge in row if edge.endswith("_px")] for row in csv.DictReader(lines)]
    assert content["boxes_px"] == boxes


@pytest.mark.parametrize("response", ["linear", "tone"])
def test_the_simulator_s_own_shot_is_found_where_its_table_says(tmp_path, response):
    """In uneven light, with vignetting, also by a camera whose response bends and is not known."""
    take_shots(tmp_path, distance_mm=600, vignetting=0.2, response=response)
    impasto.calibrate.target(tmp_path / "colour_chart.tif", tmp_path / "found.csv")
    found, told = (read_patches(tmp_path / name) for name in ("found.csv", "colour_chart.csv"))
    assert found.names == told.names
    middles = [
        np.add(np.array(table.boxes)[:, :2], np.array(table.boxes)[:, 2:]) / 2 for table in (found, told)
    ]
    np.testing.assert_allclose(*middles, atol=1)


def test_the_neutral_patches_feed_the_response(photo, tmp_path):
    table = tmp_path / "grey.csv"
    found = impasto.calibrate.target(photo, table, grey=True)
    assert len(found.patches) == 6
    with table.open() as lines:
        reflectance = [float(row["reflectance"]) for row in csv.DictReader(lines)]
    assert reflectance == sorted(reflectance, reverse=True)
    assert 0.85 < reflectance[0] < 0.95
    response = impasto.calibrate.oecf(photo, table, tmp_path / "oecf.json")
    assert response.patches == 6


def test_nothing_is_written_where_it_is_not_found(tmp_path):
    photo = tmp_path / "painting.tif"
    tifffile.imwrite(photo, np.rint(painting() * 50000).clip(0, 65535).astype(np.uint16), photometric="rgb")
    with pytest.raises(CaptureError, match=r"painting\.tif"):
        impasto.calibrate.target(photo, tmp_path / "t.csv")
    with pytest.raises(OptionError, match=r"expected \.csv"):
        impasto.calibrate.target(photo, tmp_path / "t.png")
    assert {path.name for path in tmp_path.iterdir()} == {"painting.tif"}
