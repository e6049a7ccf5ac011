"""Plans: what they hold, what is wrong with them, and exposure times from a metering shot."""

from itertools import pairwise

import numpy as np
import pytest
import tifffile
from stands import quiet, write_plan

import impasto
from impasto import stand
from impasto.capture.light_files import read_light_file
from impasto.errors import CaptureError, OptionError
from impasto.stand.drivers import CAMERAS, LIGHTS, settings_of
from impasto.stand.metering import Metering, meter, rounded
from impasto.stand.plan_file import read_plan
from impasto.stand.run import unattended
from impasto.stand.steps import shots


def test_what_needs_the_painting_away_comes_first(tmp_path):
    kinds = ("spheres", "colour", "dark", "white", "grey-scale", "scale-bar", "ambient")
    path = write_plan(tmp_path, arm=(-10, 0, 10), calibration=kinds)
    order = [shot.kind for shot in shots(read_plan(path))]
    assert list(dict.fromkeys(order)) == [
        "dark", "white", "grey-scale", "colour", "scale-bar", "spheres", "ambient", "painting",
    ]  # fmt: skip
    assert order[-1] == "ambient"  # and once more when the painting is done
    assert order.count("spheres") == 3
    assert order.count("painting") == 6


def test_exposures_of_a_place_follow_each_other(tmp_path):
    names = [shot.name for shot in shots(read_plan(write_plan(tmp_path, arm=(-10, 10), calibration=())))]
    assert names == ["arm-010", "brackets/1/arm-010", "arm+010", "brackets/1/arm+010"]


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("camera", CAMERAS)
def test_a_plan_for_every_driver_can_be_read(camera, light, tmp_path):
    stand.plan(tmp_path / "plan.toml", arm_deg=(-10, 10), camera=camera, light=light)
    plan = read_plan(tmp_path / "plan.toml")
    assert plan.camera_settings.model_dump() == settings_of(CAMERAS, camera)().model_dump()
    assert plan.light_settings.model_dump() == settings_of(LIGHTS, light)().model_dump()


def test_all_problems_of_a_plan_are_told_at_once(tmp_path):
    path = write_plan(
        tmp_path, arm=(-10, 0, 10),
        replace=[('driver = "simulated"\nview', 'driver = "polaroid"\nview'),
                 ("arm_angle_deg = -10", "arm_angle_deg = -100"),
                 ("arm_angle_deg = 10", "arm_angle_deg = 10\nzenith_deg = 3"),
                 ("arm_angle_deg = 0", "arm_angle_deg = 0\ntimes_s = [1]"),
                 ("view = { phi_deg = 5 }", "view = { phi_deg = 5, zenith_deg = 1 }")],
    )  # fmt: skip
    with pytest.raises(CaptureError) as caught:
        read_plan(path)
    text = str(caught.value)
    for words in (
        "there is no driver 'polaroid'",
        "place arm-010: direction (-0.9848, 0, -0.1736) lies below the surface",
        "place arm+010: gives the light by arm_angle_deg and zenith_deg",
        "places have 1 to 2 exposures",
        "view gives zenith_deg, phi_deg",
    ):
        assert words in text
    assert len(caught.value.problems) == 5


def test_keys_that_do_not_exist_and_settings_of_drivers_are_checked(tmp_path):
    path = write_plan(
        tmp_path, arm=(0,),
        replace=[("[limits]", "[limits]\nsharpness = 1"), ("exposure = 0.5", 'exposure = "bright"'),
                 ('kind = "dark"', 'kind = "darkness"'), ("times_s = [2]", "times_s = [-2]")],
    )  # fmt: skip
    with pytest.raises(CaptureError) as caught:
        read_plan(path)
    wheres = [problem.where for problem in caught.value.problems]
    assert wheres == [
        "plan.toml [camera.simulated]",
        "plan.toml [limits]",
        "plan.toml calibration 1 (dark)",
        "plan.toml calibration 1 (dark)",
        "plan.toml calibration 2 (ambient)",
        "plan.toml calibration 3 (ambient-after)",
    ]
    assert "Allowed here: clipped, dark, moved_px, blur, ambient" in caught.value.problems[1].do


def test_a_plan_of_other_photographs_does_not_go_on_in_a_folder(tmp_path):
    path = write_plan(tmp_path, arm=(-10, 0, 10))
    stand.run(path, tmp_path / "photos", say=quiet)
    path.write_text(path.read_text().replace('name = "arm+010"', 'name = "arm+011"'))
    with pytest.raises(CaptureError, match="begun by a plan of other photographs"):
        stand.run(path, tmp_path / "photos", say=quiet)


def test_times_of_photographs_that_are_not_taken_may_still_be_changed(tmp_path):
    path = write_plan(tmp_path, arm=(-10, 0, 10), calibration=())
    desk = unattended()

    def stop(line):
        if line.startswith("arm+000:"):
            desk.stop()

    assert not stand.run(path, tmp_path / "photos", desk=desk, say=stop).complete
    text = path.read_text()
    path.write_text(text.replace('"arm-010"', '"arm-010"\ntimes_s = [3, 0.125]'))
    with pytest.raises(CaptureError, match=r"arm-010: was exposed for 2 s, the plan now says 3 s"):
        stand.run(path, tmp_path / "photos", say=quiet)
    path.write_text(text.replace('"arm+010"', '"arm+010"\ntimes_s = [3, 0.125]'))
    assert stand.run(path, tmp_path / "photos", say=quiet).complete
    light_file = read_light_file(tmp_path / "photos" / "capture.toml")
    assert [row.exposure_s for row in light_file.rows] == [2, 2, 3]
    impasto.stack(tmp_path / "photos", tmp_path / "store.zarr")
    plans = sorted(path.name for path in (tmp_path / "photos" / "record").glob("plan*"))
    assert plans == ["plan-1.toml", "plan-2.toml"]


