"""A simulated capture from plan to fit."""

import numpy as np

import impasto
from impasto import stand
from impasto.store import open_stack


def test_a_bracketed_arm_is_captured_stacked_and_fitted_unattended(tmp_path):
    """37 angles, three exposures each: what the stack holds is what the simulated sensor saw."""
    plan, photos, store = tmp_path / "plan.toml", tmp_path / "photos", tmp_path / "painting.zarr"
    stand.plan(
        plan,
        arm_deg=range(-72, 73, 4),
        camera="simulated",
        light="simulated",
        times_s=(2, 0.25, 0.03125),
    )
    text = plan.read_text().replace("size = [192, 128]", 'size = [96, 64]\nsample = "e"')
    plan.write_text(text.replace("view = [0, 0, 1]", "view = { phi_deg = 5 }"))
    summary = stand.run(plan, photos, say=lambda line: None)
    assert summary.complete
    assert summary.taken == summary.photographs == 37 * 3 + 4
    assert summary.kept_findings == ()
    assert summary.coverage.lights == 37
    impasto.stack(photos, store)
    stack = open_stack(store)
    assert stack.shape == (37, 64, 96, 3)
    assert stack.dtype == np.float32  # brackets were merged
    assert stack.clipped_samples == 0
    fit = impasto.fit(store, models=["torrance-sparrow"])
    assert fit.models[0].pixels["converged"] > 0.9 * 64 * 96
