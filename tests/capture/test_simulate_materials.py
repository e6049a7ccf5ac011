"""The simulator's models against outside figures: scipy's fits to measured materials, and hand values."""

import json

import numpy as np
import pytest

from impasto.capture.simulate.materials import (
    SHAPES,
    diffuse_term,
    fresnel,
    native_parameters,
    specular_term,
    trowbridge_reitz,
    v_groove,
)
from impasto.capture.simulate.measured import read_measured
from impasto.errors import OptionError
from impasto.geometry import arm_direction, dome_direction

UP = np.array([[0.0, 0.0, 1.0]])
# Name in measured_rms.json: our model, and its shape from the third parameter.
FITTED = {"ts": "torrance-sparrow", "ts_gauss": "torrance-sparrow-gaussian", "phong_noambient": "phong"}
SPECULAR = [model for model in SHAPES if model != "lambert"]


@pytest.fixture(scope="module")
def measured(shared):
    return read_measured(shared / "reference" / "measured_brdf.npz")


@pytest.mark.parametrize("fitted", FITTED)
def test_scipys_fits_to_measured_materials_have_the_published_residuals(shared, measured, fitted):
    """Eighty materials, light every 2.5° in a plane, view 5° out: networks, models and protocol at once."""
    published = json.loads((shared / "reference" / "measured_rms.json").read_text())["materials"]
    lights = arm_direction(np.radians(np.arange(-75, 75.1, 2.5)))
    view = np.array([0.0, np.sin(np.radians(5)), np.cos(np.radians(5))])
    normal = np.repeat(UP, len(lights), axis=0)
    cosine = diffuse_term(normal, lights, view)
    luminance = np.array([0.2126, 0.7152, 0.0722])
    ours, theirs = [], []
    for name, entry in published.items():
        brdf = measured.brdf(name, normal, lights, view)
        truth = (brdf @ luminance) * cosine
        fit = entry["models"][fitted]
        diffuse, specular, shape = fit["parameters"][:3]
        shapes = np.full(len(lights), shape)
        if not 0 < shape <= 1 and fitted == "ts":
            continue  # beyond the model's domain, where scipy's bounds let it go
        lobe = specular_term(FITTED[fitted], normal, lights, view, shapes)
        residual = truth - diffuse * cosine - specular * lobe
        ours.append(np.sqrt(np.mean(residual**2)) / truth.mean())
        theirs.append(fit["rms_over_mean"])
    assert len(ours) >= 78
    np.testing.assert_allclose(ours, theirs, rtol=2e-3, atol=2e-5)


def test_fresnel_at_normal_incidence_at_brewsters_angle_and_at_grazing():
    brewster = np.cos(np.arctan(1.5))
    np.testing.assert_allclose(fresnel(np.array([1.0, 0.0]), 1.5), [0.04, 1.0], rtol=1e-12)
    # Only the s-polarised half is left: ((1 − 1.5²)/(1 + 1.5²))² / 2.
    assert fresnel(np.array(brewster), 1.5) == pytest.approx((1.25 / 3.25) ** 2 / 2, rel=1e-12)


def test_trowbridge_reitz_by_hand():
    # cos²δ = 3/4, c² = 1/4: (1/4 / (3/4 · −3/4 + 1))² = (4/7)².
    value = trowbridge_reitz(np.array(np.sqrt(0.75)), np.array(0.5))
    assert value == pytest.approx((4 / 7) ** 2, rel=1e-12)


def test_v_groove_by_hand():
    assert v_groove(*np.array([0.2, 0.5, 0.8, 0.4])) == pytest.approx(2 * 0.8 * 0.2 / 0.4, rel=1e-12)
    assert v_groove(*np.array([0.9, 0.9, 1.0, 0.9])) == 1.0


@pytest.mark.parametrize("model", SPECULAR)
def test_only_phong_is_not_reciprocal(model):
    """The BRDF, radiance over n·l, stays the same when light and camera change places."""
    rng = np.random.default_rng(3)
    light, view = (dome_direction(rng.uniform(0, 1.4, 200), rng.uniform(0, 2 * np.pi, 200)) for _ in range(2))
    normal = np.repeat(UP, 200, axis=0)
    shape = np.full(200, 0.3 if model != "phong" else 20.0)
    there = specular_term(model, normal, light, view, shape) / light[:, 2]
    back = specular_term(model, normal, view, light, shape) / view[:, 2]
    assert np.allclose(there, back, rtol=1e-9, atol=1e-12) == (model != "phong")


