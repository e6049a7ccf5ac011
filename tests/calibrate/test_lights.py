"""Lights found from mirror spheres, simulated with known truth and photographed by others."""

import json

import numpy as np
import pytest

import impasto
from impasto.capture import read_capture
from impasto.capture.simulate import simulate
from impasto.errors import CaptureError, OptionError


def angles_deg(one, other):
    return np.degrees(np.arccos(np.clip(np.sum(one * other, axis=-1), -1, 1)))


@pytest.fixture(scope="module")
def near(tmp_path_factory):
    """Return a capture whose lamps stand 400 mm from the painting, with unequal intensities."""
    folder = tmp_path_factory.mktemp("near") / "photos"
    simulate(folder, preset="swatches", lights=12, size=(64, 64), light_distance_mm=400, gain_spread=0.1)
    return folder


@pytest.fixture(scope="module")
def found(near, tmp_path_factory):
    out = tmp_path_factory.mktemp("found")
    spheres = near / "calibration" / "spheres"
    card = (171, 2, 189, 20)
    return impasto.calibrate.lights(
        spheres, out, camera=near / "capture.toml", mm_per_px=0.5, intensity="card", card=card
    )


def truth(folder):
    lights = json.loads((folder / "truth" / "truth.json").read_text())["lights"]
    return {
        name: np.array([light[name] for light in lights])
        for name in ("direction", "position_mm", "intensity")
    }


def test_directions_are_right_to_a_third_of_a_degree(near, found):
    """From spheres whose diameter is 144 pixels."""
    assert angles_deg(found.lights.direction, truth(near)["direction"]).max() < 0.3


def test_two_spheres_give_positions_to_two_per_cent(near, found):
    position = truth(near)["position_mm"]
    off = np.linalg.norm(found.lights.position_mm - position, axis=1) / np.linalg.norm(position, axis=1)
    assert off.max() < 0.02
    assert found.disagreement_deg.max() < 0.2


def test_a_card_tells_the_intensities(near, found):
    expected = truth(near)["intensity"] / truth(near)["intensity"].mean()
    np.testing.assert_allclose(found.lights.intensity.mean(axis=1), expected[:, 0], rtol=0.02)


def test_what_is_written_reads_back_as_lights_of_a_capture(near, found, tmp_path):
    capture = read_capture(near, found.folder / "lights.toml")
    np.testing.assert_allclose(capture.lights.position_mm, found.lights.position_mm)
    assert angles_deg(read_capture(near, found.folder / "lights.lp").lights.direction,
                      found.lights.direction).max() < 1e-4  # fmt: skip
    record = json.loads((found.folder / "lights.json").read_text())
    assert len(record["made_from"]) == 12
    assert all(len(entry["sha256"]) == 64 for entry in record["made_from"])
    assert (found.folder / "spheres.png").stat().st_size > 10000


def test_circles_may_be_given_and_a_light_dropped(near, tmp_path):
    spheres = near / "calibration" / "spheres"
    table = (spheres / "spheres.csv").read_text().splitlines()[1:]
    circles = [[float(value) for value in row.split(",")[-3:]] for row in table]
    given = impasto.calibrate.lights(
        spheres, tmp_path, spheres=circles, camera=near / "capture.toml", mm_per_px=0.5, drop=["light-003"]
    )
    assert "light-003" not in given.names
    kept = np.delete(truth(near)["direction"], 3, axis=0)
    assert angles_deg(given.lights.direction, kept).max() < 0.3


def test_a_wrong_light_is_named(near, tmp_path):
    """One photograph in which something else shines into the left sphere alone."""
    import shutil

    import tifffile

    folder = tmp_path / "spheres"
    shutil.copytree(near / "calibration" / "spheres", folder)
    image = tifffile.imread(folder / "light-005.tif")
    left = image[:, :180]
    left[left > 20000] = 300
    left[70:76, 60:66] = 65535
    tifffile.imwrite(folder / "light-005.tif", image, photometric="rgb")
    wrong = impasto.calibrate.lights(folder, tmp_path, camera=near / "capture.toml", mm_per_px=0.5)
    assert wrong.doubtful == ("light-005",)


def test_a_tilted_camera_sees_the_same_lights(tmp_path):
    """An arm's camera stands 5° out of its plane; the lights are far away."""
    simulate(tmp_path / "photos", preset="swatches", arm=True, lights=7, size=(64, 64))
    spheres = tmp_path / "photos" / "calibration" / "spheres"
    found = impasto.calibrate.lights(spheres, tmp_path, camera=tmp_path / "photos" / "capture.toml")
    assert angles_deg(found.lights.direction, truth(tmp_path / "photos")["direction"]).max() < 0.3
    assert not np.isfinite(found.lights.position_mm).any()


def test_what_cannot_be_found_is_named(near, tmp_path):
    spheres = near / "calibration" / "spheres"
    with pytest.raises(CaptureError, match="show 2 spheres with a clear outline"):
        impasto.calibrate.lights(spheres, tmp_path, count=3)
    with pytest.raises(CaptureError, match=r"light-000\.tif: shows its lamp in no sphere"):
        impasto.calibrate.lights(spheres, tmp_path, spheres=[(180, 10, 8)])
    with pytest.raises(CaptureError, match="shows its lamp clipped"):
        impasto.calibrate.lights(spheres, tmp_path, intensity="spheres")
    with pytest.raises(OptionError) as error:
        impasto.calibrate.lights(spheres, tmp_path, spheres=[(9999, 10, 80)], drop=["no"], intensity="moon")
    assert len(error.value.problems) == 3


@pytest.mark.parametrize("probe", ["LightProbe-1", "LightProbe-2"])
def test_chrome_spheres_photographed_by_others(shared, tmp_path, probe):
    """The given directions come from clicked points."""
    folder = shared / "captures" / "cat" / probe
    found = impasto.calibrate.lights(folder, tmp_path, exclude=["ref"])
    given = np.loadtxt(folder / "light_directions.txt").T
    both = np.loadtxt(folder.parent / "light_directions.txt").T
    assert np.median(angles_deg(found.lights.direction, given)) < 1.5
    assert np.median(angles_deg(found.lights.direction, both)) < 1.5


def test_two_chrome_spheres_agree(shared, tmp_path):
    one, other = (
        impasto.calibrate.lights(
            shared / "captures" / "cat" / f"LightProbe-{number}", tmp_path / str(number), exclude=["ref"]
        )
        for number in (1, 2)
    )
    assert np.median(angles_deg(one.lights.direction, other.lights.direction)) < 1.5
