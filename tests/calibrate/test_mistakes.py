"""The wrong file, folder, card, cap or number is told before a calibration, and nothing is written."""

import json

import numpy as np
import pytest
import tifffile
from tests.calibrate.shots import take_shots
from typer.testing import CliRunner

from impasto.capture.simulate import simulate
from impasto.cli.commands import app
from impasto.images import write_jpeg


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shots")
    directions = ((0.1, 0.2, 0.97), (0.5, 0.1, 0.8), (-0.3, 0.4, 0.8))
    take_shots(folder, distance_mm=600, vignetting=0.2, directions=directions)
    return folder


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("painting") / "photos"
    simulate(folder, preset="swatches", lights=4, size=(64, 48), light_distance_mm=500, seed=3)
    return folder


def said(*words, refused=True):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == int(refused), result.output
    assert "fault of the program" not in result.output
    return " ".join(result.output.split())


def turned(shots, name, folder):
    path = folder / f"turned_{name}"
    tifffile.imwrite(path, tifffile.imread(shots / name)[::-1, ::-1], photometric="rgb")
    return path


def test_a_text_file_is_no_photograph(tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    assert "ends in '.txt', expected a TIFF" in said(
        "calibrate", "dark", tmp_path / "notes.txt", tmp_path / "d.json"
    )


@pytest.mark.parametrize("kind", ["oecf", "dark", "flat", "white", "colour", "steadiness"])
@pytest.mark.parametrize("damage", ["text", "binary", "list", "empty", "version"])
def test_no_file_but_a_whole_calibration_is_taken_for_one(photos, tmp_path, kind, damage):
    path = tmp_path / "c.json"
    whole = {"impasto_calibration": 1, "kind": kind, "for": {}, "made_from": []}
    content = {
        "text": b"hello", "binary": b"\xff\xfe\x00", "list": b"[1, 2]", "empty": json.dumps(whole).encode(),
        "version": json.dumps(whole | {"impasto_calibration": "x"}).encode(),
    }[damage]  # fmt: skip
    path.write_bytes(content)
    told = said("stack", photos, tmp_path / "s.zarr", f"--{kind}", path)
    assert "is damaged: it lacks" in told if damage == "empty" else "is not a calibration file" in told
    assert f"impasto calibrate {kind}" in told


def test_photographs_of_a_painting_are_no_even_cards(photos, tmp_path):
    assert "Fill the frame with an even, matte card" in said("calibrate", "flat", photos, tmp_path / "f.json")
    assert not (tmp_path / "f.json").exists()


def test_a_cap_that_leaks_light_is_told_with_the_place(shots, tmp_path):
    image = tifffile.imread(shots / "dark.tif").astype(float)
    rows, columns = np.indices(image.shape[:2])
    image += 20000 * np.exp(-((columns - 470) ** 2 + (rows - 10) ** 2) / 2000)[..., None]
    tifffile.imwrite(tmp_path / "leak.tif", np.uint16(image), photometric="rgb")
    told = said("calibrate", "dark", tmp_path / "leak.tif", tmp_path / "d.json")
    assert "about column 47" in told
    assert "light leaks in" in told


def test_flat_fields_of_8_bits_are_not_for_photographs_of_16(photos, tmp_path):
    cards = tmp_path / "cards"
    cards.mkdir()
    for path in (photos / "calibration" / "flat").glob("*.tif"):
        write_jpeg(cards / f"{path.stem}.jpg", np.uint8(255 * (tifffile.imread(path) / 65535) ** (1 / 2.2)))
    said("calibrate", "flat", cards, tmp_path / "f.json", "--lights", photos / "capture.toml", refused=False)
    told = said("stack", photos, tmp_path / "s.zarr", "--flat", tmp_path / "f.json")
    assert "is for values of type uint8, and these photographs have values of type uint16" in told


def test_a_chart_upside_down_makes_no_colour_but_is_found_by_itself(shots, tmp_path):
    chart = turned(shots, "colour_chart.tif", tmp_path)
    words = ["calibrate", "colour", chart, shots / "colour_chart.csv", tmp_path / "c.json"]
    assert "which way up the target lies" in said(*words, "--card", shots / "white_card.tif")
    assert not (tmp_path / "c.json").exists()
    said("calibrate", "target", chart, tmp_path / "found.csv", refused=False)


@pytest.mark.parametrize(
    ("card", "told"), [("dark", "reads 0.0% of full scale"), ("colour_chart", "no even")]
)
def test_a_card_that_is_none_makes_no_colour(shots, tmp_path, card, told):
    chart, table = shots / "colour_chart.tif", shots / "colour_chart.csv"
    assert told in said(
        "calibrate", "colour", chart, table, tmp_path / "c.json", "--card", shots / f"{card}.tif"
    )


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--card", "dark.tif"], "dark.tif reads 0.0% of full scale"),
        (["--dark", "grey_scale_card.tif"], "grey_scale_card.tif reads a code of"),
        (["--photo", "white_card.tif", "--exposure-s", "1", "--exposure-s", "0.5"], "do not become brighter"),
        (
            ["--photo", "grey_scale.tif", "--exposure-s", "0", "--exposure-s", "1"],
            "--exposure-s 0 is not above 0",
        ),
    ],
)
def test_what_is_no_grey_scale_card_or_cap_makes_no_response(shots, tmp_path, options, told):
    words = [shots / word if word.endswith(".tif") else word for word in options]
    table = shots / "grey_scale.csv"
    output = said("calibrate", "oecf", shots / "grey_scale.tif", table, tmp_path / "o.json", *words)
    assert told in output


