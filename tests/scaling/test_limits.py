"""Limits: what they cover, what they refuse, and what they say about themselves."""

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks import coverage
from benchmarks.coverage import cover, cover_exact, cover_montag, equally_spaced

from impasto.errors import OptionError
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.likelihood import pair_design
from impasto.psychophysics.scaling.limits import half_width, limits, montag_sigma
from impasto.psychophysics.scaling.resampling import resample_experiments, resample_observers


def comparisons(wins, ties=None):
    """Return the comparisons of observers, wins of shape (O, C, C)."""
    wins = np.asarray(wins, dtype=float)
    nothing = np.zeros(wins.shape[1:])
    names = tuple("abcdefg"[: wins.shape[1]])
    ties = np.zeros_like(wins) if ties is None else np.asarray(ties, dtype=float)
    return Comparisons(names, tuple(map(str, range(len(wins)))), wins, ties, nothing, nothing)


def of_two(first, second):
    wins = np.zeros((first + second, 2, 2))
    wins[:first, 0, 1] = 1
    wins[first:, 1, 0] = 1
    return comparisons(wins)


def drawn(scale, observers, seed=0):
    """Return the comparisons of simulated observers, each pair once."""
    design, first, second = pair_design(len(scale))
    random = np.random.default_rng(seed)
    chosen = random.normal(size=(observers, len(first))) < design @ np.asarray(scale)
    wins = np.zeros((observers, len(scale), len(scale)))
    wins[:, first, second] = chosen
    wins[:, second, first] = ~chosen
    return comparisons(wins)


@pytest.mark.parametrize(
    ("conditions", "observers", "difference"), [(3, 18, 0.0), (3, 18, 1.5), (5, 18, 0.75), (5, 54, 1.5)]
)
def test_default_limits_cover(conditions, observers, difference):
    """A small part of benchmarks/coverage.py: three standard errors below 93 % would be noticed."""
    scale = equally_spaced(conditions, difference, ends=False)
    found = cover(scale, observers, 300, seed=5, draws=100)["observers"]
    assert 0.93 <= found.differences <= 0.995
    assert 0.93 <= found.values <= 0.995


def test_the_bootstrap_alone_does_not_cover_where_observers_agree():
    found = cover(equally_spaced(3, 1.5, ends=False), 18, 300, seed=5, draws=100)
    assert found["bootstrap alone"].differences < 0.85


def test_pooled_answers_are_not_independent():
    found = cover(equally_spaced(2, 0.75, ends=False), 18, 400, seed=5, answers=7, variety=0.6, draws=100)
    assert found["independent"].differences < 0.88
    assert found["observers"].differences > 0.93


@pytest.mark.parametrize("observers", [18, 54])
def test_exact_limits_cover(observers):
    covered = cover_exact(observers, np.linspace(0, 1.5, 151))
    assert min(covered) >= 0.95
    assert 0.96 < np.mean(covered) < 0.99


def test_montag_s_formula_is_objected_to_where_it_does_not_cover():
    near, noted_near = cover_montag(equally_spaced(5, 0.5, ends=True), 18, 300, seed=1)
    far, noted_far = cover_montag(equally_spaced(5, 1.0, ends=False), 54, 200, seed=1)
    assert near.values > 0.93
    assert far.values < 0.6
    assert noted_near < 0.6
    assert noted_far == 1


def test_the_study_judges_what_limits_returns():
    """One experiment through both ways, with the same draws."""
    one = drawn([0, 0.4, 1.0], 18)
    _, first, second = pair_design(3)
    chosen, refused = one.wins[:, first, second], one.wins[:, second, first]
    scale, independent, over_draws = resample_experiments(
        chosen[None], refused[None], conditions=3, draws=300, random=np.random.default_rng(4)
    )
    alone = resample_observers(one, draws=300, seed=4)
    assert scale[0] == pytest.approx(alone.scale, abs=1e-6)
    assert independent[0] == pytest.approx(alone.covariance, abs=1e-6)
    assert over_draws[0] == pytest.approx(alone.drawn_covariance, abs=1e-4)
    found = limits(one, draws=300, seed=4)
    contrast = np.array([1, -1, 0])
    spread = half_width(contrast @ independent[0] @ contrast, contrast @ over_draws[0] @ contrast, 0.95, None)
    assert (found.difference_high - found.difference_low)[0, 1] / 2 == pytest.approx(spread, abs=1e-4)


@pytest.mark.parametrize(("first", "p_value"), [(13, 0.096), (14, 0.031)])
def test_two_conditions_are_tested_exactly(first, p_value):
    found = limits(of_two(first, 18 - first))
    assert found.method == "exact"
    assert found.p_value == pytest.approx(p_value, abs=5e-4)
    assert (found.difference_low[0, 1] > 0) == (p_value < 0.05)


