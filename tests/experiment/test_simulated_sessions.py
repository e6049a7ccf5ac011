"""Simulated observers go the way of all answers, and are named simulated wherever these appear."""

import csv
import shutil
from statistics import fmean

import pytest
from typer.testing import CliRunner

import impasto
from impasto.cli.commands import app
from impasto.errors import OptionError
from impasto.psychophysics import ObserverModel, measure_differences
from impasto.psychophysics.experiment.administer import opened
from impasto.psychophysics.experiment.answers import session_states
from impasto.psychophysics.experiment.live_scale import live_scale

runner = CliRunner()
# They see every difference: 1 of CIEDE2000 is a thousand standard deviations.
SHARP = ObserverModel(gain=1000, lapse=0)


def answers(folder, database):
    file = folder / "trials.csv"
    impasto.experiment.export(folder, file, database=database)
    with file.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def folder(experiment_folder, tmp_path):
    return shutil.copytree(experiment_folder, tmp_path / "experiment")


def test_the_picture_that_is_closer_is_chosen(folder, database):
    summary = impasto.experiment.simulate(folder, observers=4, model=SHARP, database=database)
    assert summary.observers == tuple(f"simulated-00{number}" for number in range(1, 5))
    rows = answers(folder, database)
    assert len(rows) == summary.answers == 4 * 10
    difference = measure_differences(folder)["CIEDE2000"]
    tests = [row for row in rows if row["kind"] == "test"]
    assert len(tests) == 4 * 4
    for row in tests:
        first, second = (
            difference[row["sample"], row["angle"], row[name]] for name in ("condition_A", "condition_B")
        )
        assert row["choice"] == ("A" if first < second else "B")
    assert {row["choice"] for row in rows if row["kind"] == "catch"} == {"A"}
    assert {row["side"] for row in tests} == {"left", "right"}


def test_they_are_named_simulated_wherever_they_appear(folder, database):
    impasto.experiment.simulate(folder, observers=3, database=database)
    rows = answers(folder, database)
    assert all(row["observer"].startswith("simulated-") for row in rows)
    assert {row["display"] for row in rows} == {"none: simulated"}
    with opened(folder, database) as (experiment, engine):
        assert live_scale(engine, experiment).simulated == 3
        assert all(state.display == "none: simulated" for state in session_states(engine))
    exported = runner.invoke(
        app, ["experiment", "export", str(folder), str(folder / "t.csv"), "--database", database]
    )
    assert "3 of them SIMULATED" in " ".join(exported.output.split())
    assert impasto.scale(folder / "trials.csv").simulated == 3


def test_those_who_come_later_have_noise_of_their_own(folder, database):
    blind = ObserverModel(gain=0)
    for _ in range(2):
        impasto.experiment.simulate(folder, observers=8, model=blind, database=database)
    rows = [row for row in answers(folder, database) if row["kind"] == "test"]
    left = [(row["choice"] == "A") == (row["side"] == "left") for row in rows]
    assert left[: len(left) // 2] != left[len(left) // 2 :]
    assert fmean(left) == pytest.approx(0.5, abs=0.25)


def test_ties_are_stored_and_scaled(folder, database):
    model = ObserverModel(gain=0, lapse=0, indifference=0.5)
    impasto.experiment.simulate(folder, observers=18, model=model, database=database)
    rows = [row for row in answers(folder, database) if row["kind"] == "test"]
    # Of two that look alike: the share of a normal deviate within ±0.5 is 0.383.
    assert fmean(row["choice"] == "tie" for row in rows) == pytest.approx(0.383, abs=0.17)
    group = impasto.scale(folder / "trials.csv").groups[0]
    assert group.ties == sum(row["choice"] == "tie" for row in rows)
    assert group.threshold == pytest.approx(0.5, abs=0.25)


def test_what_cannot_be_simulated_is_refused(painting, folder, tmp_path):
    with pytest.raises(OptionError, match="does not exist"):
        impasto.experiment.simulate(folder, by="taste")
    with pytest.raises(OptionError, match="expected 1 to 1000"):
        impasto.experiment.simulate(folder, observers=0)
    forced = tmp_path / "forced"
    impasto.experiment.create([painting], out=forced, angles=2)
    result = runner.invoke(app, ["experiment", "simulate", str(forced), "--indifference", "0.3"])
    assert result.exit_code == 1
    assert "asks for a choice" in " ".join(result.output.split())
    result = runner.invoke(app, ["experiment", "simulate", str(forced), "--observers", "2"])
    assert result.exit_code == 0, result.output
    assert "SIMULATED: simulated-001 to simulated-002" in result.output
