"""Which lights are an arm, and its frame."""

import numpy as np
import pytest
from tests.arm_scenes import arm, view

from impasto.arm import find_arm
from impasto.geometry import Camera, Lights, dome_direction


@pytest.mark.parametrize("azimuth_deg", [0.0, 30.0, 89.0, -60.0])
def test_the_azimuth_is_found_and_the_frame_is_the_arms(azimuth_deg):
    lights = arm(azimuth_deg)
    found = find_arm(lights)
    assert found.planar
    assert np.degrees(found.azimuth) == pytest.approx(azimuth_deg, abs=1e-6)
    turned = found.lights(Lights(tuple(map(str, range(len(lights)))), lights))
    np.testing.assert_allclose(turned.direction, arm(0.0), atol=1e-12)
    np.testing.assert_allclose(found.camera(Camera(view(azimuth_deg))).view_direction, view(0.0), atol=1e-12)
    np.testing.assert_allclose(found.back(arm(0.0)), lights, atol=1e-7)


def test_lights_a_little_off_the_plane_are_moved_into_it():
    lights = arm(30.0)
    lights[:, 1] += np.where(np.arange(len(lights)) % 2, 0.02, -0.02)
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    found = find_arm(lights)
    assert found.planar
    assert 0.5 < np.degrees(found.off_plane) < 2
    turned = found.lights(Lights(tuple(map(str, range(len(lights)))), lights))
    np.testing.assert_allclose(turned.direction[:, 1], 0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(turned.direction, axis=1), 1)


def test_a_dome_and_a_ring_are_no_arm_and_a_plane_beside_the_normal_neither():
    azimuth = np.arange(12) * 2.4
    assert not find_arm(dome_direction(0.2 + 0.06 * np.arange(12), azimuth)).planar
    assert not find_arm(dome_direction(0.7, azimuth)).planar
    slanted = np.stack(
        [np.sin(np.linspace(-1, 1, 9)), np.full(9, 0.2), np.cos(np.linspace(-1, 1, 9))], axis=1
    )
    slanted[:, 1] = 0.2 * slanted[:, 2]
    slanted /= np.linalg.norm(slanted, axis=1, keepdims=True)
    found = find_arm(slanted)
    assert not found.planar
    assert np.degrees(found.off_own_plane) < 1e-6
    assert np.degrees(found.off_plane) == pytest.approx(np.degrees(np.arctan(0.2)), abs=0.1)
