"""Raw photographs of which one is shifted, with every correction on, at whole and at half size.

Dark level and flat field belong to the sensor, and the picture moves over it: what a photograph shows is
flat(x) · picture(x − shift) + dark(x), through a response that bends.
"""

import json

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from typer.testing import CliRunner

from impasto.calibrate.files import Subject, write_calibration
from impasto.capture.simulate.charts import grey_scale
from impasto.capture.simulate.dng import write_dng
from impasto.cli.commands import app
from impasto.store import open_stack

HEIGHT, WIDTH = 144, 192
SHIFT = (14.4, -10.6)
LIGHTS = {"p0": 1.0, "p1": 0.8, "p2": 0.9, "p3": 0.7}
MOVED = "p2"
BLOB = (50, 110)


def run(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return " ".join(result.output.split())


def picture(shift_px=(0.0, 0.0)):
    """Return soft detail, with a spot that saturates the sensor, moved by columns and rows."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    x, y = x - shift_px[0], y - shift_px[1]
    level = 0.35 + 0.1 * np.sin(x / 7) * np.cos(y / 9) + 0.05 * np.sin((x + 2 * y) / 11)
    level += 4 * np.exp(-((x - BLOB[1]) ** 2 + (y - BLOB[0]) ** 2) / 18)
    return level[..., None] * np.array([1.0, 0.9, 0.8])


def flat():
    y, x = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    return (1 - 0.25 * (x**2 + y**2) + 0.1 * x)[..., None]


def dark():
    y, x = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    return (0.03 + 0.02 * x - 0.005 * y)[..., None] * np.ones(3)


def take(path, signal, seed=0, **noted):
    """Write a raw photograph of 14 bits by a sensor whose response bends; signal 1 saturates it."""
    noise = np.random.default_rng(seed).normal(0, 3e-5, signal.shape)
    codes = np.rint(65535 * np.clip(signal + noise, 0, 1) ** 0.9).astype(np.uint16)
    write_dng(path, codes, exposure_s=0.02, **noted)
    return path


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    """Return the folder of the photographs and the calibration files, made by the commands."""
    folder = tmp_path_factory.mktemp("all")
    photos = folder / "photos"
    photos.mkdir()
    for seed, (name, gain) in enumerate(LIGHTS.items(), start=1):
        shown = gain * picture(SHIFT if name == MOVED else (0, 0))
        take(photos / f"{name}.dng", flat() * shown + dark(), seed)
    rows = "".join(f"{name}.dng {0.2 * n - 0.3} 0.1 0.9\n" for n, name in enumerate(LIGHTS))
    (photos / "lights.lp").write_text(f"{len(LIGHTS)}\n{rows}")
    size = (4 * HEIGHT, 4 * WIDTH)
    (folder / "scale.csv").write_text(grey_scale().table(size))
    scale = take(folder / "scale.dng", 0.9 * grey_scale().image(size))
    run("calibrate", "oecf", scale, folder / "scale.csv", folder / "oecf.json")
    cap = take(folder / "cap.dng", dark(), 9)
    card = take(folder / "card.dng", 0.5 * flat() * np.ones(3) + dark(), 8)
    run("calibrate", "dark", cap, folder / "dark.json", "--oecf", folder / "oecf.json")
    run("calibrate", "flat", card, folder / "flat.json", "--dark", folder / "dark.json",
        "--oecf", folder / "oecf.json")  # fmt: skip
    steadiness(folder / "steady.json")
    return folder


def steadiness(path, size=(WIDTH, HEIGHT)):
    """Write what a measurement without error finds."""
    content = {
        "shift_px": {name: list(SHIFT) if name == MOVED else [0.0, 0.0] for name in LIGHTS},
        "uncertainty_px": dict.fromkeys(LIGHTS, 0.1),
        "moved": [MOVED],
        "corrected": [MOVED],
        "turned_px": {},
    }
    write_calibration(path, "steadiness", content, subject=Subject(size=size), made_from=[])


def files(folder, *kinds):
    return [word for kind in kinds for word in (f"--{kind}", folder / f"{KINDS[kind]}.json")]


KINDS = {"oecf": "oecf", "dark": "dark", "flat": "flat", "steadiness": "steady"}


@pytest.fixture(scope="module", params=[1, 2], ids=["whole size", "half size"])
def stacked(request, series):
    store = series / f"all-{request.param}.zarr"
    half = ["--half-size"] if request.param == 2 else []
    said = run("stack", series / "photos", store, *files(series, *KINDS), *half)
    shift = np.hypot(*SHIFT) / request.param
    assert f"1 of 4 photographs are shifted back, by up to {shift:.2f} px (p2)" in said
    stack = open_stack(store)
    height, width = stack.shape[1:3]
    assert (height, width) == (HEIGHT // request.param, WIDTH // request.param)
    radiance = stack.radiance(slice(0, height), slice(0, width))
    return request.param, radiance, radiance < stack.clip_level


def test_the_moved_photograph_shows_what_the_others_show(stacked):
    """Half a per cent; dark level and flat field applied after the shift would be off by nine."""
    half, radiance, usable = stacked
    names = list(LIGHTS)
    even = np.array([level / LIGHTS[name] for name, level in zip(names, radiance, strict=True)])
    good = usable.all(axis=0)
    # Beside the spot and in the outermost pixels, the mosaic alone makes a difference of a few per cent.
    good[:2], good[-2:], good[:, :2], good[:, -2:] = False, False, False, False
    rows, columns = np.indices(good.shape[:2])
    good &= (np.hypot(rows - BLOB[0] / half, columns - BLOB[1] / half) > 20 / half)[..., None]
    still = [n for n, name in enumerate(names) if name != MOVED]
    assert good.mean() > 0.6
    reference = even[still].mean(axis=0)
    for row, name in enumerate(names):
        off = (even[row] / reference - 1)[good]
        assert np.sqrt(np.mean(off**2)) < 0.005, name
        assert np.abs(off).max() < 0.02, name


def test_what_is_stacked_is_the_picture(stacked):
    """Up to one factor: an even card says nothing about the level."""
    half, radiance, usable = stacked
    truth = picture().reshape(HEIGHT // half, half, WIDTH // half, half, 3).mean(axis=(1, 3))
    gains = np.array(list(LIGHTS.values()))[:, None, None, None]
    ratio = (radiance / (gains * truth))[usable]
    assert np.std(ratio) / np.mean(ratio) < 0.02


def test_clipped_samples_move_with_the_picture(stacked):
    half, _, usable = stacked
    row, column = (place // half for place in BLOB)
    light = list(LIGHTS).index(MOVED)
    assert not usable[:, row, column].any()
    # Where the spot lay on the sensor, other paint lies now.
    columns, rows = (round(by / half) for by in SHIFT)
    assert usable[light, row + rows, column + columns].all()
    # Its size is that in the others, but for what the kernel reaches: three pixels to each side.
    window = np.s_[row - 20 // half : row + 20 // half, column - 20 // half : column + 20 // half, 1]
    lost = [~usable[number][window] for number in range(len(LIGHTS))]
    assert 0 < lost[0].sum() <= lost[light].sum()
    grown = gaussian_filter(lost[0].astype(float), 2, truncate=2) > 1e-6
    assert not (lost[light] & ~grown).any()
    # What the sensor did not see is missing.
    assert not usable[light, :, -columns:].any()


@pytest.mark.parametrize("kind", ["steadiness", "dark", "flat"])
def test_files_for_any_other_size_are_refused(series, tmp_path, kind):
    """A third as large, or the half without the option: neither is the whole nor the half."""
    content = json.loads((series / f"{KINDS[kind]}.json").read_text())
    for size, half in (((WIDTH // 3, HEIGHT // 3), True), ((WIDTH // 2, HEIGHT // 2), False)):
        content["for"]["size"] = size
        (tmp_path / "other.json").write_text(json.dumps(content))
        words = ["stack", series / "photos", tmp_path / "s.zarr", f"--{kind}", tmp_path / "other.json"]
        result = CliRunner().invoke(app, [str(word) for word in words] + ["--half-size"] * half)
        assert result.exit_code == 1, result.output
        assert f"other.json is for {size[0]} x {size[1]} pixels" in " ".join(result.output.split())
        assert not (tmp_path / "s.zarr").exists()


def test_shifts_measured_at_half_size_are_taken_as_they_are(series, tmp_path):
    content = json.loads((series / "steady.json").read_text())
    content["for"]["size"] = [WIDTH // 2, HEIGHT // 2]
    (tmp_path / "half.json").write_text(json.dumps(content))
    run(
        "stack", series / "photos", tmp_path / "s.zarr", "--half-size", "--steadiness", tmp_path / "half.json"
    )
    entries = open_stack(tmp_path / "s.zarr").attributes["inputs"]
    assert [entry.get("shift_px") for entry in entries] == [None, None, list(SHIFT), None]
