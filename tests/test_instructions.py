"""The core is compiled twice, for any processor and for one with AVX2 and FMA: both must fit the same."""

import os
import subprocess
import sys

import numpy as np
from benchmarks.problem import simulate
from benchmarks.speed import fit_core

_FIT_PLAIN = """
import sys
import numpy as np
from benchmarks.problem import simulate
from benchmarks.speed import fit_core
from impasto import _core
assert not _core.fast_instructions()
np.savez(sys.argv[1], **fit_core(simulate(512)))
"""


def test_both_versions_of_the_core_agree(tmp_path):
    plain_file = tmp_path / "plain.npz"
    subprocess.run(
        [sys.executable, "-c", _FIT_PLAIN, str(plain_file)],
        env={**os.environ, "IMPASTO_PLAIN": "1"},
        check=True,
    )
    plain = np.load(plain_file)
    here = fit_core(simulate(512))
    np.testing.assert_array_equal(plain["status"], here["status"])
    # Both stop within a small part of the uncertainty of the minimum, by another rounding.
    difference = np.abs(plain["shape"] / here["shape"] - 1)
    assert np.median(difference) < 1e-4
    assert np.quantile(difference, 0.95) < 5e-3
    np.testing.assert_allclose(plain["chi2_reduced"], here["chi2_reduced"], rtol=2e-3)
