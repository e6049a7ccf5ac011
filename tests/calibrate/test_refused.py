"""A calibration made for another camera, ISO or size is refused, from raw file to stack."""

import numpy as np
import pytest
from typer.testing import CliRunner

from impasto.capture.simulate.charts import colour_chart, grey_scale
from impasto.capture.simulate.dng import write_dng
from impasto.cli.commands import app

SIDE = 40


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def grey(side, level, seed):
    noise = np.random.default_rng(seed).normal(0, 20, (side, side, 3))
    return np.clip(level + noise, 0, 65535).astype(np.uint16)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """Return raw photographs under three lights, of the simulated camera at ISO 100."""
    folder = tmp_path_factory.mktemp("raw") / "photos"
    folder.mkdir()
    for number in range(3):
        write_dng(folder / f"p{number}.dng", grey(SIDE, 9000 + 3000 * number, number), exposure_s=0.02)
    lights = [f"p{number}.dng {0.3 * number - 0.3} 0.2 0.9" for number in range(3)]
    (folder / "lights.lp").write_text("\n".join(["3", *lights]) + "\n")
    return folder


@pytest.mark.parametrize(
    ("side", "noted", "expected"),
    [
        (SIDE, {}, None),
        (SIDE, {"camera": "other camera"}, "camera impasto other camera, and these photographs have camera"),
        (SIDE, {"iso": 400}, "ISO 400, and these photographs have ISO 100"),
        (SIDE + 8, {}, "48 x 48 pixels, and these photographs have 40 x 40 pixels"),
    ],
    ids=["of these photographs", "another camera", "another ISO", "another size"],
)
def test_a_dark_frame_serves_its_own_photographs_only(photos, tmp_path, side, noted, expected):
    write_dng(tmp_path / "dark.dng", grey(side, 60, 9), exposure_s=0.02, **noted)
    made = run("calibrate", "dark", tmp_path / "dark.dng", tmp_path / "dark.json")
    assert made.exit_code == 0, made.output
    store = tmp_path / "s.zarr"
    result = run("stack", photos, store, "--dark", tmp_path / "dark.json")
    assert result.exit_code == (0 if expected is None else 1), result.output
    if expected is not None:
        assert expected in " ".join(result.output.split())
        assert not store.exists()


def calibrated(kind, folder, side=SIDE, **noted):
    """Calibrate by raw files of a camera; return the calibration file."""

    def take(name, image):
        write_dng(folder / name, np.clip(image, 0, 65535).astype(np.uint16), exposure_s=0.02, **noted)
        return folder / name

    out = folder / f"{kind}.json"
    if kind == "flat":
        words = [take("card.dng", grey(side, 30000, 8)), out]
    elif kind == "white":
        lights = folder / "lights.lp"
        lights.write_text("1\nwhite.dng 0 0 1\n")
        words = [take("white.dng", grey(side, 30000, 8)), out, "--box", "4,4,36,36", "--lights", lights]
    else:
        chart, size = {"oecf": grey_scale, "colour": colour_chart}[kind](), (4 * side, 6 * side)
        table = folder / "chart.csv"
        table.write_text(chart.table(size))
        words = [take("chart.dng", 60000 * chart.image(size)), table, out]
        words += ["--card", take("even.dng", np.full((*size, 3), 30000))]
    made = run("calibrate", kind, *words)
    assert made.exit_code == 0, made.output
    return out


@pytest.mark.parametrize(
    ("kind", "noted", "expected"),
    [
        ("flat", {"camera": "other camera"}, "camera impasto other camera, and"),
        ("flat", {"side": SIDE + 8}, "48 x 48 pixels, and these photographs have 40 x 40 pixels"),
        ("white", {"camera": "other camera"}, "camera impasto other camera, and"),
        ("white", {"iso": 400}, "ISO 400, and these photographs have ISO 100"),
        ("oecf", {"camera": "other camera"}, "camera impasto other camera, and"),
        ("oecf", {"iso": 400}, "ISO 400, and these photographs have ISO 100"),
        ("colour", {"camera": "other camera"}, "camera impasto other camera, and"),
    ],
)
def test_every_other_calibration_is_refused_where_it_does_not_fit(photos, tmp_path, kind, noted, expected):
    store = tmp_path / "s.zarr"
    result = run("stack", photos, store, f"--{kind}", calibrated(kind, tmp_path, **noted))
    assert result.exit_code == 1, result.output
    assert expected in " ".join(result.output.split())
    assert not store.exists()


@pytest.mark.parametrize("kind", ["flat", "white", "oecf", "colour"])
def test_calibrations_by_the_same_camera_are_taken(photos, tmp_path, kind):
    result = run("stack", photos, tmp_path / "s.zarr", f"--{kind}", calibrated(kind, tmp_path))
    assert result.exit_code == 0, result.output


def test_a_dark_frame_of_another_camera_is_no_one_s_black(tmp_path):
    """Neither for a flat field nor for stray light nor for colour."""
    write_dng(tmp_path / "dark.dng", grey(SIDE, 60, 9), camera="other camera")
    write_dng(tmp_path / "card.dng", grey(SIDE, 30000, 8))
    assert run("calibrate", "dark", tmp_path / "dark.dng", tmp_path / "dark.json").exit_code == 0
    dark = ["--dark", tmp_path / "dark.json"]
    boxes = ["--trap", "4,4,9,9", "--bright", "20,20,30,30"]
    for words in (
        ["flat", tmp_path / "card.dng", tmp_path / "f.json"],
        ["glare", tmp_path / "card.dng", *boxes],
    ):
        result = run("calibrate", *words, *dark)
        assert result.exit_code == 1, result.output
        assert "is for camera impasto other camera, and these" in " ".join(result.output.split())
