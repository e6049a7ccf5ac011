"""The subcommands of `experiment`, from the pictures to the table of answers."""

import csv
import json

import pytest
from typer.testing import CliRunner

import impasto
from impasto.cli.commands import app
from impasto.psychophysics.experiment.manifest import read_experiment
from impasto.psychophysics.experiment.serve import TOKEN_FILE, TOKEN_VARIABLE, admin_token

runner = CliRunner()


def run(*arguments):
    return runner.invoke(app, ["experiment", *(str(argument) for argument in arguments)])


@pytest.fixture
def made(painting, tmp_path):
    viewing = tmp_path / "viewing.toml"
    viewing.write_text("display = 'the good one'\ndistance_mm = 700\n")
    consent = tmp_path / "consent.txt"
    consent.write_text("I agree.\n")
    out = tmp_path / "experiment"
    result = run(
        "create", painting, "--out", out, "--angles", 3, "--layout", "alternating", "--viewing", viewing,
        "--consent", consent, "--crop", "4,4,40,32", "--json", tmp_path / "made.json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "3 comparisons for each observer" in result.output
    assert json.loads((tmp_path / "made.json").read_text())["size_px"] == [40, 32]
    return out


def test_options_reach_the_experiment(made):
    experiment = read_experiment(made)
    assert experiment.viewing.display == "the good one"
    assert experiment.texts.consent == "I agree."
    assert experiment.presentation.layout == "alternating"
    assert "at one place" in " ".join(experiment.texts.instructions.split()).lower()
    assert experiment.samples[0].crop_px == (4, 4, 40, 32)


def test_invite_export_and_forget(made, tmp_path):
    result = run("invite", made, "--observers", 2, "--json", tmp_path / "codes.json")
    assert result.exit_code == 0, result.output
    invitations = json.loads((tmp_path / "codes.json").read_text())["invitations"]
    assert [entry["observer"] for entry in invitations] == ["O001", "O002"]
    assert all(entry["code"] in result.output for entry in invitations)
    assert run("export", made, tmp_path / "trials.csv").exit_code == 0
    with (tmp_path / "trials.csv").open(newline="") as file:
        assert list(csv.DictReader(file)) == []
    assert run("export", made, tmp_path / "all.json").exit_code == 0
    exported = json.loads((tmp_path / "all.json").read_text())
    assert [session["viewing"]["display"] for session in exported["sessions"]] == ["the good one"] * 2
    assert "1 session deleted" in run("forget", made, "O001").output
    assert run("forget", made, "O001").exit_code == 1
    # Who is invited later may not be taken for who was forgotten.
    assert impasto.experiment.invite(made)[0].observer == "O003"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("create", "PAINTING", "--out", "OUT", "--angle", "1", "--angles", "2"), "Leave one of them out"),
        (("create", "PAINTING", "--out", "OUT", "--crop", "1,2"), "is not 4 numbers"),
        (("create", "PAINTING", "--out", "OUT", "--layout", "round"), "'beside' or 'alternating'"),
        (("create", "PAINTING", "--out", "OUT", "--viewing", "BAD"), "extra inputs are not permitted"),
        (("create", "PAINTING", "--out", "OUT", "--consent", "NOWHERE"), "cannot be read"),
        (("serve", "NOWHERE"), "is no finished experiment"),
        (("export", "NOWHERE", "x.xlsx"), "ends in neither .csv nor .json"),
        (("invite", "NOWHERE", "--observers", "0"), "expected 1 to 1000"),
    ],
)
def test_problems_are_explained(painting, tmp_path, arguments, message):
    (tmp_path / "bad.toml").write_text("display = 'x'\nroom = 'dark'\n")
    places = {
        "PAINTING": painting,
        "OUT": tmp_path / "out",
        "BAD": tmp_path / "bad.toml",
        "NOWHERE": tmp_path / "nowhere",
    }
    result = run(*(places.get(argument, argument) for argument in arguments))
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())


def test_the_token_is_made_once_and_kept_from_others(tmp_path, monkeypatch):
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    token = admin_token(tmp_path)
    assert len(token) >= 32
    assert admin_token(tmp_path) == token
    assert (tmp_path / TOKEN_FILE).stat().st_mode & 0o077 == 0
    monkeypatch.setenv(TOKEN_VARIABLE, "another-token-of-some-length")
    assert admin_token(tmp_path) == "another-token-of-some-length"
    monkeypatch.setenv(TOKEN_VARIABLE, "guess")
    with pytest.raises(impasto.ImpastoError, match="is no token"):
        admin_token(tmp_path)