def test_agreement_of_all_bounds_the_difference_from_one_side_only():
    for method in ("exact", "likelihood"):
        found = limits(of_two(18, 0), method=method)
        assert found.difference_low[0, 1] > 0.7
        assert found.difference_high[0, 1] == np.inf
    assert np.isfinite(limits(of_two(18, 0), method="observers").difference_high[0, 1])


def test_profile_likelihood_is_wilks_s():
    """14 of 18: where twice the fall of the binomial likelihood is 3.841, by bisection."""
    from scipy.optimize import brentq
    from scipy.special import log_ndtr

    def fall(z):
        top = 14 * np.log(14 / 18) + 4 * np.log(4 / 18)
        return 2 * (top - 14 * log_ndtr(z) - 4 * log_ndtr(-z)) - 3.841458820694124

    found = limits(of_two(14, 4), method="likelihood")
    assert found.difference_low[0, 1] == pytest.approx(brentq(fall, -1, 0.7), abs=1e-5)
    assert found.difference_high[0, 1] == pytest.approx(brentq(fall, 0.8, 3), abs=1e-5)


def test_montag_s_formula_is_that_of_the_paper():
    assert montag_sigma(5, 18) == pytest.approx(1.76 * 8.08**-0.613 * 15.45**-0.491)
    with pytest.raises(ValueError, match="at least 3"):
        montag_sigma(5, 2)


def test_pooled_answers_are_refused_by_exact_limits_and_noted_by_others():
    pooled = comparisons(3 * drawn([0, 0.5], 18).wins)
    assert limits(pooled).method == "observers"
    with pytest.raises(OptionError, match="answered repeatedly"):
        limits(pooled, method="exact")
    assert "too narrow" in " ".join(limits(pooled, method="likelihood").notes)
    assert "too narrow" in " ".join(limits(pooled, method="montag").notes)


def test_one_observer_cannot_be_drawn():
    with pytest.raises(OptionError, match="one observer"):
        limits(comparisons(drawn([0, 1, 2], 1).wins), method="observers")


def test_draws_that_do_not_connect_the_conditions_are_told():
    wins = drawn([0, 0.3, 0.6], 8).wins
    wins[1:, 2, :] = wins[1:, :, 2] = 0  # one observer alone has seen the third condition
    found = limits(comparisons(wins))
    assert any("gave no scale" in note for note in found.notes)


def test_few_observers_are_noted():
    assert "too few" in " ".join(limits(drawn([0, 0.3, 0.6], 4)).notes)


@pytest.mark.parametrize(("threshold", "difference"), [(0.2, 1.0), (0.6, 0.5)])
def test_limits_with_ties_cover(threshold, difference):
    """Glenn and David's answers, scaled with their threshold."""
    scale = coverage.equally_spaced(3, difference, ends=False)
    found, share = coverage.cover_ties(scale, 18, 120, 2, threshold=threshold, draws=100)
    assert 0.93 < found.values <= 1
    assert 0.93 < found.differences <= 1
    assert share > 0.05


def test_a_draw_without_ties_is_scaled_too():
    # A tie by two of 18 observers: one draw in eight has none of them.
    wins, ties = np.zeros((2, 18, 2, 2))
    wins[:10, 0, 1] = wins[10:16, 1, 0] = ties[16:, 0, 1] = ties[16:, 1, 0] = 1
    found = limits(comparisons(wins, ties), method="observers", draws=400)
    assert not any("gave no scale" in note for note in found.notes)


def test_exact_limits_leave_ties_out_and_say_so():
    wins, ties = np.zeros((2, 20, 2, 2))
    wins[:10, 0, 1] = wins[10:15, 1, 0] = ties[15:, 0, 1] = ties[15:, 1, 0] = 1
    found, without = limits(comparisons(wins, ties)), limits(of_two(10, 5))
    assert found.method == "exact"
    assert (found.p_value, *found.low, *found.high) == (without.p_value, *without.low, *without.high)
    assert "5 ties were left out" in found.notes


def test_unknown_methods_are_refused():
    with pytest.raises(OptionError, match="no such method"):
        limits(of_two(9, 9), method="bayes")
    with pytest.raises(OptionError, match="not between 0 and 1"):
        limits(of_two(9, 9), level=95)


def test_the_results_that_the_documentation_states_meet_their_bars():
    found = json.loads(Path(coverage.__file__).with_name("coverage.json").read_text(encoding="utf-8"))
    assert coverage.missed(found) == []
    assert len(found["neighbours"]) == len(found["ends"]) == 3 * 2 * 7
    assert len(found["ties"]) == 2 * 2 * 2 * 4
    worst = json.loads(json.dumps(found["neighbours"]))
    worst[0]["observers"]["values"] = 0.92
    assert len(coverage.missed({**found, "neighbours": worst})) == 1
