"""Colour spaces, adaptation and displays, against colour-science and Little CMS."""

import colour
import imagecodecs
import numpy as np
import pytest

from icc_profiles import gamma_curve, grey, parametric_curve, profile, rgb, tables
from impasto.colour import decode_srgb, encode_srgb
from impasto.colour.adaptation import ADAPTATIONS, WHITE_POINTS, adaptation_matrix, xy_to_xyz
from impasto.colour.displays import (
    AdditiveDisplay,
    GainOffsetGamma,
    LookUpTables,
    display_p3,
    srgb_display,
)
from impasto.colour.icc_display import icc_display
from impasto.colour.primaries import DISPLAY_P3, SRGB, rgb_to_xyz_matrix
from impasto.errors import OptionError

OBSERVER = "CIE 1931 2 Degree Standard Observer"
SPACES = {"sRGB": SRGB, "Display P3": DISPLAY_P3}
SRGB_CURVE = parametric_curve(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)

# What a measured display could be: stray light, and a red of little light.
MATRIX = np.diag([0.93, 0.99, 0.96]) @ rgb_to_xyz_matrix(DISPLAY_P3)
BLACK = np.array([0.004, 0.004, 0.006])


@pytest.fixture(scope="module")
def drives():
    # The darkest drives of a measured display show nothing.
    return np.random.default_rng(4).uniform(0.06, 1, (500, 3))


@pytest.mark.parametrize("name", WHITE_POINTS)
def test_white_points_are_those_of_colour_science(name):
    expected = colour.CCS_ILLUMINANTS[OBSERVER][name]
    np.testing.assert_allclose(WHITE_POINTS[name], expected, atol=1e-9)
    np.testing.assert_allclose(xy_to_xyz(WHITE_POINTS[name]), colour.xy_to_XYZ(expected), atol=1e-9)


@pytest.mark.parametrize("name", SPACES)
def test_matrices_are_those_of_colour_science(name):
    space = colour.RGB_COLOURSPACES[name].copy()
    ours = rgb_to_xyz_matrix(SPACES[name])
    np.testing.assert_allclose(ours, space.matrix_RGB_to_XYZ, atol=6e-5)  # rounded in the standard
    space.use_derived_transformation_matrices(True)
    np.testing.assert_allclose(ours, space.matrix_RGB_to_XYZ, atol=1e-14)


@pytest.mark.parametrize("method", ADAPTATIONS)
@pytest.mark.parametrize(("source", "target"), [("A", "D65"), ("D65", "D50"), ("D50", "D65")])
def test_adaptation_is_that_of_colour_science(method, source, target):
    source, target = xy_to_xyz(WHITE_POINTS[source]), xy_to_xyz(WHITE_POINTS[target])
    expected = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        source, target, transform={"cat16": "CAT16", "bradford": "Bradford"}[method]
    )
    ours = adaptation_matrix(2.5 * source, target, method)
    np.testing.assert_allclose(ours, expected, atol=1e-12)
    np.testing.assert_allclose(ours @ source, target)


@pytest.mark.parametrize("display", [srgb_display(), display_p3()], ids=["sRGB", "Display P3"])
def test_standard_displays_show_what_colour_science_says(display, drives):
    space = colour.RGB_COLOURSPACES[display.name].copy()
    space.use_derived_transformation_matrices(True)
    expected = colour.RGB_to_XYZ(drives, space, apply_cctf_decoding=True)
    np.testing.assert_allclose(display.decode(drives), expected, atol=1e-6)


