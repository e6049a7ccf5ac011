"""What lights tell before a capture, and where to put them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from impasto.angles.identifiability import identify
from impasto.angles.plan import check, plan
from impasto.angles.surfaces import USUAL_NOISE, assumed_surface
from impasto.capture.light_files import read_light_file
from impasto.cli.commands import app
from impasto.errors import CaptureError, OptionError, StoreError
from impasto.geometry import Camera, Lights, arm_direction, dome_direction
from impasto.summaries.angles import plan_lines


def on_arm(step_deg):
    angle = np.arange(-72, 72 + 1e-9, step_deg)
    return Lights(tuple(map(str, range(len(angle)))), arm_direction(np.radians(angle)))


def told(found, parameter):
    return [
        value.told for kind in found.kinds for value in kind.uncertainties if value.parameter == parameter
    ]


def test_one_azimuth_does_not_tell_what_two_do():
    pixels = assumed_surface((20, 50)).pixels
    arm = on_arm(4.0)
    alone = identify(pixels, arm, Camera(), USUAL_NOISE)
    across = Lights(arm.names, arm.direction[:, [1, 0, 2]])
    both = Lights(
        (*arm.names, *(f"y{n}" for n in arm.names)), np.concatenate([arm.direction, across.direction])
    )
    crossed = identify(pixels, both, Camera(), USUAL_NOISE)
    assert any("one azimuth" in sentence for sentence in alone.sentences)
    assert not any("one azimuth" in sentence for sentence in crossed.sentences)
    assert max(told(alone, "specular")) < min(told(crossed, "specular"))


@pytest.mark.parametrize("step_deg", [2.0, 4.0, 8.0])
def test_highlights_narrower_than_the_steps_fall_between_the_lights(step_deg):
    found = identify(assumed_surface((60, 75)).pixels, on_arm(step_deg), Camera(), USUAL_NOISE)
    assert found.gap_deg == pytest.approx(step_deg, rel=0.15)
    narrow = [sentence for sentence in found.sentences if "narrower" in sentence]
    assert bool(narrow) == (step_deg > 2)


def test_assumed_gloss_is_what_a_glossmeter_reads():
    """60 units at 60° are a smooth interface of about c 0.02, by the anchors of the virtual glossmeter."""
    glossy, dull = (assumed_surface((gloss, gloss)).pixels.shape for gloss in (66.0, 10.0))
    assert np.median(glossy) == pytest.approx(0.0172, rel=0.1)
    assert np.median(dull) > 0.1


@pytest.mark.parametrize("kind", ["arm", "dome"])
def test_planned_lights_do_better_than_even_ones(kind, tmp_path):
    found = plan(kind, 15, out=tmp_path)
    assert found.expected_rms < 0.5 * found.even_expected_rms
    assert found.simulated_rms < 0.5 * found.even_simulated_rms
    for ending in (".lp", ".csv"):
        file = read_light_file(tmp_path / f"plan{ending}")
        assert not file.problems
        directions = np.array([row.direction for row in file.rows])
        assert directions == pytest.approx(found.direction, abs=1e-4)
    assert (tmp_path / "plan.png").stat().st_size > 10_000


def test_a_plan_from_which_fits_go_astray_says_so(tmp_path):
    """Expected errors are linear; what fits to simulated photographs find is not."""
    found = plan("arm", 6, out=tmp_path)
    assert found.simulated_rms > 2 * found.expected_rms
    assert any("go astray" in line for line in plan_lines(found))
    assert not any("go astray" in line for line in plan_lines(plan("arm", 15, out=tmp_path)))


def test_a_fit_tells_the_surface(painting, tmp_path):
    assert "fit in" in check(painting).surface
    assert "gloss units" in check(painting, gloss=(5, 20)).surface
    assert "fit in" in plan("dome", 12, store=painting, out=tmp_path).surface


def test_light_files_can_be_checked(tmp_path):
    file = tmp_path / "lights.lp"
    z = np.linspace(0.95, 0.3, 24)
    directions = dome_direction(np.arccos(z), 2.4 * np.arange(24))
    file.write_text("24\n" + "\n".join(f"{n}.jpg {x} {y} {z}" for n, (x, y, z) in enumerate(directions)))
    assert check(file).lights == 24


@pytest.mark.parametrize(
    ("call", "error", "told"),
    [
        (lambda path: plan("ring", 9, out=path), OptionError, "--plan"),
        (lambda path: plan("arm", 3, out=path), OptionError, "--lights 3"),
        (lambda path: plan("arm", 90, out=path), OptionError, "--lights 90"),
        (lambda path: plan("dome", 500, out=path), OptionError, "--lights"),
        (lambda path: plan("arm", 9, gloss=(50, 10), out=path), OptionError, "--gloss 50,10"),
        (lambda path: plan("arm", 9, relief_deg=-1, out=path), OptionError, "--relief"),
        (lambda path: plan("arm", 9, store=path / "no.zarr", out=path), StoreError, ""),
        (lambda path: check(path / "no.zarr"), StoreError, ""),
    ],
)
def test_what_cannot_be_planned_is_refused(call, error, told, tmp_path):
    with pytest.raises(error) as caught:
        call(tmp_path)
    assert any(problem.where.startswith(told) for problem in caught.value.problems)


def test_a_plan_needs_a_fit_where_it_is_to_follow_one(arm_store, tmp_path):
    with pytest.raises(StoreError, match="there is no such fit"):
        plan("arm", 9, store=arm_store, out=tmp_path)


def test_a_file_that_is_no_light_file_is_refused(tmp_path):
    file = tmp_path / "lights.lp"
    file.write_text("2\na.jpg 0 0 -1\n")
    with pytest.raises((CaptureError, OptionError)):
        check(file)


def test_the_command_line(arm_store, tmp_path):
    """Every way to call it, with its data."""
    run = CliRunner().invoke
    data = tmp_path / "data.json"
    study = [str(arm_store), "--held-out", "5", "--sizes", "7,12", "--pixels", "300", "--draws", "2"]
    done = run(app, ["angles", *study, "--json", str(data), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert len(json.loads(data.read_text())["scored"]) == 5
    assert "photographs serve (RMS within 5 %)" in done.output
    assert run(app, ["angles", str(arm_store), "--check"]).exit_code == 0
    placed = ["--plan", "arm", "--lights", "9", "--gloss", "10,60", "--out", str(tmp_path / "plan")]
    assert run(app, ["angles", *placed]).exit_code == 0
    for wrong in (
        [],
        ["--plan", "arm"],
        ["--check"],
        [str(arm_store), "--sizes", "a"],
        [str(arm_store), "--check", "--plan", "arm"],
    ):
        assert run(app, ["angles", *wrong]).exit_code == 1, wrong
