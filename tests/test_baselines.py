"""Relighting methods without a model: each meets what it can describe, and none sees what is held out."""

import numpy as np
import pytest

import impasto
from impasto.evaluate.baselines import harmonics, methods, polynomial
from impasto.geometry import dome_direction

RNG = np.random.default_rng(8)
ZENITH = np.arccos(RNG.uniform(0.2, 1.0, 40))
SEEN = dome_direction(ZENITH, RNG.uniform(0, 2 * np.pi, 40))
WANTED = dome_direction(np.radians([20.0, 45.0, 60.0]), [0.3, 2.0, 4.0])


@pytest.mark.parametrize(
    ("name", "basis"),
    [
        ("PTM", polynomial),
        ("HSH order 2", lambda direction: harmonics(direction, 2, hemisphere=True)),
        ("HSH order 3", lambda direction: harmonics(direction, 3, hemisphere=True)),
        ("SH order 2", lambda direction: harmonics(direction, 2, hemisphere=False)),
        ("Lambert", lambda direction: direction),
        ("RBF (thin plate)", lambda direction: 0.3 + direction[:, :2]),
    ],
)
def test_each_method_meets_what_its_functions_span(name, basis):
    (method,) = [method for method in methods(SEEN, WANTED) if method.name == name]
    factors = RNG.normal(size=(basis(SEEN).shape[1], 5, 3)).astype(np.float32)
    predicted = method.predict(np.tensordot(basis(SEEN).astype(np.float32), factors, 1))
    np.testing.assert_allclose(predicted, np.tensordot(basis(WANTED), factors, 1), atol=2e-3)


def test_lrgb_keeps_one_colour_and_the_nearest_is_a_photograph():
    found = {method.name: method for method in methods(SEEN, WANTED)}
    photographs = RNG.uniform(0.1, 1.0, size=(40, 6, 1)).astype(np.float32) * np.array(
        [0.5, 1.0, 0.2], np.float32
    )
    predicted = found["LRGB PTM"].predict(photographs)
    np.testing.assert_allclose(predicted[..., 0] / predicted[..., 1], 0.5, rtol=1e-4)
    nearest = found["nearest photograph"].predict(photographs)
    assert (nearest[1] == photographs[np.argmax(SEEN @ WANTED[1])]).all()


def test_few_lights_leave_out_what_they_cannot_tell():
    names = [method.name for method in methods(SEEN[:7], WANTED)]
    assert "PTM" in names
    assert "HSH order 2" not in names


@pytest.mark.parametrize("azimuth", [0.0, 0.7])
def test_splines_of_lights_on_an_arm_curve_along_it_alone(azimuth):
    arm = dome_direction(np.radians(np.linspace(-70, 70, 15)), azimuth)
    seen, wanted = np.delete(arm, 6, axis=0), arm[6:7]
    (method,) = [method for method in methods(seen, wanted) if method.name == "RBF (thin plate)"]
    lines = (0.3 + seen[:, :2]).astype(np.float32)[:, None]
    np.testing.assert_allclose(method.predict(lines)[:, 0], 0.3 + wanted[:, :2], atol=1e-5)
    np.testing.assert_allclose(method.predict(seen[:, None])[:, 0], wanted, atol=2e-3)


def test_splines_take_the_mean_of_two_photographs_under_one_light():
    twice = np.vstack([SEEN[:8], SEEN[:1]])
    (method,) = [method for method in methods(twice, SEEN[:1]) if method.name == "RBF (thin plate)"]
    np.testing.assert_allclose(method.weights, [[0.5, 0, 0, 0, 0, 0, 0, 0, 0.5]], atol=1e-9)


def test_held_out_photographs_do_not_enter(painting):
    held = ("light-003", "light-009")
    summary = impasto.evaluate(painting, models=["lambert"], held_out_lights=held)
    assert {found.method for found in summary.baselines} >= {"PTM", "LRGB PTM", "HSH order 2", "Lambert"}
    nearest = next(found for found in summary.baselines if found.method == "nearest photograph")
    assert nearest.coefficients == 14
    assert nearest.mean.psnr_db < 60  # a photograph that it had seen would be met exactly
    assert all(0 < found.mean.ciede2000 < 50 for found in summary.baselines)
    assert impasto.evaluate(painting, models=["lambert"], held_out=1, baselines=False).baselines == ()