def test_gain_offset_gamma_by_hand():
    curves = GainOffsetGamma(np.full(3, 1.1), np.full(3, -0.1), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(curves.decode([0.5, 0.5, 0.5]), [0.45, 0.45**2, 0.45**3])
    np.testing.assert_array_equal(curves.decode([0.05] * 3), [0, 0, 0])
    np.testing.assert_allclose(curves.encode(np.array([[-0.2, 1.0, 1.7]])), [[0.1 / 1.1, 1, 1]])


def test_tables_by_hand():
    curves = LookUpTables(np.array([0, 0.5, 1.0]), np.array([[0, 0.2, 1], [0, 0.1, 1], [0, 0.5, 1]]))
    np.testing.assert_allclose(curves.decode([0.25, 0.75, 0.75]), [0.1, 0.55, 0.75])
    np.testing.assert_allclose(curves.encode(np.array([[0.6, 0.55, 1.2]])), [[0.75, 0.75, 1]])


def measured(name):
    curves = {
        "gain-offset-gamma": GainOffsetGamma(
            np.array([1.02, 1.0, 1.05]), np.array([-0.02, 0, -0.05]), np.array([2.2, 2.4, 1.9])
        ),
        "tables": LookUpTables(
            np.linspace(0, 1, 18), np.linspace(0, 1, 18) ** np.array([[2.2], [2.4], [1.9]])
        ),
    }[name]
    return AdditiveDisplay(name, MATRIX, BLACK, curves)


@pytest.mark.parametrize(
    "display",
    [
        srgb_display(),
        display_p3(),
        measured("gain-offset-gamma"),
        measured("tables"),
        icc_display(rgb(gamma_curve(2.2)), "x"),
    ],
    ids=lambda display: display.name,
)
def test_displays_invert(display, drives):
    xyz = display.decode(drives)
    linear = np.linalg.solve(display.matrix, (xyz - display.black).T).T
    again = display.encode(linear)
    np.testing.assert_allclose(again, drives, atol=2e-4)
    everything = np.ones(len(drives), bool)
    assert not display.outside(linear, again, everything).any()
    beyond = linear - np.array([1.2 * linear.max(), 0, 0])
    assert display.outside(beyond, display.encode(beyond), everything).all()
    assert not display.outside(beyond, display.encode(beyond), ~everything).any()


def test_black_shows_the_stray_light():
    np.testing.assert_allclose(measured("tables").decode(np.zeros(3)), BLACK)


def lcms(values, source, target, spaces, dtype):
    return imagecodecs.cms_transform(
        values[np.newaxis].astype(dtype),
        source,
        target,
        colorspace=spaces[0],
        outcolorspace=spaces[1],
        intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
        flags=imagecodecs.CMS.FLAGS.NOOPTIMIZE,
    )[0]


@pytest.mark.parametrize("display", [srgb_display(), display_p3()], ids=["sRGB", "Display P3"])
def test_profiles_mean_what_the_display_shows(display, drives):
    """Little CMS goes from one profile to the other as we go from one display to the other."""
    other = AdditiveDisplay("wide", rgb_to_xyz_matrix([(0.73, 0.26), (0.12, 0.8), (0.14, 0.04)]), np.zeros(3),
                            GainOffsetGamma(np.ones(3), np.zeros(3), np.full(3, 1.8)))  # fmt: skip
    linear = np.linalg.solve(other.matrix, display.decode(drives).T).T
    ours = other.encode(linear)
    floats = lcms(drives, display.profile, other.profile, ("rgb", "rgb"), np.float64)
    np.testing.assert_allclose(ours, floats, atol=2e-3)  # a profile's curves hold 16 bits, coarse near black
    codes = lcms(np.rint(drives * 65535), display.profile, other.profile, ("rgb", "rgb"), np.uint16)
    np.testing.assert_allclose(ours, codes / 65535, atol=2e-3)


def test_a_profile_is_followed_as_little_cms_does(drives):
    made = rgb(gamma_curve(1.8), gamma_curve(2.2), gamma_curve(2.4))
    display = icc_display(made, "x")
    d50 = lcms(drives, made, imagecodecs.cms_profile("xyz"), ("rgb", "xyz"), np.float64)
    np.testing.assert_allclose(display.decode(drives), d50, atol=1e-9)
    linear = np.linalg.solve(display.matrix, d50.T).T
    expected = lcms(d50, imagecodecs.cms_profile("xyz"), made, ("xyz", "rgb"), np.float64)
    np.testing.assert_allclose(display.encode(linear), expected, atol=1e-6)
    np.testing.assert_allclose(display.encode(linear.astype(np.float32)), expected, atol=1e-5)


def test_the_profile_of_srgb_is_srgb():
    """Its white is D65 again: the profile's own adaptation to D50 is undone."""
    profiled, ours = icc_display(srgb_display().profile, "x"), srgb_display()
    np.testing.assert_allclose(profiled.matrix, ours.matrix, atol=2e-5)
    drives = np.linspace(0, 1, 27).reshape(9, 3)
    np.testing.assert_allclose(profiled.decode(drives), ours.decode(drives), atol=3e-5)


def test_old_profiles_state_their_white_alone():
    d65 = (0.9505, 1.0, 1.0891)
    white = b"XYZ \0\0\0\0" + np.rint(np.array(d65) * 65536).astype(">i4").tobytes()
    curves = {name: SRGB_CURVE for name in (b"rTRC", b"gTRC", b"bTRC")}
    old = icc_display(profile({**curves, b"wtpt": white}, version=b"\x02\x10\0\0"), "x")
    np.testing.assert_allclose(old.matrix.sum(axis=1), d65, atol=1e-3)
    np.testing.assert_allclose(old.matrix, rgb_to_xyz_matrix(SRGB), atol=1e-3)


def lab_of(drive):
    xyz = decode_srgb(drive) @ icc_display(rgb(SRGB_CURVE), "x").matrix.T
    lab = colour.XYZ_to_Lab(xyz, WHITE_POINTS["D50"])
    return (lab + np.array([0, 128, 128])) / [100, 255, 255] * 65280 / 65535


def drive_of(lab):
    xyz = colour.Lab_to_XYZ(lab * 65535 / 65280 * [100, 255, 255] - [0, 128, 128], WHITE_POINTS["D50"])
    matrix = icc_display(rgb(SRGB_CURVE), "x").matrix
    return encode_srgb(xyz @ np.linalg.inv(matrix).T)


def test_profiles_of_tables_are_followed():
    """The same display in tables: coarser, but with the same colours and the same gamut."""
    display = icc_display(tables(lab_of, drive_of, grid=33), "x")
    matrix = icc_display(rgb(SRGB_CURVE), "x").matrix
    drives = np.random.default_rng(1).uniform(0.35, 0.75, (200, 3))  # tables blur the edge of the gamut
    xyz = decode_srgb(drives) @ matrix.T
    linear = np.linalg.solve(display.matrix, xyz.T).T
    shown = display.encode(linear)
    np.testing.assert_allclose(decode_srgb(shown), decode_srgb(drives), atol=4e-3)
    assert not display.outside(linear, shown, np.ones(200, bool)).any()
    vivid = np.linalg.solve(display.matrix, rgb_to_xyz_matrix(DISPLAY_P3) @ [0.0, 0.6, 0.0])[np.newaxis]
    assert display.outside(vivid, display.encode(vivid), np.ones(1, bool)).all()


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (b"not a profile" * 20, "not an ICC profile"),
        (grey(gamma_curve(2.2)), "GRAY colours, expected RGB"),
        (profile({b"A2B0": b"mft2" + b"\0" * 48}), "Little CMS"),
    ],
    ids=["noise", "grey", "damaged"],
)
def test_unusable_profiles_are_refused(made, reason):
    with pytest.raises(OptionError, match=reason):
        icc_display(made, "display.icc")
