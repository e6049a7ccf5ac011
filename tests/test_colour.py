"""Transfer functions and display values."""

import imagecodecs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icc_profiles import gamma_curve, grey, profile, rgb
from impasto.colour import decode_srgb, encode_srgb, linearisation_table, quantise
from impasto.errors import OptionError


def test_srgb_by_hand():
    # IEC 61966-2-1: 0.04 lies on the straight piece, 0.5 on the power.
    np.testing.assert_allclose(decode_srgb([0.04, 0.5]), [0.04 / 12.92, 0.21404114048223255], rtol=1e-12)
    np.testing.assert_allclose(encode_srgb(np.array([0.002, 0.2140411404])), [0.02584, 0.5], rtol=1e-9)


def test_srgb_agrees_with_little_cms():
    codes = np.repeat(np.arange(65536, dtype=np.uint16)[::97, None, None], 3, axis=2)
    linear = imagecodecs.cms_profile(
        "rgb", whitepoint=(0.3127, 0.3290), primaries=(0.64, 0.33, 0.30, 0.60, 0.15, 0.06), gamma=1.0
    )
    expected = imagecodecs.cms_transform(
        codes, imagecodecs.cms_profile("srgb"), linear, colorspace="rgb", outcolorspace="rgb"
    )
    np.testing.assert_allclose(decode_srgb(codes / 65535), expected / 65535, atol=2e-4)


@given(st.floats(0, 1))
def test_encoding_undoes_decoding(value):
    assert encode_srgb(decode_srgb(np.array(value))) == pytest.approx(value, abs=1e-7)


def test_encoding_stays_in_range():
    image_linear = np.array([[0.5, 1.5, -0.1], [np.nan, np.inf, 0.0]], np.float32)
    image_srgb = encode_srgb(image_linear)
    assert image_srgb.dtype == np.float32
    np.testing.assert_allclose(image_srgb[0, 1:], [1, 0], atol=1e-7)
    np.testing.assert_allclose(image_srgb[1], [0, 1, 0], atol=1e-7)


def test_exposure_scales_the_radiance():
    np.testing.assert_allclose(encode_srgb(np.array([0.25]), exposure=2), encode_srgb(np.array([0.5])))


@pytest.mark.parametrize(("dtype", "codes"), [(np.uint8, [0, 128, 255]), (np.uint16, [0, 32768, 65535])])
def test_quantise_rounds(dtype, codes):
    quantised = quantise(np.array([0.0, 0.5, 1.0]), dtype)
    assert quantised.dtype == dtype
    np.testing.assert_array_equal(quantised, codes)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize(("transfer", "half"), [("linear", 0.5), ("srgb", 0.21404), ("gamma:1.8", 0.5**1.8)])
def test_linearisation_table(transfer, half, dtype):
    table = linearisation_table(transfer, dtype)
    assert table.shape == (np.iinfo(dtype).max + 1,)
    assert table[0] == 0
    assert table[-1] == pytest.approx(1)
    assert (np.diff(table) > 0).all()
    assert np.interp(0.5, np.linspace(0, 1, len(table)), table) == pytest.approx(half, abs=2e-5)


def test_linearisation_table_of_a_profile():
    assert linearisation_table("icc:x", np.uint8, grey(gamma_curve(2.0))).shape == (256,)
    alike = linearisation_table("icc:x", np.uint8, rgb(gamma_curve(2.0)))
    assert alike.shape == (256,)
    differing = linearisation_table(
        "icc:x", np.uint8, rgb(gamma_curve(1.0), gamma_curve(2.0), gamma_curve(3.0))
    )
    assert differing.shape == (256, 3)
    np.testing.assert_allclose(differing[51], [0.2, 0.04, 0.008])


@pytest.mark.parametrize(
    ("transfer", "dtype", "icc_profile", "reason"),
    [
        ("rec709", np.uint8, None, "not a known transfer function"),
        ("gamma:two", np.uint8, None, "number above 0"),
        ("gamma:-1", np.uint8, None, "number above 0"),
        ("gamma:nan", np.uint8, None, "number above 0"),
        ("icc:lost", np.uint8, None, "not there"),
        ("icc:tables", np.uint8, profile({b"A2B0": b"mft2" + b"\0" * 48}), "look-up tables"),
        ("linear", np.float32, None, "no table for float32"),
    ],
)
def test_unusable_transfer_functions(transfer, dtype, icc_profile, reason):
    with pytest.raises(OptionError, match=reason):
        linearisation_table(transfer, dtype, icc_profile)
