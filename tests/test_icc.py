"""Tone curves of ICC profiles, against Little CMS as the outside reader."""

import imagecodecs
import numpy as np
import pytest

from icc_profiles import (
    gamma_curve,
    grey,
    old_description,
    parametric_curve,
    profile,
    rgb,
    sampled_curve,
    straight_curve,
)
from impasto import icc

CODES = np.arange(0, 65536, 257, dtype=np.uint16)
VALUES = CODES / 65535
CURVES = {
    "straight": straight_curve(),
    "gamma 1.8": gamma_curve(1.8),
    "sampled": sampled_curve(np.linspace(0, 1, 300) ** 2.2),
    "power": parametric_curve(0, 2.2),
    "CIE 122": parametric_curve(1, 2.4, 1 / 1.1, 0.1 / 1.1),
    "IEC 61966-3": parametric_curve(2, 2.4, 0.9, 0.05, 0.02),
    "sRGB": parametric_curve(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045),
    "seven numbers": parametric_curve(4, 2.2, 0.95, 0.03, 0.2, 0.06, 0.01, 0.0),
}


@pytest.mark.parametrize("name", CURVES)
def test_rgb_curves_agree_with_little_cms(name):
    made = rgb(CURVES[name])
    linear = rgb(straight_curve())
    pixels = np.repeat(CODES[:, None, None], 3, axis=2)
    expected = imagecodecs.cms_transform(
        pixels,
        made,
        linear,
        colorspace="rgb",
        outcolorspace="rgb",
        intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,  # the others move the black point
    )
    ours = icc.curves(made, VALUES)
    assert ours.shape == (len(VALUES), 3)
    # Little CMS computes with 16-bit tables.
    np.testing.assert_allclose(ours, expected[:, 0] / 65535, atol=2e-4)


def test_channels_keep_their_own_curves():
    made = rgb(gamma_curve(1.0), gamma_curve(2.0), gamma_curve(3.0))
    np.testing.assert_allclose(icc.curves(made, np.array([0.5])), [[0.5, 0.25, 0.125]])


def test_grey_profile_has_one_curve():
    np.testing.assert_allclose(
        icc.curves(grey(gamma_curve(2.0)), np.array([0.0, 0.5, 1.0])), [[0], [0.25], [1]]
    )


def test_built_in_srgb_profile_is_srgb():
    half = icc.curves(imagecodecs.cms_profile("srgb"), np.array([0.5]))
    np.testing.assert_allclose(half, 0.2140411, atol=1e-5)  # ((0.5 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(
    "made",
    [
        rgb(straight_curve(), name="Adobe RGB (1998)"),
        profile({b"desc": old_description("Adobe RGB (1998)")}, version=b"\x02\x10\0\0"),
    ],
    ids=["version 4", "version 2"],
)
def test_description(made):
    assert icc.description(made) == "Adobe RGB (1998)"


def test_profile_without_description_is_unnamed():
    made = rgb(straight_curve()).replace(b"desc", b"xxxx")
    assert icc.description(made) == "unnamed"


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (b"not a profile" * 20, "not an ICC profile"),
        (rgb(straight_curve())[:200], "cut off"),
        (profile({b"A2B0": b"mft2" + b"\0" * 48}), "look-up tables"),
        (profile({b"kTRC": straight_curve()}, space=b"CMYK"), "CMYK"),
        (rgb(b"what\0\0\0\0"), "unknown type"),
        (rgb(parametric_curve(0, 2.2)[:12]), "cut off"),
        (rgb(b"para\0\0\0\0\0\x09\0\0"), "function type 9"),
    ],
    ids=["noise", "truncated", "look-up tables", "CMYK", "unknown curve", "short curve", "unknown function"],
)
def test_unusable_profiles_are_refused(made, reason):
    with pytest.raises(ValueError, match=reason):
        icc.curves(made, VALUES)
