"""The stage `scale`: what it reads, what it tells, and what it never hides."""

import csv
import json
from itertools import product

import numpy as np
import pytest
from typer.testing import CliRunner

import impasto
from impasto.cli.commands import app
from impasto.errors import OptionError
from impasto.psychophysics.differences import image_difference, measure_differences
from impasto.psychophysics.scaling.comparisons import count_choices
from impasto.psychophysics.scaling.consistency import circular_triads, repeats
from impasto.psychophysics.scaling.groups import ScaleOptions
from impasto.psychophysics.scaling.trials import Trial, TrialsError, in_order, read_trials, write_trials
from impasto.psychophysics.simulated_observers import ObserverModel, simulate_observers

runner = CliRunner()
ANGLES = ("10", "60")
MODELS = {"phong": 1.5, "torrance-sparrow": 0.5, "ward": 1.0}


def run(*arguments):
    return runner.invoke(app, [str(argument) for argument in arguments])


def differences(samples=("a", "b"), angles=ANGLES, conditions=MODELS):
    return {
        (sample, angle, name): value + 0.05 * place
        for place, (sample, angle) in enumerate(product(samples, angles))
        for name, value in conditions.items()
    }


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """Return the trials of 18 simulated observers, the last of which answers the opposite."""
    path = tmp_path_factory.mktemp("experiment") / "trials.csv"
    model = ObserverModel(gain=1.2, variety=0.2)
    write_trials(path, simulate_observers(differences(), model=model, repeats=4, reversed_observers=1))
    return path


@pytest.fixture(scope="module")
def summary(experiment):
    return impasto.scale(experiment)


def people(tmp_path, rows, header="observer,sample,angle,condition_A,condition_B,choice"):
    path = tmp_path / "trials.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_the_scale_finds_the_order_and_the_reversed_observer(experiment, summary):
    assert [group.name for group in summary.groups] == [
        *("pooled", "angle 10", "angle 60", "sample a", "sample b"),
    ]
    pooled = summary.groups[0]
    assert np.argsort(pooled.scale).tolist() == [0, 2, 1]
    assert pooled.answers == 18 * 4 * 3
    assert pooled.limits == "observers"
    assert (pooled.low < pooled.scale).all()
    assert (pooled.scale < pooled.high).all()
    flagged = [report.observer for report in summary.observers if report.reversed]
    assert flagged == ["simulated-18"]
    left_out = impasto.scale(experiment, exclude=flagged).groups[0]
    assert np.ptp(left_out.scale) > np.ptp(pooled.scale)
    assert left_out.observers == 17


def test_repeats_serve_consistency_and_not_the_scale(summary):
    assert {report.asked_again for report in summary.observers} == {4}
    same = sum(report.same_again for report in summary.observers)
    assert 18 * 4 * 0.5 < same < 18 * 4


def test_simulated_observers_are_named_wherever_they_appear(experiment, tmp_path):
    data, out = tmp_path / "data.json", tmp_path / "out"
    result = run("scale", experiment, "--out", out, "--json", data)
    assert result.exit_code == 0, result.output
    assert "SIMULATED: 18 observers of these are a program, not people" in result.output
    written = json.loads(data.read_text())
    assert written["simulated"] == 18
    assert all(report["simulated"] for report in written["observers"])
    with (out / "scale.csv").open(encoding="utf-8") as file:
        assert {row["simulated"] for row in csv.DictReader(file)} == {"yes"}
    # Also where the column was lost and only the names are left.
    lines = experiment.read_text(encoding="utf-8").splitlines()
    bare = people(tmp_path, [",".join(line.split(",")[:6]) for line in lines[1:]])
    assert "SIMULATED: 18 observers" in run("scale", bare).output


