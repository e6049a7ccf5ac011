"""The simulator's brackets and its black trap, read by the commands that a camera's files are for."""

import csv
from itertools import pairwise

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from typer.testing import CliRunner

from impasto.capture.photographs import read_photograph
from impasto.capture.simulate import glare, simulate
from impasto.cli.commands import app
from impasto.images import write_tiff
from impasto.store import open_stack

SCENE = {"sample": "a", "size": (160, 120), "lights": 9, "exposure": 1.0, "seed": 2}
EXPOSURES = 5


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """Return a capture of a glossy sample, whose shorter exposures say only by tags how long they are."""
    folder = tmp_path_factory.mktemp("shots") / "photos"
    simulate(folder, brackets=EXPOSURES, **SCENE)
    for manifest in (folder / "brackets").glob("*/capture.toml"):
        manifest.unlink()
    return folder


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def brackets(folder):
    return [word for path in sorted((folder / "brackets").iterdir()) for word in ("--brackets", path)]


@pytest.mark.parametrize(("kind", "ending"), [("tiff", ".tif"), ("dng", ".dng")])
def test_files_note_how_long_they_were_exposed(tmp_path, kind, ending):
    simulate(tmp_path / "p", size=(48, 32), lights=2, brackets=2, format=kind)
    for place, exposure_s in (("", 0.1), ("brackets/ev-2", 0.025), ("brackets/ev-4", 0.00625)):
        photograph, _ = read_photograph(tmp_path / "p" / place / f"light-001{ending}")
        assert photograph.exposure_s == pytest.approx(exposure_s, rel=1e-4)
    dark, _ = read_photograph(tmp_path / "p" / "calibration" / f"dark{ending}")
    assert dark.exposure_s == pytest.approx(0.1)


def test_merged_exposures_are_right_within_a_per_cent_over_four_decades(photos, tmp_path):
    """Means of samples of like radiance, against photographs without noise that never clip."""
    done = run("stack", photos, tmp_path / "p.zarr", *brackets(photos))
    assert done.exit_code == 0, done.output
    simulate(tmp_path / "truth", format="exr", noise=False, calibration=False, **SCENE)
    stack = open_stack(tmp_path / "p.zarr")
    merged = stack.radiance(slice(0, 120), slice(0, 160))
    files = [str(tmp_path / "truth" / f"{name}.exr") for name in stack.lights.names]
    truth = np.stack([oiio.ImageBuf(file).get_pixels(oiio.FLOAT) for file in files])
    usable = merged < stack.clip_level
    edges = np.geomspace(2e-3, 300, 16)
    seen = []
    for low, high in pairwise(edges):
        here = usable & (truth >= low) & (truth < high)
        if here.sum() >= 100:
            seen += [low, high]
            assert merged[here].mean() / truth[here].mean() == pytest.approx(1, abs=0.01), (low, here.sum())
    assert max(seen) / min(seen) > 1e4


def test_a_wrong_time_in_a_file_is_found_and_named(photos, tmp_path):
    wrong = tmp_path / "ev-2"
    wrong.mkdir()
    for path in (photos / "brackets" / "ev-2").iterdir():
        (wrong / path.name).write_bytes(path.read_bytes())
    image = tifffile.imread(wrong / "light-003.tif")
    write_tiff(wrong / "light-003.tif", image, exposure_s=0.05)
    done = run("stack", photos, tmp_path / "p.zarr", "--brackets", wrong)
    assert done.exit_code == 1
    said = " ".join(done.output.split())
    assert "ev-2/light-003.tif is stated to be exposed 0.5 times as long" in said
    assert said.count("is stated to be exposed") == 1


def test_the_lens_s_stray_light_is_reported(photos):
    shots = photos / "calibration"
    with (shots / "glare.csv").open() as file:
        boxes = {row.pop("area"): ",".join(row.values()) for row in csv.DictReader(file)}
    areas = [word for name, box in boxes.items() for word in (f"--{name}", box)]
    done = run("calibrate", "glare", shots / "glare.tif", *areas, "--bright-reflectance", 1)
    assert done.exit_code == 0, done.output
    said = done.output.split("trap:")[1].split(" of the")[0]
    shares = [float(word) for word in said.replace(" %", "").split(",")]
    assert shares == pytest.approx([100 * glare.SHARE] * 3, rel=0.08)
