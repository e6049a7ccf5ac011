"""The robust losses, on pixels a tenth of whose samples lie in cast shadows that nobody has marked."""

import numpy as np
import pytest
from benchmarks.problem import NOISE, VIEW_DIRECTION, simulate

from impasto.fit.joint import fit_tile
from impasto.fit.procedure import FitOptions
from impasto.geometry import Camera, Lights
from impasto.models import parse_model


@pytest.fixture(scope="module")
def shadowed():
    problem = simulate(2048)
    radiance = problem.radiance.copy()
    shadow = np.random.default_rng(1).random(radiance.shape[:2]) < 0.1
    radiance[shadow] *= 0.05
    return problem, radiance


def normal_errors_deg(shadowed, loss):
    problem, radiance = shadowed
    fitted = fit_tile(
        parse_model("torrance-sparrow"),
        radiance,
        lights=Lights(tuple(map(str, range(len(radiance)))), problem.light_direction),
        camera=Camera(np.array(VIEW_DIRECTION)),
        light_rgb=np.ones(3),
        clip_level=np.full(3, np.inf),
        noise=NOISE,
        options=FitOptions(loss=loss),
    )
    chord = np.linalg.norm(fitted["normal"] - problem.normal, axis=1)
    return np.degrees(2 * np.arcsin(chord / 2))


def test_cauchy_finds_the_normal_in_spite_of_shadows(shadowed):
    assert np.median(normal_errors_deg(shadowed, "cauchy")) < 0.05


def test_least_squares_does_not(shadowed):
    assert np.median(normal_errors_deg(shadowed, "linear")) > 3


def test_huber_lies_between(shadowed):
    linear, huber = (np.median(normal_errors_deg(shadowed, loss)) for loss in ("linear", "huber"))
    assert huber < linear
