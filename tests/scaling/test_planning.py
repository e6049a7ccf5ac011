"""Planning: observers needed, pairs to ask next, and when to stop."""

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import binomtest
from typer.testing import CliRunner

import impasto
from impasto.cli.commands import app
from impasto.errors import OptionError
from impasto.psychophysics.planning import information_gain, next_pairs, observers_needed, stopping_rule
from impasto.psychophysics.scaling.comparisons import Comparisons, count_choices
from impasto.psychophysics.scaling.trials import write_trials
from impasto.psychophysics.simulated_observers import ObserverModel, simulate_observers


def test_two_conditions_are_planned_from_the_exact_test():
    plan = observers_needed(0.8, power=0.8)
    powers = {}
    for observers in (plan.observers - 1, plan.observers, plan.observers + 1):
        chosen = np.arange(observers + 1)
        significant = [binomtest(int(k), observers).pvalue <= 0.05 and k > observers / 2 for k in chosen]
        random = np.random.default_rng(0).binomial(observers, ndtr(0.8), 200_000)
        powers[observers] = np.mean(np.array(significant)[random])
    assert plan.power == pytest.approx(powers[plan.observers], abs=0.004)
    assert powers[plan.observers - 1] < 0.8 <= powers[plan.observers + 1] + 0.004


def test_more_conditions_need_fewer_observers_for_the_same_neighbours():
    """Each pair tells something about all others."""
    two = observers_needed(1.0, answers=2, simulations=100)
    four = observers_needed(1.0, answers=2, conditions=4, simulations=100)
    varied = observers_needed(1.0, answers=2, variety=1.0, simulations=100)
    assert four.observers < two.observers < varied.observers


def test_a_difference_too_small_is_refused():
    with pytest.raises(OptionError, match="500 observers find it"):
        observers_needed(0.02)
    with pytest.raises(OptionError) as caught:
        observers_needed(-1, power=2, conditions=1)
    assert len(caught.value.problems) == 3


def test_the_pair_that_nobody_knows_tells_most():
    counts = np.array([[0, 20, 39], [20, 0, 20], [1, 20, 0]], dtype=float)
    counts[0, 1] = counts[1, 0] = 0
    gain = information_gain(counts)
    assert gain == pytest.approx(gain.T)
    assert gain[0, 1] == pytest.approx(gain.max())
    assert gain[0, 1] > 1.2 * gain[0, 2]
    assert next_pairs(counts)[0] == (0, 1)


def test_the_next_pairs_connect_all_conditions():
    for counts in (np.zeros((6, 6)), np.triu(np.full((6, 6), 9.0), 1) + np.tril(np.full((6, 6), 4.0), -1)):
        pairs = next_pairs(counts)
        assert len(pairs) == 5
        joined = {pairs[0][0]}
        for _ in pairs:
            joined |= {i for pair in pairs if joined & set(pair) for i in pair}
        assert joined == set(range(6))


def test_active_sampling_beats_asking_all_pairs_alike():
    """Two groups of conditions far apart: asking across them again and again tells nothing."""
    scale = np.array([0.0, 0.2, 0.4, 4.0, 4.2, 4.4])
    random = np.random.default_rng(1)
    pairs = list(zip(*np.triu_indices(6, 1), strict=True))
    widths = {}
    for active in (False, True):
        counts = np.zeros((6, 6))
        for number in range(60):
            asked = next_pairs(counts) if active else [pairs[(5 * number + k) % 15] for k in range(5)]
            for i, j in asked:
                chosen = random.random() < ndtr(scale[i] - scale[j])
                counts[i, j] += chosen
                counts[j, i] += not chosen
        # Weights of what was asked, at the truth: the variance does not depend on luck with the answers.
        trials = counts + counts.T
        distance = scale[:, None] - scale
        density = np.exp(-(distance**2) / 2) / np.sqrt(2 * np.pi)
        weights = trials * density**2 / np.maximum(ndtr(distance) * ndtr(-distance), 1e-300)
        information = np.diag(weights.sum(axis=1)) - weights
        covariance = np.linalg.pinv(information)
        near = [(0, 1), (1, 2), (3, 4), (4, 5)]
        widths[active] = np.mean(
            [covariance[i, i] + covariance[j, j] - 2 * covariance[i, j] for i, j in near]
        )
    assert widths[True] < 0.8 * widths[False]


def experiment(observers, gain=1.0):
    scenes = {("a", "0", name): value for name, value in (("x", 0.0), ("y", 0.4), ("z", 0.9))}
    return simulate_observers(scenes, observers=observers, model=ObserverModel(gain=gain, lapse=0))


def test_the_stopping_rule_looks_at_widths_only():
    few = stopping_rule(count_choices(experiment(10)))
    assert (few.stop, "of at least 18" in few.why) == (False, True)
    some = count_choices(experiment(40))
    assert not stopping_rule(some, within=0.1).stop
    assert stopping_rule(some, within=0.6).stop
    last = stopping_rule(some, within=0.1, most=40)
    assert (last.stop, "most that were planned" in last.why) == (True, True)
    # The same widths whichever condition is ahead.
    turned = Comparisons(
        some.conditions,
        some.observers,
        np.swapaxes(some.wins, 1, 2),
        some.ties,
        some.wins_left,
        some.wins_right,
    )
    assert stopping_rule(turned).widest == pytest.approx(stopping_rule(some).widest, rel=1e-3)


def test_the_command_plans_and_stops(tmp_path):
    path = tmp_path / "trials.csv"
    write_trials(path, experiment(20))
    result = CliRunner().invoke(
        app, ["observers", "--difference", "0.8", "--trials", str(path), "--within", "2"]
    )
    assert result.exit_code == 0, result.output
    assert "power 0.8" in result.output
    assert "stop: every difference is known" in result.output
    assert "SIMULATED: 20 observers" in result.output
    assert CliRunner().invoke(app, ["observers"]).exit_code == 1
    assert impasto.observers(0.8).stopping is None
