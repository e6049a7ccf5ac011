"""Scales, errors and tests of fit against what seven published programs answer for the same counts."""

import json
from pathlib import Path

import numpy as np
import pytest

from impasto.psychophysics.scaling.closed_form import fit_closed_form
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.consistency import agreement, circular_triads
from impasto.psychophysics.scaling.distance_prior import fit_distance_prior
from impasto.psychophysics.scaling.likelihood import JOD, fit_likelihood
from impasto.psychophysics.scaling.posterior import posterior
from impasto.psychophysics.scaling.screening import screen
from impasto.psychophysics.scaling.ties import fit_ties

SETS = (
    "n4_N18",
    "n5_N18",
    "n6_N54",
    "n5_N126",
    "n5_incomplete",
    "n4_unanimous_cell",
    "n2_14_4",
    "n3_cycle",
)


def sets(*lacking):
    """Give a test the counts of all sets but those that a program has no answer for."""
    return pytest.mark.parametrize("counts", [name for name in SETS if name not in lacking], indirect=True)


@pytest.fixture(scope="module")
def programs(shared):
    return json.loads((shared / "reference" / "scaling_programs.json").read_text())


@pytest.fixture
def counts(request, programs):
    return np.array(programs["inputs"]["sets"][request.param], dtype=float)


@pytest.fixture
def answers(request, programs):
    """Return what the programs answer for `counts`."""
    name = request.node.callspec.params["counts"]
    outputs = programs["outputs"]
    return {**outputs["R"]["sets"][name], **outputs["pwcmp_and_paircomp"][name], **outputs["choix"][name]}


@sets("n5_incomplete", "n4_unanimous_cell")
def test_closed_form_is_that_of_psych(counts, answers):
    expected = answers["psych"]
    found = fit_closed_form(counts)
    assert found.scale - found.scale.min() == pytest.approx(np.array(expected["scale"]), abs=1e-11)
    assert found.goodness == pytest.approx(expected["GF"], abs=1e-12)


@sets("n5_incomplete")
def test_morovic_s_rule_is_that_of_paircomp(counts, answers):
    expected = answers["green_paircomp"]["z"]
    # paircomp divides the sum of a row by C − 1, where least squares divides by C.
    stretch = len(counts) / (len(counts) - 1)
    assert fit_closed_form(counts, "morovic").scale * stretch == pytest.approx(np.array(expected), abs=1e-12)


@sets("n4_unanimous_cell")
@pytest.mark.parametrize(("program", "link"), [("BTm_probit", "probit"), ("BTm_logit", "logit")])
def test_likelihood_is_that_of_bradley_terry_2(counts, answers, program, link):
    check_likelihood(counts, answers[program], link)


@sets("n4_unanimous_cell", "n2_14_4")
def test_likelihood_is_that_of_eba(counts, answers):
    expected = answers["eba_thurstone"]
    found = check_likelihood(counts, expected, "probit")
    assert found.p_value == pytest.approx(expected["p"], abs=1e-8)


def check_likelihood(counts, expected, link):
    found = fit_likelihood(Comparisons.of_counts(counts), link=link)
    assert found.status == "converged"
    assert found.scale - found.scale[0] == pytest.approx(np.array(expected["estimate"]), abs=5e-6)
    # For two conditions the program leaves out the error of the first, which is 0.
    errors = [0] * (len(counts) - len(expected["se"])) + expected["se"]
    assert found.standard_errors(0) == pytest.approx(np.array(errors), abs=5e-6)
    assert found.deviance == pytest.approx(expected["deviance"], abs=1e-8)
    assert found.degrees_of_freedom == expected["df"]
    return found


@sets()
def test_bradley_terry_is_that_of_choix(counts, answers):
    choices = Comparisons.of_counts(counts)
    mode = fit_likelihood(choices, link="logit").scale
    assert mode == pytest.approx(np.array(answers["bt_mle_opt_mean0"]), abs=5e-6)
    # choix adds 0.1 θ² to the negative log likelihood: a normal prior of precision 0.2.
    with_prior = fit_likelihood(choices, link="logit", precision=0.2).scale
    assert with_prior == pytest.approx(np.array(answers["bt_map_alpha0.1"]), abs=1e-7)


@sets()
def test_posterior_is_that_of_choix(counts, answers):
    expected = answers["ep_probit_alpha0.1"]
    found = posterior(counts, 0.1)
    assert found.converged
    assert found.mean == pytest.approx(np.array(expected["mean"]), abs=5e-6)
    assert found.covariance == pytest.approx(np.array(expected["cov"]), abs=1e-6)


@sets()
def test_jod_are_those_of_pwcmp(counts, answers):
    """Printed after an optimiser with a tolerance of 1e-6, and with 1.4826 for 1.482602."""
    with_prior = JOD * fit_distance_prior(counts)
    assert with_prior == pytest.approx(np.array(answers["jod_gaussian_mean0"]), abs=5e-6)
    if "jod_none_mean0" in answers:
        without = JOD * fit_likelihood(Comparisons.of_counts(counts)).scale
        assert without == pytest.approx(np.array(answers["jod_none_mean0"]), abs=5e-6)


