"""The command line: names, exit codes, what is printed and what is written as data."""

import json
import os
import shutil
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

import impasto
from impasto.cli.commands import app

MODEL = "torrance-sparrow"
runner = CliRunner()


def run(*arguments):
    return runner.invoke(app, [str(argument) for argument in arguments])


def flat(text):
    """Return a text with each run of blanks as one, whatever the width of the terminal."""
    return " ".join(text.split())


def test_an_interruption_while_a_command_is_loaded_ends_without_a_traceback():
    script = (
        "import sys, impasto.cli as cli; sys.argv = ['impasto', 'fit']; "
        "cli.import_module = lambda _: (_ for _ in ()).throw(KeyboardInterrupt); cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")


def test_help_comes_fast():
    """Others call the program in loops, and nobody waits for help."""
    script = "import sys; from impasto.cli import main; sys.argv = ['impasto', '--help']; main()"
    times = []
    for _ in range(3):
        started = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        times.append(time.perf_counter() - started)
    assert "simulate" in done.stdout
    # 0.6 s on an idle machine; the margin is for one that is busy.
    assert min(times) < 1.5


def test_help_imports_nothing_heavy():
    script = (
        "import sys, impasto.cli.commands; "
        "print([name for name in ('zarr', 'xarray', 'matplotlib', 'scipy', 'skimage', 'OpenImageIO') "
        "if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_command_that_writes_pictures_ends_without_a_word_about_memory(painting, tmp_path):
    """OpenImageIO's binding lists what was not released when Python ends, as if it were a mistake."""
    arguments = ["render", painting, "--model", MODEL, "--light", "30,0", "--out", tmp_path, "--raw"]
    script = (
        f"import sys; from impasto.cli import main; sys.argv = {['impasto', *map(str, arguments)]}; main()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr == ""


def test_the_pipeline_from_photographs_to_renderings(capture, tmp_path):
    store, data = tmp_path / "p.zarr", tmp_path / "data.json"

    result = run("stack", capture, store, "--json", data)
    assert result.exit_code == 0, result.output
    assert "16 photographs of 60 x 44 px" in result.output
    stacked = json.loads(data.read_text())
    assert (stacked["command"], stacked["exit_code"], stacked["photographs"]) == ("stack", 0, 16)

    result = run("fit", store, "--model", MODEL, "--json", data)
    assert result.exit_code == 0, result.output
    assert "converged" in result.output
    (fitted,) = json.loads(data.read_text())["models"]
    assert sum(fitted["pixels"].values()) == 60 * 44

    out = tmp_path / "out"
    result = run("render", store, "--model", MODEL, "--light", "30,45", "--arm", "-20:20:20", "--out", out)
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} >= {"1.exr", "1.png", "4.exr", "4.png", f"{MODEL}.webp"}

    result = run("maps", store, "--model", MODEL, "--out", tmp_path / "maps", "--json", data)
    assert result.exit_code == 0, result.output
    assert "16-bit TIFF" in result.output
    assert (tmp_path / "maps" / "normal.exr").is_file()
    assert json.loads(data.read_text())["model"] == MODEL


def test_evaluate_prints_a_row_per_light_and_the_mean(painting, tmp_path):
    data = tmp_path / "data.json"
    result = run("evaluate", painting, "--held-out", 2, "--model", "phong", "--json", data)
    assert result.exit_code == 0, result.output
    found = json.loads(data.read_text())
    (model,) = found["models"]
    assert model["refitted"]
    assert [entry["name"] for entry in model["lights"]] == found["held_out"]
    for entry in model["lights"]:
        assert f"{entry['errors']['psnr_db']:.2f}" in result.output
    assert f"{model['mean']['ssim']:.4f}" in result.output


def test_models_are_listed_with_their_sources():
    result = run("models")
    assert result.exit_code == 0
    for name, spec in impasto.models.MODELS.items():
        assert name in result.output
        assert spec.title in result.output


def test_all_problems_are_shown_in_four_parts(capture, tmp_path):
    photos = tmp_path / "photos"
    shutil.copytree(capture, photos)
    lights = photos / "lights.lp"
    (photos / "capture.toml").unlink()
    rows = [f"light-{number:03d}.tif 0.1 0.2 0.97" for number in range(16)]
    rows[3] = "light-003.tif 0.31 0.20 -0.93"
    rows[5] = "light-005.tif 0 0 0"
    rows[7] = "light-999.tif 0.1 0.2 0.97"
    lights.write_text("\n".join(["16", *rows]))
    store, data = tmp_path / "p.zarr", tmp_path / "data.json"
    result = run("stack", photos, store, "--json", data)
    assert result.exit_code == 1
    written = json.loads(data.read_text())
    assert written["exit_code"] == 1
    assert len(written["problems"]) >= 4
    for problem in written["problems"]:
        assert set(problem) == {"where", "what", "do"}
        assert all(part in flat(result.output) for part in map(flat, problem.values()))
    assert f"{len(written['problems'])} problems" in result.output
    assert not (store / "zarr.json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["render", "{store}", "--model", "gloss", "--light", "20,0"], "gloss"),
        (["render", "{store}", "--model", MODEL], "no light is given"),
        (["render", "{store}", "--model", MODEL, "--light", "north"], "ZENITH,AZIMUTH"),
        (["render", "{store}", "--model", MODEL, "--arm", "100"], "below the surface"),
        (["maps", "{store}", "--model", "lambert"], "no such fit"),
        (["maps", "{store}x", "--model", MODEL], "no such store"),
    ],
)
def test_input_that_cannot_be_used_ends_with_1(painting, tmp_path, arguments, words):
    out = tmp_path / "out"
    result = run(*(text.format(store=painting) for text in arguments), "--out", out)
    assert result.exit_code == 1
    assert words in flat(result.output)
    assert "→" in result.output
    assert not out.exists()


