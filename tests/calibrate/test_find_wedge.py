"""A grey wedge found by itself: turned, tilted, unevenly lit, spoilt, and not there."""

import csv

import numpy as np
import pytest
import tifffile
from tests.calibrate.targets import painting, photograph, scattered, wedge
from typer.testing import CliRunner

import impasto
from impasto.calibrate.find_wedge import find_wedge
from impasto.cli.commands import app
from impasto.errors import CaptureError, OptionError


def assert_found(drawn, **spoilt):
    radiance, middles = photograph(drawn, **spoilt)
    found = find_wedge(radiance, len(middles), "wedge")
    assert found.names == tuple(str(number + 1) for number in range(len(middles)))
    boxes = np.array(found.boxes, float)
    centres = (boxes[:, :2] + boxes[:, 2:] - 1) / 2
    step = np.hypot(*np.diff(middles, axis=0).T).min()
    assert np.hypot(*(centres - middles).T).max() < 0.15 * step
    # Each box lies between the steps to its neighbours: its corners are within half a step along the row.
    along = np.gradient(middles, axis=0)
    for corner in ((0, 1), (2, 1), (0, 3), (2, 3)):
        off = ((boxes[:, corner] - centres) * along).sum(axis=1) / (along**2).sum(axis=1)
        assert np.abs(off).max() < 0.5


@pytest.mark.parametrize("angle", [-20, 0, 8])
@pytest.mark.parametrize("turns", range(4))
def test_it_is_found_in_all_orientations(turns, angle):
    assert_found(wedge(), turns=turns, angle_deg=angle)


@pytest.mark.parametrize("turns", range(4))
def test_it_is_found_in_perspective(turns):
    assert_found(wedge(), turns=turns, angle_deg=5, perspective=0.25)


@pytest.mark.parametrize(
    "spoilt", [{"noise": 0.01}, {"fall_off": 0.6}, {"haze": 0.1}, {"gain": (0.05, 0.09, 0.02)}]
)
def test_it_is_found_in_noise_uneven_light_haze_and_the_dark(spoilt):
    assert_found(wedge(), **spoilt)


@pytest.mark.parametrize(
    "drawn",
    [wedge(12, 0.15, gap=8), wedge(21, 0.05, patch=(40, 40)), wedge(20, 0.1, 0.15, ground=0.87)],
    ids=["with gaps", "of small steps", "on white paper"],
)
def test_other_wedges_are_found(drawn):
    assert_found(drawn)


def test_a_mirrored_one_reads_the_same():
    assert_found(wedge(), mirrored=True)


@pytest.mark.parametrize("count", [19, 21])
def test_another_number_of_patches_is_refused(count):
    with pytest.raises(CaptureError, match=rf"wedge: shows no row of {count} grey .* the longest has 20"):
        find_wedge(photograph(wedge())[0], count, "wedge")


def test_an_end_that_the_ground_hides_is_not_guessed():
    """White paper reads like the lightest patch: the row seems to have 19."""
    with pytest.raises(CaptureError, match=r"the longest has 19\. Lay it on a ground lighter or darker"):
        find_wedge(photograph(wedge(ground=0.87))[0], 20, "wedge")


@pytest.mark.parametrize("covered", [np.s_[:, :200], np.s_[:, 300:420], np.s_[:100, 300:420]])
def test_a_covered_one_is_refused(covered):
    with pytest.raises(CaptureError, match="shows no row of 20 grey patches"):
        find_wedge(photograph(wedge(), covered=covered)[0], 20, "wedge")


def test_a_patch_that_something_lies_on_is_named():
    with pytest.raises(CaptureError, match=r"patch 7: differs within itself by \d+% in wedge") as error:
        find_wedge(photograph(wedge(), covered=np.s_[60:80, 300:310])[0], 20, "wedge")
    assert len(error.value.problems) == 1


def test_two_wedges_are_not_told_apart():
    one, _ = photograph(wedge())
    with pytest.raises(CaptureError, match="shows 2 rows of 20 grey patches"):
        find_wedge(np.concatenate([one, one]), 20, "wedge")


@pytest.mark.parametrize("count", [5, 8, 20])
@pytest.mark.parametrize(
    "radiance", [painting(), painting(seed=8), scattered(), scattered(seed=5), np.full((300, 400, 3), 0.4)]
)
def test_nothing_is_found_where_there_is_none(radiance, count):
    with pytest.raises(CaptureError, match=r"painting: shows no row .*by hand"):
        find_wedge(radiance, count, "painting")


@pytest.fixture
def photo(tmp_path):
    path = tmp_path / "wedge.tif"
    radiance, _ = photograph(
        wedge(), turns=3, angle_deg=6, gain=(0.8, 0.8, 0.8), fall_off=0.0, size=(960, 1280)
    )
    tifffile.imwrite(path, np.rint(radiance * 60000).astype(np.uint16), photometric="rgb")
    return path


def test_the_table_feeds_the_response(photo, tmp_path):
    table, out = tmp_path / "wedge.csv", tmp_path / "oecf.json"
    words = ["calibrate", "target", photo, table, "--wedge", 20, "--density", "0.05,0.10"]
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    assert "20 of 20 patches seen" in result.output
    assert (tmp_path / "wedge.png").stat().st_size > 10_000
    with table.open() as lines:
        density = [float(row["density"]) for row in csv.DictReader(lines)]
    np.testing.assert_allclose(density, 0.05 + 0.1 * np.arange(20))
    response = impasto.calibrate.oecf(photo, table, out)
    assert response.patches == 20
    assert response.linear


def test_without_densities_the_table_says_what_is_missing(photo, tmp_path):
    table = tmp_path / "wedge.csv"
    result = CliRunner().invoke(app, ["calibrate", "target", str(photo), str(table), "--wedge", "20"])
    assert "add a column density or reflectance" in " ".join(result.output.split())
    with pytest.raises(CaptureError, match="expected reflectance or density"):
        impasto.calibrate.oecf(photo, table, tmp_path / "oecf.json")


def test_a_photograph_without_colour_will_do(photo, tmp_path):
    grey = tmp_path / "grey.tif"
    tifffile.imwrite(grey, tifffile.imread(photo)[..., 1], photometric="minisblack")
    assert impasto.calibrate.target(grey, tmp_path / "w.csv", wedge=20).total == 20


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"wedge": 3}, "--wedge 3"),
        ({"wedge": 20, "grey": True}, "--wedge"),
        ({"wedge": 20, "target": "sg"}, "--wedge"),
        ({"density": (0.05, 0.1)}, "--density"),
        ({"wedge": 20, "density": (0.05, -0.1)}, "--density"),
    ],
)
def test_options_that_do_not_go_together_are_refused(photo, tmp_path, options, where):
    with pytest.raises(OptionError) as error:
        impasto.calibrate.target(photo, tmp_path / "w.csv", **options)
    assert [problem.where for problem in error.value.problems] == [where]
