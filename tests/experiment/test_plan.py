"""Sessions are random, but even: over sides, over the order, and over neighbours."""

from collections import Counter
from dataclasses import replace
from itertools import combinations, pairwise

import pytest

from impasto.psychophysics.experiment.plan import Pair, plan_session

MODELS = [Pair(sample, str(angle), "phong", "ts") for sample in "abcdefgh" for angle in range(7)]
GROUPS = [
    Pair("a", str(angle), first, second)
    for angle in range(7)
    for first, second in combinations(["3", "5", "7", "11", "37", "photograph"], 2)
]
CATCHES = [Pair("a", str(angle), "photograph", "dimmed") for angle in range(7)]
EVERYTHING = {"repeats": 6, "catch_every": 20, "practice": 3}


def of_kind(trials, kind):
    return [trial for trial in trials if trial.kind == kind]


@pytest.mark.parametrize("pairs", [MODELS, GROUPS], ids=["models", "groups"])
def test_each_pair_is_tested_once(pairs):
    trials = plan_session(pairs, CATCHES, seed=1, number=4, **EVERYTHING)
    assert Counter(trial.pair for trial in of_kind(trials, "test")) == Counter(pairs)
    assert [trial.kind for trial in trials[:4]].count("practice") == 3
    assert len(of_kind(trials, "catch")) == (len(pairs) + 6) // 20
    assert len(of_kind(trials, "repeat")) == 6


@pytest.mark.parametrize("pairs", [MODELS, GROUPS], ids=["models", "groups"])
def test_sides_are_even_for_each_two_conditions(pairs):
    tests = of_kind(plan_session(pairs, (), seed=3, number=0), "test")
    left = Counter((trial.pair.condition_a, trial.pair.condition_b) for trial in tests if trial.a_left)
    for conditions, count in Counter((pair.condition_a, pair.condition_b) for pair in pairs).items():
        assert left[conditions] in {count // 2, (count + 1) // 2}
    assert abs(2 * left.total() - len(pairs)) <= 1


@pytest.mark.parametrize("pairs", [MODELS, GROUPS], ids=["models", "groups"])
def test_the_second_of_two_sessions_is_the_first_reversed_with_sides_exchanged(pairs):
    first, second = (of_kind(plan_session(pairs, (), seed=5, number=n), "test") for n in (6, 7))
    assert second == [replace(trial, a_left=not trial.a_left) for trial in reversed(first)]


def test_sessions_differ_and_can_be_made_again():
    orders = [tuple(plan_session(MODELS, CATCHES, seed=1, number=n, **EVERYTHING)) for n in (0, 1, 2, 3, 0)]
    assert len(set(orders)) == 4
    assert orders[0] == orders[-1]
    assert orders[0] != tuple(plan_session(MODELS, CATCHES, seed=2, number=0, **EVERYTHING))


@pytest.mark.parametrize("pairs", [MODELS, GROUPS], ids=["models", "groups"])
@pytest.mark.parametrize("seed", range(8))
def test_neighbours_have_different_references(pairs, seed):
    trials = plan_session(pairs, (), seed=seed, number=0)
    assert all(one.pair.reference != two.pair.reference for one, two in pairwise(trials))


def test_a_single_reference_is_no_obstacle():
    pairs = [Pair("a", "0", first, second) for first, second in combinations("pqrs", 2)]
    assert len(plan_session(pairs, (), seed=1, number=0)) == 6


def test_repeats_come_later_with_the_sides_exchanged():
    for number in range(20):
        trials = plan_session(MODELS, CATCHES, seed=1, number=number, **EVERYTHING)
        place = {trial.pair: index for index, trial in enumerate(trials) if trial.kind == "test"}
        side = {trial.pair: trial.a_left for trial in of_kind(trials, "test")}
        for index, trial in enumerate(trials):
            if trial.kind == "repeat":
                assert index - place[trial.pair] > 10
                assert trial.a_left != side[trial.pair]


def test_catches_are_spread_and_stand_on_both_sides():
    trials = plan_session(GROUPS, CATCHES, seed=1, number=0, catch_every=20)
    places = [index for index, trial in enumerate(trials) if trial.kind == "catch"]
    assert len(places) == 5
    assert all(later - earlier <= 42 for earlier, later in pairwise(places))
    assert {trial.a_left for trial in of_kind(trials, "catch")} == {True, False}


def test_more_is_asked_than_there_is():
    trials = plan_session(MODELS[:2], CATCHES, seed=1, number=0, repeats=9, catch_every=20, practice=9)
    assert Counter(trial.kind for trial in trials) == {"practice": 2, "test": 2, "repeat": 2, "catch": 1}