def test_a_grey_scale_upside_down_makes_no_response(shots, tmp_path):
    scale = turned(shots, "grey_scale.tif", tmp_path)
    told = said("calibrate", "oecf", scale, shots / "grey_scale.csv", tmp_path / "o.json")
    assert "which way up the grey scale lies" in told or "is black in" in told


def test_boxes_that_miss_the_reference_and_the_trap_are_told(shots, photos, tmp_path):
    words = [
        "calibrate",
        "white",
        photos / "calibration" / "spheres",
        tmp_path / "w.json",
        "--box",
        "1,1,20,20",
    ]
    assert "lights that differ by" in said(*words, "--lights", photos / "capture.toml")
    boxes = ["--trap", "10,10,20,20", "--bright", "40,40,60,60"]
    assert "no black trap" in said("calibrate", "glare", shots / "white_card.tif", *boxes)


def test_a_folder_of_unlike_photographs_is_no_series(shots, tmp_path):
    told = said("calibrate", "steadiness", shots, tmp_path / "s.json")
    assert "photographs with too little in common" in told
    assert not (tmp_path / "s.json").exists()


def test_a_sphere_that_the_frame_cuts_off_is_named(photos, tmp_path):
    for path in (photos / "calibration" / "spheres").glob("*.tif"):
        tifffile.imwrite(tmp_path / path.name, tifffile.imread(path)[:, 40:], photometric="rgb")
    told = said("calibrate", "lights", tmp_path, "--out", tmp_path / "lights", refused=False)
    assert "sphere 1 is cut off by the frame's edge" in told


@pytest.mark.parametrize("option", [["--radius-mm", "-3"], ["--mm-per-px", "0"], ["--count", "0"]])
def test_sizes_of_nothing_are_refused(photos, tmp_path, option):
    told = said("calibrate", "lights", photos / "calibration" / "spheres", "--out", tmp_path / "l", *option)
    assert f"{option[0]} {option[1]} is not above 0" in told


def test_the_photographs_are_no_further_exposure_of_themselves(photos, tmp_path):
    told = said("stack", photos, tmp_path / "s.zarr", "--brackets", photos)
    assert "holds the photographs themselves" in told
