"""The commands at the stand, as a person types them."""

import json
import os
import pty
import subprocess
import sys

from typer.testing import CliRunner

from impasto.cli.commands import app
from impasto.stand.journal import Journal
from impasto.store import open_stack

RUNNER = CliRunner()


def run(*words):
    result = RUNNER.invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


def test_plan_run_check_and_stack_follow_each_other(tmp_path):
    plan, photos = tmp_path / "plan.toml", tmp_path / "photos"
    said = run(
        "capture", "plan", plan, "--arm", "-40,40,10", "--camera", "simulated", "--light", "simulated",
        "--times", "1,0.1", "--calibration", "dark",
    )  # fmt: skip
    assert "9 places of the lamp, 2 exposures each" in said
    plan.write_text(plan.read_text().replace("size = [192, 128]", 'size = [96, 64]\nsample = "b"'))
    data = tmp_path / "run.json"
    said = run("capture", "run", plan, photos, "--unattended", "--json", data)
    assert f"{photos} is complete: 19 photographs" in said
    assert json.loads(data.read_text())["taken"] == 19
    said = run("capture", "run", plan, photos, "--unattended")  # and again: there is nothing to do
    assert "0 photographs taken, 19 were there before" in said
    said = run("capture", "check", photos)
    assert "18 photographs checked: nothing is wrong" in said
    run("stack", photos, tmp_path / "painting.zarr")
    assert open_stack(tmp_path / "painting.zarr").shape[0] == 9


def test_nobody_at_the_terminal_is_an_error_before_anything_is_written(tmp_path):
    plan = tmp_path / "plan.toml"
    run("capture", "plan", plan, "--arm", "0,10,10", "--camera", "simulated", "--light", "hand")
    result = RUNNER.invoke(app, ["capture", "run", str(plan), str(tmp_path / "photos")])
    assert result.exit_code == 1
    assert "no terminal" in result.output
    assert not (tmp_path / "photos").exists()


def test_whoever_stops_a_capture_stops_a_script_too(tmp_path):
    plan, photos = tmp_path / "plan.toml", tmp_path / "photos"
    run("capture", "plan", plan, "--arm", "0,10,10", "--camera", "simulated", "--light", "hand")
    terminal, typed_at = pty.openpty()
    os.write(terminal, b"s\n")
    program = "from impasto.cli.commands import app; app()"
    command = [sys.executable, "-c", program, "capture", "run", plan, photos]
    done = subprocess.run(command, stdin=typed_at, capture_output=True, text=True, timeout=60)
    os.close(terminal)
    os.close(typed_at)
    assert done.returncode == 130, done.stdout + done.stderr
    assert "is not complete; run the same command again to go on" in done.stdout


def test_a_step_that_leads_nowhere_is_an_error(tmp_path):
    result = RUNNER.invoke(app, ["capture", "plan", str(tmp_path / "p.toml"), "--arm", "0,10,-1"])
    assert result.exit_code == 1
    assert "leads from its start to nowhere" in result.output


def test_a_line_that_a_power_cut_left_unfinished_is_skipped(tmp_path):
    path = tmp_path / "journal.jsonl"
    journal = Journal(path)
    journal.write("run")
    journal.close()
    with path.open("ab") as file:
        file.write(b'{"number": 2, "event": "photo')
    journal = Journal(path)
    assert journal.broken_lines == 1
    assert journal.write("run")["number"] == 2
    journal.close()
    assert [entry["number"] for entry in Journal(path).entries] == [1, 2]


def test_a_line_that_the_disk_takes_only_in_part_leaves_nothing_behind(tmp_path):
    """The system allows 400 bytes per file: a real refusal in the middle of a line."""
    script = (
        "import resource, sys\n"
        "from impasto.errors import OutputError\n"
        "from impasto.stand.journal import Journal\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (400, resource.RLIM_INFINITY))\n"
        "journal = Journal(__import__('pathlib').Path(sys.argv[1]))\n"
        "try:\n"
        "    while True: journal.write('run')\n"
        "except OutputError as error: print(error)\n"
        "journal.close()\n"
    )
    path = tmp_path / "journal.jsonl"
    done = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True)
    assert "journal.jsonl: cannot be written" in done.stdout
    assert path.stat().st_size < 400
    numbers = [json.loads(line)["number"] for line in path.open()]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) > 2
    assert Journal(path).broken_lines == 0