@sets("n5_incomplete", "n2_14_4")
def test_agreement_is_that_of_eba(counts, answers):
    expected = answers["kendall_u"]
    found = agreement(counts)
    assert (found.u, found.least) == pytest.approx((expected["u"], expected["min.u"]), abs=1e-12)
    assert (found.chi_square, found.degrees_of_freedom) == pytest.approx((expected["chi"], expected["df"]))
    assert found.p_value == pytest.approx(expected["p.value"], rel=1e-9)


def test_ties_are_those_of_ordinal(programs):
    wins, ties = np.zeros((2, 1, 4, 4))
    for row in programs["inputs"]["ties"]:
        first, second = row["row"] - 1, row["col"] - 1
        wins[0, first, second], wins[0, second, first] = row["win"], row["loss"]
        ties[0, first, second] = ties[0, second, first] = row["tie"]
    sides = np.zeros((4, 4))
    expected = programs["outputs"]["R"]["ties"]
    found = fit_ties(Comparisons(tuple("1234"), ("all",), wins, ties, sides, sides, summed=True))
    assert found.threshold == pytest.approx(expected["threshold"], abs=1e-12)
    assert found.fit.scale - found.fit.scale[0] == pytest.approx(np.array(expected["scale"]), abs=1e-12)
    errors = [found.threshold_error, *found.fit.standard_errors(0)[1:]]
    assert errors == pytest.approx(expected["se_threshold_then_scale"], abs=1e-12)
    assert found.log_likelihood == pytest.approx(expected["logLik"], abs=1e-10)


@pytest.fixture(scope="module")
def observers(programs):
    wins = np.array(programs["inputs"]["observers"], dtype=float)
    names = tuple(str(number) for number in range(len(wins)))
    return Comparisons(tuple("abcde"), names, wins, 0 * wins, np.zeros((5, 5)), np.zeros((5, 5)))


def test_circular_triads_are_those_of_eba(programs, observers):
    for wins, expected in zip(observers.wins, programs["outputs"]["R"]["observers"]["circular"], strict=True):
        found = circular_triads(wins)
        assert (found.triads, found.most) == (expected["T"], expected["T.max"])
        assert found.consistency == pytest.approx(expected["zeta"])
        assert found.p_value == pytest.approx(expected["p.value"], abs=1e-12)
    found = agreement(observers.counts)
    assert found.u == pytest.approx(programs["outputs"]["R"]["observers"]["kendall_u"]["u"])


def test_screening_is_that_of_pwcmp_and_finds_the_reversed_observer(programs, observers):
    expected = programs["outputs"]["pwcmp_and_paircomp"]["observers_outlier"]
    found = screen([observers])
    assert [each.log10_likelihood for each in found] == pytest.approx(
        expected["log10_lik_per_pair"], abs=1e-6
    )
    assert [each.distance for each in found] == pytest.approx(expected["dist_L"], abs=1e-5)
    assert [each.reversed for each in found] == [False] * 11 + [True]
    assert [each.outlying for each in found] == [False] * 11 + [True]


GOLDEN = json.loads(Path(__file__).with_name("bradley_terry2.json").read_text())


@pytest.mark.parametrize("link", ["probit", "logit"])
def test_position_bias_is_that_of_bradley_terry_2(link):
    left = np.zeros((4, 4))
    right = np.zeros((4, 4))
    # Left, right, times the left was chosen, times the right was: as in make_bradley_terry2.R.
    for first, second, for_left, for_right in (
        *((1, 2, 4, 5), (2, 1, 8, 1), (1, 3, 3, 6), (3, 1, 8, 1), (1, 4, 2, 7), (4, 1, 9, 0)),
        *((2, 3, 6, 3), (3, 2, 6, 3), (2, 4, 1, 8), (4, 2, 9, 0), (3, 4, 2, 7), (4, 3, 9, 0)),
    ):
        left[first - 1, second - 1] += for_left
        right[second - 1, first - 1] += for_right
    wins = (left + right)[None]
    comparisons = Comparisons(tuple("1234"), ("all",), wins, 0 * wins, left, right, summed=True)
    found = fit_likelihood(comparisons, link=link, position=True)
    expected = GOLDEN[f"position {link}"]
    assert [*(found.scale - found.scale[0])[1:], found.position] == pytest.approx(
        expected["estimate"], abs=1e-5
    )
    errors = [*found.standard_errors(0)[1:], found.position_error]
    assert errors == pytest.approx(expected["se"], abs=2e-5)
    assert (found.deviance, found.degrees_of_freedom) == pytest.approx((expected["deviance"], expected["df"]))


@pytest.mark.parametrize("link", ["probit", "logit"])
@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("plain", [[0, 5, 5, 3], [13, 0, 9, 1], [13, 9, 0, 3], [15, 17, 15, 0]]),
        ("cell", [[0, 18, 16, 18], [0, 0, 11, 15], [2, 7, 0, 12], [0, 3, 6, 0]]),
        ("separated", [[0, 18, 18], [0, 0, 11], [0, 7, 0]]),
    ],
)
def test_bias_reduction_is_that_of_brglm(name, counts, link):
    found = fit_likelihood(Comparisons.of_counts(counts), link=link, reduce_bias=True)
    expected = GOLDEN[f"reduced {name} {link}"]
    assert (found.scale - found.scale[0])[1:] == pytest.approx(expected["estimate"], abs=5e-5)
    assert found.standard_errors(0)[1:] == pytest.approx(expected["se"], abs=5e-5)
