"""Ties: the fit against the likelihood itself, and what becomes of tables with none, few or nothing else."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import ndtr, xlogy

import impasto
from impasto.psychophysics.scaling.batch import fit_batch
from impasto.psychophysics.scaling.groups import ScaleOptions
from impasto.psychophysics.scaling.likelihood import pair_design
from impasto.psychophysics.scaling.ties import fit_ties_batch

TWO = pair_design(2)[0]
THREE = pair_design(3)[0]
# Wins, losses and ties of each table; few ties make the threshold small, where steps must not pass 0.
TABLES = {
    "few ties": (TWO, [11], [7], [2]),
    "many ties": (TWO, [3], [2], [15]),
    "one way and ties": (TWO, [11], [1], [8]),
    "three conditions": (THREE, [9, 12, 8], [5, 4, 7], [4, 2, 3]),
    "ties on one pair only": (THREE, [9, 12, 0], [9, 6, 0], [0, 0, 18]),
}


def trials(tmp_path, answers):
    """Write a row for each observer and pair of an iterable of (first, second, choice)."""
    path = tmp_path / "trials.csv"
    rows = [f"p{number % 18},a,0,{first},{second},{choice}" for number, (first, second, choice) in answers]
    path.write_text("\n".join(["observer,sample,angle,condition_A,condition_B,choice", *rows]) + "\n")
    return path


@pytest.mark.parametrize("name", TABLES)
def test_the_fit_is_the_maximum_of_the_likelihood(name):
    design, *counts = TABLES[name]
    won, lost, even = (np.array(count, dtype=float) for count in counts)

    def against(parameters):
        *free, threshold = parameters
        predictor = design[:, 1:] @ free
        win, loss = ndtr(predictor - threshold), ndtr(-predictor - threshold)
        return -np.sum(xlogy(won, win) + xlogy(lost, loss) + xlogy(even, 1 - win - loss))

    conditions = design.shape[1]
    bounds = [(-9, 9)] * (conditions - 1) + [(1e-6, 9)]
    exact = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 5000, "maxfev": 5000}
    start = [0.1] * (conditions - 1) + [0.4]
    expected = minimize(against, start, bounds=bounds, method="Nelder-Mead", options=exact)
    found = fit_ties_batch(design, won[None], lost[None], even[None], conditions=conditions)
    assert found.converged.all()
    scale, threshold = found.parameters[0, :-1], found.parameters[0, -1]
    assert [*(scale - scale[0])[1:], threshold] == pytest.approx(expected.x, abs=1e-5)
    assert against([*(scale - scale[0])[1:], threshold]) <= expected.fun + 1e-9


def test_tables_without_ties_are_fitted_beside_those_with_some():
    won, lost, even = (np.array([[a], [b]], dtype=float) for a, b in ((11, 13), (7, 5), (2, 0)))
    found = fit_ties_batch(TWO, won, lost, even, conditions=2, reduce_bias=True)
    without = fit_batch(TWO, won, lost, conditions=2, reduce_bias=True)
    assert found.converged.all()
    assert found.parameters[1] == pytest.approx([*without.parameters[1], 0])
    assert found.covariance[1, :2, :2] == pytest.approx(without.covariance[1])
    assert found.parameters[0, -1] > 0.05


@pytest.mark.parametrize("pairs", [["xy"], ["xy", "xz", "yz"]])
def test_nothing_but_ties_tells_nothing(tmp_path, pairs):
    path = trials(tmp_path, enumerate((*pair, "tie") for pair in pairs for _ in range(18)))
    (group,) = impasto.scale(path, out=tmp_path / "out").groups
    assert (group.status, group.limits, group.ties) == ("unbounded", "none", 18 * len(pairs))
    assert np.isnan([*group.scale, *group.low, *group.high, group.threshold]).all()
    assert any("all answers are ties" in note for note in group.notes)


def test_each_model_says_how_it_takes_ties(tmp_path):
    choices = ["A", "A", "B", "tie"]
    answers = [(*pair, choices[(number + len(pair[1:]) * place) % 4])
               for place, pair in enumerate(("xy", "xz", "yz")) for number in range(18)]  # fmt: skip
    path = trials(tmp_path, enumerate(answers))
    by_model = {
        model: impasto.scale(path, options=ScaleOptions(model=model)).groups[0]
        for model in ("case-v", "closed-form", "bradley-terry")
    }
    assert by_model["case-v"].threshold == by_model["closed-form"].threshold > 0.2
    # Half a choice for each: there is no threshold.
    assert np.isnan(by_model["bradley-terry"].threshold)
    assert {group.ties for group in by_model.values()} == {sum(choice == "tie" for *_, choice in answers)}
    assert all(group.agreement is None for group in by_model.values())
    likelihood = impasto.scale(path, options=ScaleOptions(limits="likelihood")).groups[0]
    assert any("a tie as half a choice" in note for note in likelihood.notes)
