"""Radiance under simulated lights: cast shadows, near lights, lamps that have a size."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from impasto.capture.simulate import lamps
from impasto.capture.simulate.illumination import Scene, disc_directions
from impasto.capture.simulate.materials import specular_term
from impasto.capture.simulate.painting.relief import Grid
from impasto.capture.simulate.presets import PRESETS, Order
from impasto.capture.simulate.shadows import disc_fraction, near_visibility, visibility
from impasto.geometry import Camera, Lights, arm_direction, dome_direction, pixel_position_mm
from reference_models import radiance as reference_radiance

UP = np.array([0.0, 0.0, 1.0])


def pillar(side=81, size=9, height_mm=5.0):
    field = np.zeros((side, side), np.float32)
    middle = slice(side // 2 - size // 2, side // 2 + size // 2 + 1)
    field[middle, middle] = height_mm
    return field, middle


@pytest.mark.parametrize(
    ("azimuth_deg", "row", "column"), [(0, 0, -1), (90, 1, 0), (180, 0, 1), (270, -1, 0), (45, 1, -1)]
)
def test_a_pillars_shadow_lies_away_from_the_light_and_has_the_right_length(azimuth_deg, row, column):
    """Light from the right shades to the left; light from the top shades downwards, to larger rows."""
    field, middle = pillar()
    zenith = np.radians(60.0)
    shade = visibility(field, 0.5, dome_direction(zenith, np.radians(azimuth_deg))) < 0.5
    length_px = 5.0 * np.tan(zenith) / 0.5  # 17.3
    distance = np.arange(1, 36)
    along = shade[40 + (4 + distance) * row, 40 + (4 + distance) * column]
    step = np.hypot(row, column)
    assert along.sum() * step == pytest.approx(length_px, abs=1.5 * step)
    assert not along[along.sum() :].any()
    assert not shade[middle, middle].any()
    assert not shade[40 - 10 * row, 40 - 10 * column]


def test_shadows_are_the_same_under_a_near_light_far_away():
    rng = np.random.default_rng(2)
    field = np.cumsum(rng.standard_normal((60, 70)), axis=1).astype(np.float32) * 0.05
    direction = dome_direction(np.radians(65.0), np.radians(130.0))
    distant = visibility(field, 0.4, direction)
    near = near_visibility(field, 0.4, 1e6 * direction)
    assert 0.05 < np.mean(distant < 0.5) < 0.95
    assert np.mean(np.abs(near - distant) > 0.05) < 0.01


def test_a_near_light_throws_shadows_outwards():
    field, _ = pillar()
    shade = near_visibility(field, 0.5, np.array([0.0, 0.0, 20.0])) < 0.5
    # The lamp is right above: the pillar, 2 mm to either side, shades the floor out to 2 · 20 / (20 − 5) mm.
    assert [shade[40, 45], shade[40, 35], shade[45, 40], shade[35, 40]] == [True] * 4
    assert [shade[40, 47], shade[40, 33], shade[47, 40], shade[33, 40]] == [False] * 4


def test_flat_and_smooth_surfaces_have_no_cast_shadow():
    assert (visibility(np.zeros((20, 20), np.float32), 0.5, arm_direction(np.radians(89.0))) == 1).all()


def test_a_lamp_half_over_the_horizon_gives_half_its_light():
    np.testing.assert_allclose(
        disc_fraction(np.array([-2.0, -1.0, 0.0, 1.0]), 1.0), [0, 0, 0.5, 1], atol=1e-6
    )
    # A circle's segment of height r/2 has area r²(π/3 − √3/4).
    expected = 1 - (np.pi / 3 - np.sqrt(3) / 4) / np.pi
    assert disc_fraction(np.array(0.5), 1.0) == pytest.approx(expected, rel=1e-6)


@pytest.fixture(scope="module")
def surface():
    order = Order(Grid(40, 48), 3, "torrance-sparrow-smith", None, 0.8, 1.0)
    return PRESETS["swatches"](order)


@pytest.mark.parametrize("near", [False, True])
def test_radiance_is_the_references(surface, near):
    """The equations as the core's tests have them, near lights and perspective included."""
    directions = dome_direction(np.radians([10.0, 50.0, 75.0]), np.radians([20.0, 200.0, 300.0]))
    position = 180.0 * directions if near else np.full((3, 3), np.nan)
    lights = Lights(("a", "b", "c"), directions, position, np.array([[0.5, 1, 2], [1, 1, 1], [2, 1, 1]]))
    view = np.array([0.0, np.sin(0.1), np.cos(0.1)])
    camera = Camera(view, 500.0 if near else None, 0.8)
    scene = Scene(surface, camera, cast_shadows=False)
    place = pixel_position_mm(slice(0, 40), slice(0, 48), 40, 48, 0.8)
    expected = reference_radiance(
        "torrance-sparrow-smith",
        surface.normal.reshape(-1, 3),
        surface.diffuse.reshape(-1, 3),
        surface.specular.reshape(-1),
        surface.shape.reshape(-1),
        light_direction=directions,
        light_position_mm=position,
        light_intensity=lights.intensity,
        view_direction=view,
        camera_distance_mm=camera.distance_mm,
        position_mm=place,
    )
    for light in range(3):
        ours = scene.radiance(lights, light).reshape(-1, 3)
        np.testing.assert_allclose(ours, expected[light], rtol=2e-4, atol=1e-6)


