"""How strong the lights of photographs were, for renderings that stand beside them."""

import numpy as np
import pytest

from impasto.geometry import Lights, dome_direction
from impasto.light_strength import scale_photographed

STATED = Lights(
    ("a", "b", "c"),
    dome_direction(np.radians([20.0, 40.0, 60.0]), np.radians([0.0, 120.0, 240.0])),
    intensity=np.array([[1.0], [2.0], [0.5]]),
)


def attributes(exclude, **found):
    return {"options": {"exclude": exclude}, **found}


def term(logarithm):
    """Return a residual term that adds nothing, of strengths that are alike all around."""
    return {
        "components": 1,
        "step": [1.0],
        "toe": 0.01,
        "direction": STATED.direction.tolist(),
        "length": 0.3,
        "weights": np.zeros((1, 3, 3)).tolist(),
        "hull": [[0.0, 0.0, 1.0]],
        "fade": 0.1,
        "strength": {"table": np.full((3, 2, 4), logarithm).tolist()},
    }


def test_lights_of_a_fit_are_as_strong_as_it_found_them_less_the_trend():
    found = {
        "gain": [[1.1, 1.2, 1.3], [0.9, 0.8, 0.7], [1.0, 1.0, 1.0]],
        "trend": [[1.0, 1.0, 1.3], [0.9, 1.0, 1.0], [2.0, 1.0, 1.0]],
    }
    strong = scale_photographed(attributes([], self_calibration=found), STATED)
    expected = [[1.1, 1.2, 1.0], [2.0, 1.6, 1.4], [0.25, 0.5, 0.5]]
    np.testing.assert_allclose(strong.intensity, expected)
    assert strong.direction is STATED.direction


@pytest.mark.parametrize("told", [True, False])
def test_a_light_that_the_fit_left_out_is_as_its_neighbours_tell(told):
    found = {"gain": [[1.1] * 3, [0.9] * 3], "trend": [[1.0] * 3] * 2}
    more = {"residual": term(np.log(1.5))} if told else {}
    strong = scale_photographed(attributes(["b"], self_calibration=found, **more), STATED)
    expected = [[1.1], [3.0 if told else 2.0], [0.45]]
    np.testing.assert_allclose(strong.intensity, np.broadcast_to(expected, (3, 3)))


def test_lights_are_as_stated_where_no_fit_looked_for_their_strength():
    assert scale_photographed(attributes([]), STATED) is STATED