@pytest.mark.parametrize("arguments", [["--held-out", "0"], ["--held-out", "16"], ["--held-out", "-3"]])
def test_a_number_to_hold_out_that_makes_no_sense_ends_with_1(painting, arguments):
    result = run("evaluate", painting, *arguments)
    assert result.exit_code == 1
    assert "can be held out" in flat(result.output)


@pytest.mark.parametrize("arguments", [["fit"], ["polish"], ["fit", "x", "--speed", "9"], ["maps", "x"]])
def test_a_command_line_that_cannot_be_understood_ends_with_2(arguments):
    assert run(*arguments).exit_code == 2


def test_an_interruption_ends_with_130(painting, monkeypatch, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("impasto.maps", interrupt)
    data = tmp_path / "data.json"
    result = run("maps", painting, "--model", MODEL, "--out", tmp_path, "--json", data)
    assert result.exit_code == 130
    assert "interrupted" in result.output
    assert json.loads(data.read_text())["exit_code"] == 130


def test_a_full_disk_is_the_disk_s_fault_and_not_the_program_s(painting, monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise OSError(28, "No space left on device", "/somewhere/map.exr")

    monkeypatch.setattr("impasto.maps", refuse)
    result = run("maps", painting, "--model", MODEL, "--out", tmp_path)
    assert result.exit_code == 1
    assert "/somewhere/map.exr" in result.output
    assert "no room left" in result.output
    assert "fault of the program" not in result.output


def test_a_fault_of_the_program_says_how_to_report_it(painting, monkeypatch, tmp_path):
    def fail(*_, **__):
        raise ZeroDivisionError("of a kind that nobody foresaw")

    monkeypatch.setattr("impasto.maps", fail)
    result = run("maps", painting, "--model", MODEL, "--out", tmp_path)
    assert result.exit_code == 1
    assert "ZeroDivisionError: of a kind that nobody foresaw" in flat(result.output)
    assert f"impasto {impasto.__version__}" in flat(result.output)
    assert "Traceback" not in result.output
    debugged = run("maps", painting, "--model", MODEL, "--out", tmp_path, "--debug")
    assert debugged.exit_code == 1
    assert "Traceback" in debugged.output


def test_a_panic_of_the_core_is_a_fault_and_no_traceback(painting, monkeypatch, tmp_path):
    panic = type("PanicException", (BaseException,), {})  # as pyo3 has it

    def fail(*_, **__):
        raise panic("index out of bounds")

    monkeypatch.setattr("impasto.maps", fail)
    data = tmp_path / "data.json"
    result = run("maps", painting, "--model", MODEL, "--out", tmp_path, "--json", data)
    assert result.exit_code == 1
    assert "PanicException: index out of bounds" in flat(result.output)
    assert json.loads(data.read_text())["exit_code"] == 1


@pytest.mark.parametrize("name", ["", "no/data.json"])
def test_data_that_cannot_be_written_are_told_before_the_work(monkeypatch, tmp_path, name):
    monkeypatch.setattr("impasto.maps", lambda *_, **__: pytest.fail("the work began"))
    result = run("maps", "p.zarr", "--model", MODEL, "--out", tmp_path, "--json", tmp_path / name)
    assert result.exit_code == 1
    assert "--json" in result.output
    assert "→" in result.output


def test_data_go_through_a_pipe_and_leave_it_one(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert run("models", "--json", pipe).exit_code == 0
        assert json.loads(os.read(reader, 1 << 16))["command"] == "models"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_a_shadow_level_that_is_no_number_is_refused(painting):
    result = run("fit", painting, "--shadow-level", "nan")
    assert result.exit_code == 1
    assert "--shadow-level" in result.output
    assert "fault of the program" not in result.output


def test_version_is_told():
    assert run("--version").output.split() == ["impasto", impasto.__version__]