def test_cast_shadows_only_take_light_away(surface):
    lights = lamps.dome_lights(12)
    camera = Camera(UP, None, 0.8)
    lit, unlit = Scene(surface, camera, cast_shadows=False), Scene(surface, camera)
    plain, shaded = lit.radiance(lights, 11), unlit.radiance(lights, 11)
    np.testing.assert_allclose(shaded, plain * unlit.visible(lights, 11)[..., None], rtol=1e-6)
    assert (shaded < 0.5 * plain).any()


@pytest.mark.parametrize(("size_deg", "widened"), [(2.0, 1.16), (5.0, 1.78)])
def test_a_lamps_size_widens_a_narrow_lobe_as_computed_elsewhere(size_deg, widened):
    """A lobe of c 0.0172 reads 1.16 and 1.78 times wider under lamps of 2° and 5° (an independent figure)."""
    lights = arm_direction(np.radians(np.linspace(-12, 12, 121)))
    normal = np.repeat(UP[None], len(lights), axis=0)

    def lobe(c):
        return specular_term("torrance-sparrow", normal, lights, UP, np.full(len(lights), c))

    seen = np.mean(
        [
            specular_term("torrance-sparrow", normal, source, UP, np.full(len(lights), 0.0172))
            for source in disc_directions(lights, size_deg)
        ],
        axis=0,
    )
    fit = least_squares(lambda p: np.exp(p[0]) * lobe(np.exp(p[1])) - seen, [0.0, np.log(0.02)])
    assert np.exp(fit.x[1]) / 0.0172 == pytest.approx(widened, rel=0.02)


def test_the_arm_stops_every_four_degrees():
    np.testing.assert_allclose(lamps.arm_angles_deg(), np.arange(-72, 73, 4))


def test_a_domes_lights_are_spread_evenly():
    direction = lamps.dome_directions(48)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1)
    zenith = np.degrees(np.arccos(direction[:, 2]))
    assert 8 < zenith.min() < 20
    assert 70 < zenith.max() < 78
    apart = np.degrees(np.arccos(np.clip(direction @ direction.T - 2 * np.eye(48), -1, 1))).min(axis=1)
    assert apart.min() > 12
    assert np.abs(direction[:, :2].mean(axis=0)).max() < 0.05


def test_lamps_differ_by_the_spread_asked_for():
    lights = lamps.set_up(
        lamps.dome_lights(500), distance_mm=300.0, gain_spread=0.05, angular_size_deg=1.0, seed=1
    )
    assert np.log(lights.intensity).std() == pytest.approx(0.05, rel=0.15)
    np.testing.assert_allclose(lights.position_mm, 300 * lights.direction)
    assert (lights.angular_size_deg == 1).all()
