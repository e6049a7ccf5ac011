"""Radiance on a display: colour, exposure, white, highlights, and what cannot be shown."""

import colour
import numpy as np
import pytest

from icc_profiles import gamma_curve, rgb
from impasto.colour import decode_srgb, encode_srgb
from impasto.colour.adaptation import WHITE_POINTS, xy_to_xyz
from impasto.colour.camera import CameraColour, camera_colour, colour_terms
from impasto.colour.displays import AdditiveDisplay, GainOffsetGamma, display_p3, srgb_display
from impasto.colour.icc_display import icc_display
from impasto.colour.primaries import SRGB, rgb_to_xyz_matrix
from impasto.colour.profiles import profile
from impasto.colour.rendition import Rendition

D50 = xy_to_xyz(WHITE_POINTS["D50"])
MEASURED = AdditiveDisplay(
    "measured",
    0.98 * rgb_to_xyz_matrix(SRGB, WHITE_POINTS["D55"]),
    0.02 * xy_to_xyz(WHITE_POINTS["D65"]),
    GainOffsetGamma(np.ones(3), np.zeros(3), np.full(3, 2.0)),
)
DISPLAYS = {
    "sRGB": srgb_display(),
    "Display P3": display_p3(),
    "measured": MEASURED,
    "profile": icc_display(rgb(gamma_curve(2.2)), "x"),
}
CAMERA = CameraColour(
    np.array([[0.7, 0.2, 0.1], [0.3, 0.8, -0.1], [0.0, 0.1, 0.6]]), np.array([0.95, 1.0, 0.7]), "a chart"
)


@pytest.fixture
def radiance():
    return np.random.default_rng(3).uniform(0, 1.2, (20, 30, 3)).astype(np.float32)


@pytest.mark.parametrize("channels", [1, 3])
def test_uncalibrated_radiance_is_srgb(radiance, channels):
    shown = Rendition(channels=channels, exposure=0.7)(radiance[..., :channels])
    np.testing.assert_array_equal(shown.drive, encode_srgb(radiance[..., :channels], np.float32(0.7)))
    np.testing.assert_array_equal(
        shown.too_bright, (radiance[..., :channels] * np.float32(0.7) > 1).any(axis=-1)
    )
    assert not shown.outside.any()
    assert not shown.missing.any()
    assert Rendition(channels=channels).profile == profile("srgb", grey=channels == 1)


@pytest.mark.parametrize("method", ["cat16", "bradford"])
def test_colours_are_those_of_colour_science(radiance, method):
    shown = Rendition(display_p3(), camera=CAMERA, adaptation=method, exposure=0.5)(radiance)
    xyz = 0.5 * radiance.astype(np.float64) @ CAMERA.matrix.T
    adapted = colour.chromatic_adaptation(
        xyz,
        CAMERA.white_xyz,
        xy_to_xyz(WHITE_POINTS["D65"]),
        method="Von Kries",
        transform={"cat16": "CAT16", "bradford": "Bradford"}[method],
    )
    space = colour.RGB_COLOURSPACES["Display P3"].copy()
    space.use_derived_transformation_matrices(True)
    expected = colour.XYZ_to_RGB(adapted, space, apply_cctf_encoding=False)
    np.testing.assert_allclose(decode_srgb(shown.drive), np.clip(expected, 0, 1), atol=2e-6)
    np.testing.assert_array_equal(shown.too_bright, expected.max(axis=-1) > 1)
    np.testing.assert_array_equal(shown.outside, (expected.min(axis=-1) < -1e-4) & ~shown.too_bright)
    assert shown.outside.any()
    assert not shown.outside.all()


@pytest.mark.parametrize("name", DISPLAYS)
@pytest.mark.parametrize("white", [None, D50], ids=["the camera's white", "another"])
def test_white_is_the_displays_white(name, white):
    chosen = CAMERA.white_xyz if white is None else white
    rgb_white = np.linalg.solve(CAMERA.matrix, chosen).astype(np.float32)
    rendition = Rendition(DISPLAYS[name], camera=CAMERA, white_xyz=white, exposure=0.999)
    shown = rendition(rgb_white.reshape(1, 1, 3))
    np.testing.assert_allclose(shown.drive, 1, atol=1e-3)
    assert not shown.outside.any()