def test_a_smooth_interface_reflects_a_twenty_fifth():
    """With κ = 1 the Smith lobe sends back Fresnel's 4 % of a frontal light, over the whole hemisphere.

    Facets that lean by more than 45° send it downwards: α²/(1 + α²) of all. Masking takes less again.
    """
    zenith, azimuth = np.meshgrid(
        (np.arange(2000) + 0.5) * np.pi / 4000, np.arange(8) * np.pi / 4, indexing="ij"
    )
    view = dome_direction(zenith.ravel(), azimuth.ravel())
    solid_angle = np.sin(zenith.ravel()) * (np.pi / 4000) * (np.pi / 4)
    for alpha in (0.0172, 0.1, 0.3):
        specular, shape = native_parameters("torrance-sparrow-smith", np.array(alpha), np.array(1.0))
        normal = np.repeat(UP, len(view), axis=0)
        # Relative radiance is π times the BRDF times the cosine of incidence, here 1.
        lobe = specular * specular_term(
            "torrance-sparrow-smith", normal, UP[0], view, np.full(len(view), shape)
        )
        reflected = np.sum(lobe / np.pi * view[:, 2] * solid_angle)
        down = alpha**2 / (1 + alpha**2)
        assert 0.04 * (1 - 1.5 * down) * (1 - 1e-3) < reflected < 0.04 * (1 - down) * (1 + 3e-3)


@pytest.mark.parametrize("model", SPECULAR)
def test_all_models_share_the_peak_and_the_width_about_it(model):
    alpha = np.array([0.05])
    specular, shape = native_parameters(model, alpha, np.array([1.0]))
    off = arm_direction(np.radians([0.0, 0.5]))
    lobe = [(specular * specular_term(model, UP, light, UP[0], shape))[0] for light in off]
    assert lobe[0] == pytest.approx(0.04 / (4 * 0.05**2), rel=1e-9)
    # Second order: 1 − 2δ²/α² with δ a quarter of a degree.
    assert 1 - lobe[1] / lobe[0] == pytest.approx(2 * np.radians(0.25) ** 2 / 0.05**2, rel=0.03)


@pytest.mark.parametrize("model", SHAPES)
def test_nothing_comes_from_behind(model):
    shape = np.array([0.3])
    below, view = np.array([0.6, 0.0, -0.8]), np.array([0.0, 0.0, 1.0])
    for light_direction, view_direction in ((below, view), (view, below)):
        assert specular_term(model, UP, light_direction, view_direction, shape) == 0
        assert diffuse_term(UP, light_direction, view_direction) == 0


def test_measured_values_stay_finite_and_stop_changing_near_grazing(measured):
    angles = np.radians([0.0, 30.0, 80.0, 81.0, 89.9])
    brdf = measured.brdf("merl/blue-rubber", np.repeat(UP, 5, axis=0), arm_direction(angles), UP[0])
    assert np.isfinite(brdf).all()
    assert (brdf >= 0).all()
    np.testing.assert_allclose(brdf[3:], brdf[[2, 2]], rtol=1e-6)
    assert not np.allclose(brdf[1], brdf[2], rtol=1e-3)


def test_measured_materials_do_not_care_how_the_surface_is_turned(measured):
    rng = np.random.default_rng(5)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    light, view = arm_direction(np.radians(35.0)), np.array([0.0, 0.2, np.sqrt(0.96)])
    upright = measured.brdf("merl/green-latex", UP, light, view)
    turned = measured.brdf("merl/green-latex", UP @ turn.T, turn @ light, turn @ view)
    np.testing.assert_allclose(turned, upright, rtol=1e-4)


def test_a_damaged_file_and_an_unknown_material_are_named(tmp_path, measured):
    path = tmp_path / "set.npz"
    path.write_bytes(b"PK no archive")
    with pytest.raises(OptionError, match="cannot be read as a file of measured materials"):
        read_measured(path)
    np.savez(path, names=np.array(["one"]), weights=np.zeros((1, 600), np.float32))
    with pytest.raises(OptionError, match=r"\(1, 600\), expected \(1, 675\)"):
        read_measured(path)
    with pytest.raises(OptionError, match=r"merl/gold-leaf: is not in .* Choose one of: merl/alum-bronze"):
        measured.brdf("merl/gold-leaf", UP, UP[0], UP[0])
