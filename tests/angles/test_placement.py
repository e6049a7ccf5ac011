"""Lights placed evenly, by the highlights, and at random."""

import numpy as np
import pytest

from impasto.angles.groups import choose_test_lights, group_sizes
from impasto.angles.photographed import camera_for
from impasto.angles.placement import arm_angles_deg, even_lights, informed_lights, random_lights
from impasto.angles.study import usual_sizes
from impasto.geometry import Camera, Lights, arm_direction, dome_direction, tilt_direction

ARM = arm_direction(np.radians(np.arange(-72, 73, 4.0)))


def dome(count=60):
    z = 1 - 0.75 * (np.arange(count) + 0.5) / count
    return dome_direction(np.arccos(z), 2.39996 * np.arange(count))


def test_even_lights_on_an_arm_have_equal_steps():
    assert even_lights(ARM, 5) == (0, 9, 18, 27, 36)
    steps = np.diff(even_lights(ARM, 13))
    assert set(steps) == {3}


def test_even_lights_of_a_dome_keep_apart():
    direction = dome()
    chosen = direction[list(even_lights(direction, 10))]
    apart = np.degrees(np.arccos(np.clip(chosen @ chosen.T, -1, 1)))[~np.eye(10, dtype=bool)]
    others = [direction[list(each)] for each in random_lights(60, 10, 50)]
    usual = [np.degrees(np.arccos(np.clip(o @ o.T, -1, 1)))[~np.eye(10, dtype=bool)].min() for o in others]
    assert apart.min() > max(usual)


def test_informed_lights_crowd_where_the_highlights_are():
    angle = arm_angles_deg(ARM)
    density = np.exp(-0.5 * (angle / 6) ** 2)
    chosen = angle[list(informed_lights(ARM, density / density.sum(), 11))]
    even = angle[list(even_lights(ARM, 11))]
    assert (np.abs(chosen) <= 12).sum() > (np.abs(even) <= 12).sum()
    assert chosen.min() < -40
    assert chosen.max() > 40


@pytest.mark.parametrize("azimuth", [0.0, 0.6, -1.2])
def test_arm_angles_are_read_at_any_azimuth(azimuth):
    angle = np.radians([-60.0, -10.0, 0.0, 35.0])
    turned = dome_direction(np.abs(angle), azimuth + np.where(angle < 0, np.pi, 0.0))
    assert arm_angles_deg(turned) == pytest.approx(np.degrees(angle), abs=1e-6)
    assert arm_angles_deg(dome()) is None


def test_the_view_is_taken_into_the_plane_of_an_arm_only():
    lights, view = Lights(tuple(map(str, range(37))), ARM), tilt_direction(0.1, np.radians(5.0))
    moved = camera_for(lights, Camera(view)).view_direction
    assert moved == pytest.approx([np.sin(0.1), 0.0, np.cos(0.1)])
    around = Lights(tuple(map(str, range(60))), dome())
    assert camera_for(around, Camera(view)).view_direction == pytest.approx(view)


def test_seven_test_lights_leave_the_outermost_to_the_choice():
    chosen = choose_test_lights(Lights(tuple(map(str, range(37))), ARM))
    assert len(chosen) == 7
    assert chosen[0] > 0
    assert chosen[-1] < 36


def test_sizes_rise_from_the_least_to_all():
    assert usual_sizes(5, 37)[0] == 5
    assert usual_sizes(5, 37)[-1] == 37
    assert usual_sizes(5, 7) == [5, 6, 7]
    assert len(group_sizes(9, 5, 37)) == 5
    assert {9, 37} <= set(group_sizes(9, 5, 37))
    assert group_sizes(6, 5, 7) == [5, 6, 7]
    assert len(group_sizes(37, 5, 37)) == 5