def test_figures_and_table_are_written(experiment, tmp_path):
    table = tmp_path / "errors.csv"
    rows = [
        f"{sample},{angle},{name},{value},{2 * value}"
        for (sample, angle, name), value in differences().items()
    ]
    table.write_text("\n".join(["sample,angle,condition,CIEDE2000,FLIP", *rows]), encoding="utf-8")
    out = tmp_path / "out"
    result = run("scale", experiment, "--out", out, "--errors", table, "--pool", "near=10")
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == {
        "scale.csv",
        "scale-by-angle.png",
        "scale-by-sample.png",
        "proportions-pooled.png",
        "proportions-near.png",
        "physical-errors.png",
    }
    assert "near: 108 answers" in result.output
    predicted = impasto.scale(experiment, errors=table).physical[0]
    assert predicted.low < predicted.predicted < predicted.high
    assert predicted.predicted > 0.6
    assert predicted.correlation < -0.9


def test_units_and_models(experiment, summary):
    z = summary.groups[0]
    jod = impasto.scale(experiment, options=ScaleOptions(unit="jod")).groups[0]
    assert jod.scale == pytest.approx(1.482602218505602 * z.scale)
    assert jod.high == pytest.approx(1.482602218505602 * z.high)
    odds = impasto.scale(experiment, options=ScaleOptions(model="bradley-terry"))
    assert odds.unit == "log-odds"
    assert odds.groups[0].scale == pytest.approx(z.bradley_terry)
    closed = impasto.scale(experiment, options=ScaleOptions(model="closed-form")).groups[0]
    assert closed.scale == pytest.approx(z.closed_form)
    assert any("limits those of the likelihood" in note for note in closed.notes)


def test_ties_get_a_threshold(tmp_path):
    trials = simulate_observers(differences(), observers=54, model=ObserverModel(indifference=0.4, lapse=0))
    path = tmp_path / "ties.csv"
    write_trials(path, trials)
    group = impasto.scale(path).groups[0]
    assert group.ties > 20
    assert group.threshold == pytest.approx(0.4, abs=0.08)
    assert "is a tie within" in run("scale", path).output


def test_an_advantage_of_the_left_is_found(tmp_path):
    path = tmp_path / "left.csv"
    write_trials(path, simulate_observers(differences(), model=ObserverModel(left=0.5, lapse=0)))
    group = impasto.scale(path).groups[0]
    assert group.position == pytest.approx(0.5, abs=4 * group.position_error)
    assert group.position > 3 * group.position_error


def test_an_advantage_of_the_left_is_finite_or_not_told(tmp_path):
    header = "observer,sample,angle,condition_A,condition_B,choice,side"
    # Whoever sees x on the left chooses it; the likelihood's advantage has no maximum.
    sides = ["left"] * 5 + ["right"] * 4
    rows = [f"p{n},a,0,x,y,{'AB'[n > 6]},{side}" for n, side in enumerate(sides)]
    group = impasto.scale(people(tmp_path, rows, header)).groups[0]
    assert 0 < group.position < 2
    assert group.position_error < 1
    # Where x stood always on the left, its advantage is not to be told from that of the left.
    rows = [f"p{n},a,0,x,y,{'AB'[n > 6]},left" for n in range(9)]
    assert np.isnan(impasto.scale(people(tmp_path, rows, header)).groups[0].position)


def everyone(choices, observers=6):
    """Return a row for each observer and each pair with the chosen first."""
    return [f"p{number},a,0,{first},{second},A" for number in range(observers) for first, second in choices]


