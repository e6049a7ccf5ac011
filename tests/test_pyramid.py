"""Coarser levels: means of what has a value, unit normals, the worst status."""

import numpy as np
import pytest

from impasto.fit.pyramid import halve, halve_normal, halve_status


def by_hand(values):
    """Average 2 x 2 blocks the slow way."""
    height, width = values.shape[:2]
    out = np.full((-(-height // 2), -(-width // 2), *values.shape[2:]), np.nan)
    for row, column in np.ndindex(out.shape[:2]):
        block = values[2 * row : 2 * row + 2, 2 * column : 2 * column + 2].reshape(-1, *values.shape[2:])
        for index in np.ndindex(out.shape[2:]):
            known = [value for value in block[(slice(None), *index)] if not np.isnan(value)]
            out[(row, column, *index)] = np.mean(known) if known else np.nan
    return out


@pytest.mark.parametrize("shape", [(6, 8), (5, 7), (5, 7, 3), (1, 1), (2, 9, 1)])
def test_a_coarser_pixel_is_the_mean_of_those_that_have_a_value(shape):
    rng = np.random.default_rng(1)
    values = rng.random(shape).astype(np.float32)
    values[rng.random(shape) < 0.4] = np.nan
    values[:2, :2] = np.nan
    coarser = halve(values)
    assert coarser.dtype == np.float32
    np.testing.assert_allclose(coarser, by_hand(values), rtol=1e-6)


def test_coarser_normals_are_unit_vectors():
    rng = np.random.default_rng(2)
    normal = rng.normal(size=(7, 6, 3)).astype(np.float32)
    normal[0, 0] = np.nan
    normal[2:4, 2:4] = np.nan
    normal[4:6, :2] = [[[1, 0, 0], [-1, 0, 0]], [[0, 1, 0], [0, -1, 0]]]
    coarser = halve_normal(normal)
    mean = by_hand(normal)
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    nowhere = np.zeros((4, 3), bool)
    nowhere[1, 1] = nowhere[2, 0] = True  # no value, and opposite directions
    np.testing.assert_array_equal(np.isnan(coarser).all(axis=-1), nowhere)
    np.testing.assert_allclose(
        coarser[~nowhere], (mean / np.where(length > 0, length, 1))[~nowhere], atol=1e-6
    )


def test_a_coarser_status_is_the_worst():
    status = np.array([[0, 2, 1, 5, 4], [0, 0, 2, 0, 3], [0, 0, 5, 4, 0], [0, 0, 0, 0, 255]], np.uint8)
    np.testing.assert_array_equal(halve_status(status), [[2, 5, 3], [0, 4, 255]])
    assert halve_status(np.array([[0, 77]], np.uint8)) == 255
