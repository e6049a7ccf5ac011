"""Robust least squares: outliers do not pull, and a prior counts as much as it says."""

import numpy as np

from impasto.fit.robust import robust_fit


def line(outliers, seed=3):
    """Return terms of a line, and 200 values 1 − 0.5 x with noise of 0.01, of which some are off."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1.0, 1.0, size=200)
    values = 1.0 - 0.5 * x + 0.01 * rng.standard_normal(200)
    values[:outliers] += 5.0
    return np.stack([np.ones_like(x), x], axis=1), values


def test_outliers_do_not_pull():
    terms, values = line(outliers=20)
    found = robust_fit(terms, values, np.ones(200), np.zeros(2), np.zeros(2))
    np.testing.assert_allclose(found, [1.0, -0.5], atol=0.005)


def test_a_prior_as_sure_as_the_values_draws_half_the_way():
    terms, values = line(outliers=0)
    free = robust_fit(terms[:, 1:], values - 1.0, np.ones(200), np.zeros(1), np.zeros(1))
    # Σx² / σ² is the precision of a slope through the origin.
    precision = np.square(terms[:, 1:]).sum(axis=0) / 0.01**2
    drawn = robust_fit(terms[:, 1:], values - 1.0, np.ones(200), precision, free + 0.004)
    assert 0.4 < (drawn - free) / 0.004 < 0.7