def test_a_disconnected_design_is_told(tmp_path):
    mixed = ["q,a,0,y,x,A", "q,a,0,v,u,A"]
    path = people(tmp_path, [*everyone([("x", "y"), ("u", "v")]), *mixed])
    (group,) = impasto.scale(path).groups
    assert group.status == "disconnected"
    assert np.isnan(group.scale).all()
    result = run("scale", path, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "no common scale: u, v; x, y" in result.output
    assert "no common scale" in run("scale", path, "--limits", "montag").output


def test_an_unbounded_scale_and_unanimous_pairs_are_told(tmp_path):
    mixed = ["q,a,0,z,y,A", "q,a,0,x,y,A", "q,a,0,x,z,A"]
    path = people(tmp_path, [*everyone([("x", "y"), ("x", "z"), ("y", "z")]), *mixed])
    (group,) = impasto.scale(path).groups
    assert group.status == "unbounded"
    assert np.isfinite(group.scale).all()
    output = run("scale", path, "--out", tmp_path / "out").output
    assert "no finite maximum" in output
    assert "unanimous: x over y (7), x over z (7)" in output
    assert "unbounded" in run("scale", path, "--limits", "likelihood", "--out", tmp_path / "l").output


def test_all_problems_of_a_table_are_told_at_once(tmp_path):
    path = people(
        tmp_path, ["p,a,0,x,x,A", "p,a,0,x,y,C", ",a,0,x,y,A", "p,a,0,x,y,B,left,extra", "p,a,0,x,y,tie"]
    )
    with pytest.raises(TrialsError) as caught:
        read_trials(path)
    told = str(caught.value)
    assert len(caught.value.problems) == 4
    for part in (
        "row 2: compares x with itself",
        "choice is C, and must be A, B or tie",
        "observer is empty",
    ):
        assert part in told
    assert "row 5: has more cells" in told


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("observer,sample,angle,condition_A,choice\np,a,0,x,A\n", "lacks the columns condition_B"),
        ("observer,sample,angle,condition_A,condition_B,choice\n", "has no trials"),
        ("", "lacks the columns"),
        (b"\xff\xfe\x00\x01", "cannot be read"),
    ],
)
def test_what_is_no_table_of_trials_is_refused(tmp_path, text, what):
    path = tmp_path / "trials.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    result = run("scale", path)
    assert result.exit_code == 1
    assert what in " ".join(result.output.split())


def test_many_problems_are_counted(tmp_path):
    path = people(tmp_path, ["p,a,0,x,y,maybe"] * 500)
    with pytest.raises(TrialsError, match="480 more rows have problems"):
        read_trials(path)


def test_unknown_names_are_refused_all_at_once(experiment):
    with pytest.raises(OptionError) as caught:
        impasto.scale(
            experiment,
            options=ScaleOptions(model="elo", limits="wide", unit="mm", level=2, draws=5),
            conditions=["phong", "wardd"],
            pools={"near": ["11"]},
            exclude=["anna"],
        )
    assert len(caught.value.problems) == 8
    assert run("scale", experiment, "--pool", "near").exit_code == 1
    everybody = [f"--exclude=simulated-{number:02d}" for number in range(1, 19)]
    assert "all left out" in run("scale", experiment, *everybody).output


def test_trials_survive_writing_and_reading(tmp_path):
    trials = simulate_observers(differences(), observers=2, model=ObserverModel(indifference=0.2), repeats=2)
    path = tmp_path / "trials.csv"
    write_trials(path, trials)
    assert read_trials(path) == trials


def test_choices_are_counted_by_side():
    trials = [
        Trial("p", "a", "0", "x", "y", 1, "left"),
        Trial("p", "a", "0", "y", "x", 1, "left"),
        Trial("q", "a", "0", "x", "y", -1, "left"),
        Trial("q", "a", "0", "x", "y", 0),
        Trial("q", "a", "0", "x", "y", 1, kind="catch"),
    ]
    counted = count_choices(trials)
    assert counted.wins.sum(axis=0).tolist() == [[0, 1], [2, 0]]
    assert counted.wins_left.tolist() == [[0, 1], [1, 0]]
    assert counted.wins_right.tolist() == [[0, 0], [1, 0]]
    assert counted.counts.tolist() == [[0, 1.5], [2.5, 0]]


def test_names_stand_in_the_order_of_people():
    assert in_order(["11 angles", "5 angles", "photograph"]) == ("5 angles", "11 angles", "photograph")
    assert in_order(["10", "-5", "2.5"]) == ("-5", "2.5", "10")


def test_repeated_answers_are_compared_whatever_the_order_of_the_pair():
    asked = [
        Trial("p", "a", "0", "x", "y", 1),
        Trial("p", "a", "0", "y", "x", -1, kind="repeat"),
        Trial("p", "a", "0", "y", "x", 1, kind="repeat"),
    ]
    (found,) = repeats(asked).values()
    assert (found.asked, found.same) == (2, 1)


