"""The lights that a rendering is asked for."""

import numpy as np
import pytest

from impasto.errors import CaptureError, ImpastoError, OptionError
from impasto.geometry import Camera, arm_direction, dome_direction
from impasto.render.lights import parse_angles, parse_light, requested_lights

CAMERA = Camera()


def test_angles_alone_in_lists_and_in_sweeps():
    assert parse_angles(["30", "-10,5", "0:1:0.25", "10:-10:-10"]) == [
        30,
        -10,
        5,
        0,
        0.25,
        0.5,
        0.75,
        1,
        10,
        0,
        -10,
    ]
    assert len(parse_angles(["-60:60:0.1"])) == 1201


@pytest.mark.parametrize("text", ["east", "1:2", "0:10:-1", "0:10:0", "nan", "1:2:3:4"])
def test_what_is_no_angle_is_named(text):
    with pytest.raises(OptionError, match="--arm"):
        parse_angles([text])


def test_a_sweep_without_end_is_refused_before_it_is_made():
    with pytest.raises(OptionError, match="60,000,000,001 angles"):
        parse_angles(["0:60:1e-9", "10"])


@pytest.mark.parametrize("text", ["45", "45,90,1", "a,b", "inf,0"])
def test_what_is_no_direction_is_named(text):
    with pytest.raises(OptionError, match="ZENITH,AZIMUTH"):
        parse_light(text)


def test_lights_come_in_order_and_are_numbered(tmp_path):
    path = tmp_path / "test.lp"
    path.write_text("1\nphotos/image 07.jpg 0.0 0.6 0.8\n")
    lights = requested_lights(path, [(45, 90)], [30], 3, CAMERA)
    assert lights.names == ("image 07", "2", "3")
    expected = [[0, 0.6, 0.8], dome_direction(np.pi / 4, np.pi / 2), arm_direction(np.pi / 6)]
    np.testing.assert_allclose(lights.direction, expected, atol=1e-12)
    np.testing.assert_array_equal(lights.intensity, 1)


def test_every_light_below_the_painting_is_listed():
    with pytest.raises(OptionError) as caught:
        requested_lights(None, [(95, 0), (45, 0)], [120, 10], 3, CAMERA)
    assert [problem.where for problem in caught.value.problems] == ["--light 95,0", "--arm 120"]


def test_rows_that_cannot_be_read_and_lights_that_cannot_be_used_are_listed_together(tmp_path):
    path = tmp_path / "test.lp"
    path.write_text("a.jpg 0 1\nb.jpg 0 0 -1\nc.jpg nan 0 1\n")
    with pytest.raises(CaptureError) as caught:
        requested_lights(path, [(95, 0)], [], 3, CAMERA)
    where = [problem.where for problem in caught.value.problems]
    assert where == ["test.lp row 1", "test.lp row 2", "test.lp row 3", "--light 95,0"]


def test_two_lights_of_one_name_would_overwrite_each_other(tmp_path):
    path = tmp_path / "test.lp"
    path.write_text("a/x.jpg 0 0 1\nb/x.jpg 0 0.6 0.8\ny.jpg 0.6 0 0.8\n")
    with pytest.raises(OptionError, match="'x' is used 2 times"):
        requested_lights(path, [], [], 3, CAMERA)


def test_no_light_at_all_is_told():
    with pytest.raises(OptionError, match="no light is given"):
        requested_lights(None, [], [], 3, CAMERA)


def test_near_lights_need_the_size_of_a_pixel(tmp_path):
    path = tmp_path / "near.toml"
    path.write_text(
        '[camera]\nmm_per_px = 0.1\n[[light]]\nfile = "x.tif"\nposition_mm = [0.0, 300.0, 400.0]\n'
    )
    lights = requested_lights(path, [], [], 3, Camera(mm_per_px=0.1))
    np.testing.assert_allclose(lights.position_mm, [[0, 300, 400]])
    with pytest.raises(ImpastoError, match="mm_per_px"):
        requested_lights(path, [], [], 3, CAMERA)
