"""A calibration made for another camera, ISO or size is refused, from raw file to stack."""

import numpy as np
import pytest
from typer.testing import CliRunner

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