def test_eight_conditions_go_by_the_chi_square():
    transitive = np.triu(np.ones((8, 8)), 1)
    assert circular_triads(transitive).p_value < 1e-3
    with pytest.raises(ValueError, match="exactly one"):
        circular_triads(2 * transitive)


def test_image_differences():
    grey = np.full((32, 32, 3), 128, np.uint8)
    lighter = np.full((32, 32, 3), 140, np.uint8)
    assert [image_difference(grey, grey, kind) for kind in ("RMS", "CIEDE2000", "FLIP")] == pytest.approx(
        [0, 0, 0], abs=1e-6
    )
    assert image_difference(grey, lighter, "RMS") == pytest.approx(12 / 255)
    # Greys differ in lightness alone, of which ΔE00 is ΔL / (1 + 0.015 (L̄ − 50)² / √(20 + (L̄ − 50)²)).
    dark, light = (116 * ((value / 255 + 0.055) / 1.055) ** 0.8 - 16 for value in (128, 140))
    off = (dark + light) / 2 - 50
    weight = 1 + 0.015 * off**2 / np.sqrt(20 + off**2)
    assert image_difference(grey, lighter) == pytest.approx((light - dark) / weight, abs=1e-3)
    with pytest.raises(OptionError, match="one size"):
        image_difference(grey, lighter[:8])
    with pytest.raises(OptionError, match="does not exist"):
        image_difference(grey, lighter, "L2")


def test_an_experiment_s_pictures_drive_observers_and_stand_beside_the_scale(painting, tmp_path):
    folder = tmp_path / "experiment"
    impasto.experiment.create([painting], out=folder, angles=3)
    measured = measure_differences(folder)
    assert set(measured) == {"RMS", "CIEDE2000", "FLIP"}
    for values in measured.values():
        photographs = [value for (_, _, condition), value in values.items() if condition == "photograph"]
        assert photographs == pytest.approx([0, 0, 0], abs=1e-6)
        assert all(value > 0 for (*_, condition), value in values.items() if condition != "photograph")
    rendered = {key: value for key, value in measured["CIEDE2000"].items() if key[2] != "photograph"}
    trials = tmp_path / "trials.csv"
    # Enough for what lies between the models, a part of what lies between the angles, to show in few answers.
    gain = 8 / np.ptp(list(rendered.values()))
    write_trials(trials, simulate_observers(rendered, model=ObserverModel(gain=gain)))
    result = run("scale", trials, "--errors", folder)
    assert result.exit_code == 0, result.output
    found = {error.name: error.predicted for error in impasto.scale(trials, errors=folder).physical}
    assert set(found) == set(measured)
    assert found["CIEDE2000"] > 0.55


def test_what_the_experiment_exports_is_read(tmp_path):
    from impasto.psychophysics.experiment.answers import answers_csv

    common = {"session": 1, "sample": "a", "time": 1.234, "display": "=EIZO, calibrated", "place": 3}
    common |= {"answered_at": "2026-01-01T10:00:00Z"}
    rows = [
        {"observer": "O001", "angle": "-30", "condition_A": "phong", "condition_B": "ward", "side": "left"}
        | {"choice": "B", "kind": "test"},
        {"observer": "O001", "angle": "-30", "condition_A": "photograph", "condition_B": "photograph-dimmed"}
        | {"side": "right", "choice": "A", "kind": "catch"},
        {"observer": "simulated-002", "angle": "10", "condition_A": "phong", "condition_B": "ward"}
        | {"side": "right", "choice": "tie", "kind": "test"},
    ]
    path = tmp_path / "trials.csv"
    path.write_text(answers_csv(row | common for row in rows), encoding="utf-8")
    first, catch, last = read_trials(path)
    assert (first.angle, first.choice, first.side, first.simulated) == ("-30", -1, "left", False)
    assert (catch.kind, catch.choice) == ("catch", 1)
    assert (last.choice, last.simulated) == (0, True)
    summary = impasto.scale(path)
    assert summary.groups[0].conditions == ("phong", "ward")
    assert summary.simulated == 1
    assert (summary.observers[0].catches, summary.observers[0].caught) == (1, 1)
