"""The whole chain on the command line: from the shots that the simulator makes to a calibrated stack."""

import pytest
from typer.testing import CliRunner

import impasto
from impasto.capture.simulate import simulate
from impasto.cli.commands import app


def run(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output


def test_every_step_of_the_calibration_leads_to_an_absolute_stack(tmp_path):
    """A camera with a tone curve of its own and vignetting, and lamps close by."""
    photos, store = tmp_path / "photos", tmp_path / "p.zarr"
    simulate(
        photos, lights=4, size=(240, 180), light_distance_mm=500, vignetting=0.25, brackets=1, response="tone"
    )
    shots, manifest = photos / "calibration", photos / "capture.toml"
    oecf, dark, flat = tmp_path / "oecf.json", tmp_path / "dark.json", tmp_path / "flat.json"
    white, colour = tmp_path / "white.json", tmp_path / "colour.json"
    cards = shots / "flat"

    said = run("calibrate", "lights", shots / "spheres", "--camera", manifest, "--mm-per-px", 0.5,
               "--out", tmp_path / "lights")  # fmt: skip
    assert "4 lights in" in said
    run("calibrate", "oecf", shots / "grey_scale.tif", shots / "grey_scale.csv", oecf,
        "--card", shots / "grey_scale_card.tif", "--dark", shots / "dark.tif")  # fmt: skip
    run("calibrate", "dark", shots / "dark.tif", dark, "--oecf", oecf)
    run("calibrate", "flat", cards, flat, "--lights", manifest, "--dark", dark, "--oecf", oecf)
    said = run("calibrate", "white", cards, white, "--box", "110,80,130,100", "--lights", manifest,
               "--reflectance", 1, "--oecf", oecf)  # fmt: skip
    assert "4 lights agree" in said
    said = run("calibrate", "colour", shots / "colour_chart.tif", shots / "colour_chart.csv", colour,
               "--card", shots / "white_card.tif", "--dark", dark, "--oecf", oecf)  # fmt: skip
    assert "root-polynomial" in said
    run("calibrate", "steadiness", photos, tmp_path / "steady.json")
    said = run("stack", photos, store, "--brackets", photos / "brackets" / "ev-2", "--oecf", oecf,
               "--dark", dark, "--flat", flat, "--white", white, "--colour", colour)  # fmt: skip
    assert "not calibrated" not in said

    attributes = impasto.open(store)["stack"].attrs
    assert set(attributes["calibration"]) == {"oecf", "dark", "flat", "white", "colour"}
    assert attributes["light_rgb_source"] == "white reference"
    assert attributes["light_rgb"] == pytest.approx([1, 1, 1], abs=0.01)
    assert impasto.calibrate.lights.__doc__