@pytest.mark.parametrize("name", ["measured", "profile"])
def test_grey_radiance_is_neutral_on_every_display(name):
    """A grey of luminance 0.2 is a fifth of the light of the display's white."""
    rendition = Rendition(DISPLAYS[name], channels=1)
    shown = rendition(np.full((1, 1, 1), 0.2, np.float32))
    white = DISPLAYS[name].decode(np.ones(3))
    np.testing.assert_allclose(DISPLAYS[name].decode(shown.drive[0, 0]), 0.2 * white, atol=2e-3)
    assert rendition.channels == 3


def test_stray_light_is_taken_off_and_darker_colours_are_outside():
    shown = Rendition(MEASURED, channels=1)(np.array([[[0.01], [0.02], [0.3]]], np.float32))
    np.testing.assert_array_equal(shown.outside, [[True, True, False]])  # the white and black differ in hue
    assert (shown.drive[0, 0] < 1e-6).all()


def test_clipped_highlights_lose_their_hue_and_compressed_ones_keep_it():
    highlight = np.array([[[4.0, 2.0, 1.0]]], np.float32)
    clipped, compressed = Rendition()(highlight), Rendition(highlights="shoulder")(highlight)
    np.testing.assert_allclose(clipped.drive, [[[1, 1, 1]]], atol=1e-7)
    linear = decode_srgb(compressed.drive)
    # 0.8 + 0.2 (1 - exp(-(4 - 0.8) / 0.2)), and the others in proportion.
    np.testing.assert_allclose(linear, [[[1, 0.5, 0.25]]], atol=1e-6)
    assert clipped.too_bright.all()
    assert compressed.too_bright.all()


def test_the_shoulder_is_smooth_and_rises():
    ramp = np.linspace(0, 1.6, 1601, dtype=np.float32)
    radiance = np.repeat(ramp[None, :, None], 3, axis=2)
    linear = decode_srgb(Rendition(highlights="shoulder")(radiance).drive)[0, :, 0]
    np.testing.assert_allclose(linear[ramp <= 0.8], ramp[ramp <= 0.8], atol=1e-6)
    slope = np.diff(linear) / 1e-3
    assert (slope > 0).all()
    assert linear.max() < 1
    # No kink: from slope 1, it falls by 5 per unit, which is 1/0.2.
    assert np.abs(np.diff(slope[10:])).max() < 5.5e-3


def test_missing_and_infinite_samples():
    radiance = np.full((1, 3, 3), 0.5, np.float32)
    radiance[0, 0, 1] = np.nan
    radiance[0, 1, 2] = np.inf
    for camera in (None, CAMERA):
        shown = Rendition(camera=camera)(radiance)
        np.testing.assert_array_equal(shown.missing, [[True, False, False]])
        np.testing.assert_array_equal(shown.drive[0, 0], [0, 0, 0])
        assert shown.too_bright[0, 1]
        assert not shown.outside[0, :2].any()
        assert np.isfinite(shown.drive).all()


def test_terms_are_those_of_colour_science():
    values = np.random.default_rng(2).uniform(0, 1, (10, 3))
    expected = colour.characterisation.polynomial_expansion_Finlayson2015(values, 2, True)
    np.testing.assert_allclose(colour_terms(values, 6), expected)
    assert colour_terms(values, 3) is values
    assert np.isfinite(colour_terms(-values * [1, 1, -1], 6)).all()


def test_camera_colour_of_a_stack():
    attributes = {"matrix": CAMERA.matrix.tolist(), "white_xyz": [0.95, 1.0, 0.7], "source": "a chart"}
    found = camera_colour(attributes)
    np.testing.assert_array_equal(found.matrix, CAMERA.matrix)
    np.testing.assert_allclose(found.xyz(np.ones(3)), CAMERA.matrix.sum(axis=1))
    assert camera_colour(None).source == "sRGB's primaries, assumed"
