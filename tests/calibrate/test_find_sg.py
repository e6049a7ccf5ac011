"""The target of 140 patches found by itself: turned, tilted, unevenly lit, spoilt, and not there."""

import csv

import numpy as np
import pytest
import tifffile
from tests.calibrate.targets import painting, photograph, sg
from typer.testing import CliRunner

import impasto
from impasto.calibrate.find_target import find_target
from impasto.calibrate.known_targets import KNOWN_TARGETS
from impasto.cli.commands import app
from impasto.errors import CaptureError, OptionError

SG = KNOWN_TARGETS["sg"]
SIZE = (720, 960)


def find(**spoilt):
    radiance, middles = photograph(sg(), size=SIZE, **spoilt)
    return find_target(radiance, "chart", SG), middles


def assert_found(**spoilt):
    found, middles = find(**spoilt)
    assert found.names[:2] == ("A1", "B1")
    boxes = np.array(found.boxes, float)
    centres = (boxes[:, :2] + boxes[:, 2:] - 1) / 2
    step = np.hypot(*(middles[1] - middles[0]))
    assert np.hypot(*(centres - middles).T).max() < 0.06 * step
    assert (boxes[:, 2:] - boxes[:, :2]).min() > 0.3 * step


@pytest.mark.parametrize("turns", range(4))
def test_it_is_found_in_all_orientations_and_in_perspective(turns):
    assert_found(turns=turns, angle_deg=7, perspective=0.2)


@pytest.mark.parametrize("spoilt", [{"noise": 0.03}, {"fall_off": 0.6}, {"haze": 0.15}, {"around": 0.009}])
def test_it_is_found_in_noise_uneven_light_haze_and_on_a_black_ground(spoilt):
    assert_found(**spoilt)


@pytest.mark.parametrize("turns", [0, 3])
def test_a_mirrored_one_is_refused(turns):
    with pytest.raises(CaptureError, match=r"chart: shows the target mirrored\. Do not mirror"):
        find(turns=turns, mirrored=True)


def test_covered_patches_are_named():
    with pytest.raises(CaptureError) as error:
        find(covered=np.s_[: 2 * 56, : 3 * 56])
    named = {problem.where for problem in error.value.problems}
    assert named
    assert named <= {f"patch {column}{row}" for column in "ABC" for row in (1, 2)}


@pytest.mark.parametrize("spoilt", [{"covered": np.s_[:, 350:]}, {"haze": 0.6}])
def test_one_that_is_mostly_covered_or_in_glare_is_refused(spoilt):
    with pytest.raises(CaptureError, match="by hand"):
        find(**spoilt)


@pytest.mark.parametrize("radiance", [photograph()[0], painting()])
def test_another_target_and_a_painting_are_no_such_target(radiance):
    with pytest.raises(CaptureError, match=r"p: shows .*by hand"):
        find_target(radiance, "p", SG)


@pytest.fixture
def photo(tmp_path):
    path = tmp_path / "chart.tif"
    radiance, _ = photograph(sg(), size=SIZE, turns=1, angle_deg=4, gain=(0.6, 0.6, 0.6), fall_off=0.05)
    tifffile.imwrite(path, np.rint(radiance * 60000).astype(np.uint16), photometric="rgb")
    return path


def test_the_table_feeds_the_camera_s_colour(photo, tmp_path):
    table = tmp_path / "chart.csv"
    result = CliRunner().invoke(app, ["calibrate", "target", str(photo), str(table), "--target", "sg"])
    assert result.exit_code == 0, result.output
    assert "of 140 patches seen" in result.output
    assert (tmp_path / "chart.png").stat().st_size > 10_000
    found = impasto.calibrate.colour(photo, table, tmp_path / "colour.json", white="E5")
    assert found.names == SG.names
    assert found.fits["matrix"].difference.mean() < 1.5


def test_twelve_neutral_patches_feed_the_response(photo, tmp_path):
    table = tmp_path / "grey.csv"
    found = impasto.calibrate.target(photo, table, target="sg", grey=True)
    with table.open() as lines:
        reflectance = [float(row["reflectance"]) for row in csv.DictReader(lines)]
    assert len(found.patches) == len(reflectance) == 12
    assert reflectance == sorted(reflectance, reverse=True)
    assert reflectance[0] > 0.9
    assert reflectance[-1] < 0.01
    assert impasto.calibrate.oecf(photo, table, tmp_path / "oecf.json").patches == 12


def test_an_unknown_target_is_refused(photo, tmp_path):
    with pytest.raises(OptionError, match=r"--target passport: is not looked for\. Choose classic or sg"):
        impasto.calibrate.target(photo, tmp_path / "t.csv", target="passport")