def test_lights_come_from_what_impasto_angles_plans(tmp_path):
    (tmp_path / "dome.lp").write_text("2\none.tif 0 0.5 0.8660254\ntwo.tif -0.6 0 0.8\n")
    summary = stand.plan(tmp_path / "plan.toml", lights=tmp_path / "dome.lp")
    assert summary.places == 2
    text = (tmp_path / "plan.toml").read_text()
    assert 'name = "one"\nzenith_deg = 30\nazimuth_deg = 90\n' in text
    assert 'name = "two"\narm_angle_deg = -36.87\n' in text
    plan = read_plan(tmp_path / "plan.toml")
    np.testing.assert_allclose(plan.lights.direction, [[0, 0.5, 0.8660254], [-0.6, 0, 0.8]], atol=1e-5)


def test_time_and_room_are_estimated_from_the_plan(tmp_path):
    """Two places of the hand, two exposures of 2 and 1 s each, 2 s transfer; 15 s to move, 1 s to settle."""
    summary = stand.plan(tmp_path / "plan.toml", arm_deg=(0, 10), times_s=(2, 1), calibration=())
    assert summary.hours * 3600 == pytest.approx(2 * (2 + 1 + 2 * 2) + 2 * (15 + 1))
    assert summary.gigabytes == pytest.approx(4 * 0.06)


def test_options_that_do_not_fit_are_told_at_once(tmp_path):
    with pytest.raises(OptionError) as caught:
        stand.plan(tmp_path / "plan.txt", camera="polaroid", light="sun", calibration=("gold",))
    assert [problem.where for problem in caught.value.problems] == [
        "--camera polaroid", "--light sun", "--calibration gold", str(tmp_path / "plan.txt"),
        "places of the lamps",
    ]  # fmt: skip
    path = write_plan(tmp_path, arm=(0,))
    with pytest.raises(OptionError, match="is there already"):
        stand.plan(path, arm_deg=(0,))


def metering_shot(path, levels, shares):
    """Write a photograph in which given shares of the pixels have given levels of full scale."""
    counts = np.round(np.array(shares) * 10_000).astype(int)
    image = np.repeat(np.array(levels), counts).reshape(100, 100, 1)
    codes = np.rint(np.repeat(image, 3, axis=2) * 65535).astype(np.uint16)
    tifffile.imwrite(path, codes, photometric="rgb")
    return path


def test_a_metering_shot_gives_exposures_for_shadows_and_highlights(tmp_path):
    """Shadows of 1 %, paint of 10 %, highlights of 80 %, at 0.1 s."""
    shot = metering_shot(tmp_path / "shot.tif", (0.01, 0.1, 0.8), (0.2, 0.75, 0.05))
    found = meter(shot, 0.1)
    assert found.longest_s == pytest.approx(0.5, rel=1e-3)  # shadows at 5 %, paint at 50 %
    assert found.shortest_s == pytest.approx(0.1 * 0.7 / 0.8, rel=0.05)
    assert found.clipped == 0
    with pytest.raises(CaptureError, match="does not say its exposure time"):
        meter(shot)


def test_a_clipped_metering_shot_is_said_to_be(tmp_path):
    shot = metering_shot(tmp_path / "shot.tif", (0.01, 0.1, 1.0), (0.2, 0.75, 0.05))
    found = meter(shot, 0.1)
    assert found.shortest_s == pytest.approx(0.1 * 0.7 / 8)
    (remark,) = found.remarks()
    assert "5.0% of the metering shot's samples are clipped" in remark


def test_grazing_lights_are_exposed_longer_and_their_highlights_as_long():
    found = Metering(longest_s=1.0, shortest_s=0.02, clipped=0.0, photograph_mb=10)
    frontal, grazing = found.times_s(1.0, 1.0), found.times_s(0.5, 1.0)
    assert len(frontal) == len(grazing) == 4  # at most three stops apart, even for the longest
    assert grazing[0] == pytest.approx(2 * frontal[0])
    assert grazing[-1] == frontal[-1] == rounded(0.02)
    assert max(a / b for a, b in pairwise(grazing)) <= 8


def test_a_metered_plan_is_captured_without_clipping(tmp_path):
    """The metering shot is taken with the stand that it meters for, under its most frontal lamp."""
    first = write_plan(tmp_path, arm=(0,), times=(0.25,), calibration=())
    stand.run(first, tmp_path / "metered", say=quiet)
    made = stand.plan(
        tmp_path / "metered.toml", arm_deg=(-60, 0, 60), camera="simulated", light="simulated",
        meter_photograph=tmp_path / "metered" / "arm+000.tif", meter_exposure_s=0.25,
    )  # fmt: skip
    path = tmp_path / "metered.toml"
    path.write_text(path.read_text().replace("size = [192, 128]", 'size = [96, 64]\nsample = "b"'))
    summary = stand.run(path, tmp_path / "photos", say=quiet)
    assert summary.complete
    assert summary.kept_findings == ()
    assert summary.photographs == made.photographs
