"""The core is compiled for several sets of instructions: all that this processor has must fit the same."""

import os
import subprocess
import sys

import numpy as np
import pytest
from benchmarks.problem import simulate
from benchmarks.speed import fit_core
from tests.test_residual import photographed

from impasto import _core
from impasto.fit.remainder import left_over

_FIT = """
import sys
import numpy as np
from benchmarks.problem import simulate
from benchmarks.speed import fit_core
from tests.test_instructions import codes
from impasto import _core
assert _core.instructions() == sys.argv[1]
np.savez(sys.argv[2], codes=codes(), **fit_core(simulate(4096)))
"""


def codes():
    """Return codes of what a model leaves over of photographs."""
    encoder = np.random.default_rng(3).normal(scale=3e3, size=(18, 27)).astype(np.float32)
    return left_over(*photographed(1200, 3), 0.004, encoder)


@pytest.mark.parametrize("name", _core.available_instructions()[:-1])
def test_all_versions_of_the_core_agree(name, tmp_path):
    other_file = tmp_path / "other.npz"
    subprocess.run(
        [sys.executable, "-c", _FIT, name, str(other_file)],
        env={**os.environ, "IMPASTO_INSTRUCTIONS": name, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
    )
    other = np.load(other_file)
    here = fit_core(simulate(4096))
    np.testing.assert_array_equal(other["status"], here["status"])
    # Both stop within a small part of the uncertainty of the minimum, by another rounding.
    difference = np.abs(other["shape"] / here["shape"] - 1)
    assert np.median(difference) < 1e-4
    assert np.quantile(difference, 0.95) < 5e-3
    # Another rounding leads a pixel in ten thousand into another valley.
    change = np.abs(other["chi2_reduced"] / here["chi2_reduced"] - 1)
    assert np.count_nonzero(change > 2e-3) <= 0.001 * len(change)
    assert np.abs(other["codes"].astype(int) - codes()).max() <= 1
