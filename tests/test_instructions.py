"""The core is compiled for several sets of instructions: all that this processor has must fit the same."""

import os
import subprocess
import sys

import numpy as np
import pytest
from benchmarks.problem import simulate
from benchmarks.speed import fit_core

from impasto import _core

_FIT = """
import sys
import numpy as np
from benchmarks.problem import simulate
from benchmarks.speed import fit_core
from impasto import _core
assert _core.instructions() == sys.argv[1]
np.savez(sys.argv[2], **fit_core(simulate(4096)))
"""


@pytest.mark.parametrize("name", _core.available_instructions()[:-1])
def test_all_versions_of_the_core_agree(name, tmp_path):
    other_file = tmp_path / "other.npz"
    subprocess.run(
        [sys.executable, "-c", _FIT, name, str(other_file)],
        env={**os.environ, "IMPASTO_INSTRUCTIONS": name},
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
