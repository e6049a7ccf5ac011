"""Photographs of a calibration are read one at a time, however many there are."""

import tracemalloc

import numpy as np
import pytest
import tifffile

import impasto
from impasto.errors import OptionError
from impasto.geometry import Camera
from impasto.stand.checks.spheres import check_spheres

SIZE = (400, 600)
PHOTOGRAPH = 400 * 600 * 3 * 2
# Columns, rows and radius of two mirror spheres.
SPHERES = ((150, 200, 30), (450, 200, 30))


def many(folder, count, *, image=None):
    """Write photographs of an even card of 600 x 400 pixels, and their light file."""
    folder.mkdir()
    for number in range(count):
        shown = np.full((*SIZE, 3), 20000, np.uint16) if image is None else image(number)
        tifffile.imwrite(folder / f"l{number:02d}.tif", shown, photometric="rgb")
    lights = folder.with_suffix(".lp")
    lights.write_text(f"{count}\n" + "".join(f"l{number:02d}.tif 0 0 1\n" for number in range(count)))
    return lights


def peak_bytes(calibrate):
    """Return what a calibration found, and the most memory that it held."""
    tracemalloc.start()
    found = calibrate()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return found, peak


def white(folder):
    return impasto.calibrate.white(
        folder, folder.with_suffix(".json"), box=(100, 100, 200, 200), lights=folder.with_suffix(".lp")
    )


def test_a_white_reference_is_read_one_photograph_at_a_time(tmp_path):
    many(tmp_path / "3", 3)
    many(tmp_path / "12", 12)
    white(tmp_path / "3")  # imports
    _, small = peak_bytes(lambda: white(tmp_path / "3"))
    found, large = peak_bytes(lambda: white(tmp_path / "12"))
    assert found.lights == 12
    assert large < small + PHOTOGRAPH


def lamp_in_spheres(number):
    """Return two dark spheres on a grey ground, with a lamp's image that wanders about them."""
    rows, columns = np.indices(SIZE)
    image = np.full(SIZE, 9000, np.uint16)
    for column, row, radius in SPHERES:
        image[np.hypot(columns - column, rows - row) < radius] = 500
        at = column + 12 * np.cos(number), row + 12 * np.sin(number)
        image[np.hypot(columns - at[0], rows - at[1]) < 3] = 60000
    return np.repeat(image[..., None], 3, axis=2)


def test_lights_are_found_from_one_photograph_at_a_time(tmp_path):
    def lights(folder):
        return impasto.calibrate.lights(folder, tmp_path / "lights", spheres=SPHERES)

    many(tmp_path / "3", 3, image=lamp_in_spheres)
    many(tmp_path / "12", 12, image=lamp_in_spheres)
    lights(tmp_path / "3")  # imports
    _, small = peak_bytes(lambda: lights(tmp_path / "3"))
    found, large = peak_bytes(lambda: lights(tmp_path / "12"))
    assert len(found.names) == 12
    assert large < small + PHOTOGRAPH


def test_spheres_are_checked_one_photograph_at_a_time(tmp_path):
    def check(count):
        paths = {path.stem: path for path in sorted((tmp_path / str(count)).iterdir())}
        return check_spheres(paths, dict.fromkeys(paths, np.array([0.0, 0.0, 1.0])), Camera())

    many(tmp_path / "3", 3, image=lamp_in_spheres)
    many(tmp_path / "12", 12, image=lamp_in_spheres)
    check(3)  # imports
    _, small = peak_bytes(lambda: check(3))
    (misplaced,), large = peak_bytes(lambda: check(12))
    assert len(misplaced.photographs) == 12
    # More lamps have more edges, among which spheres are looked for; nine photographs would take 22 such.
    assert large < small + 4 * PHOTOGRAPH


def test_a_grey_scale_s_exposures_are_read_one_at_a_time(tmp_path):
    def scale(number):
        image = np.random.default_rng(number).normal(3000, 20, (*SIZE, 3))
        for patch in range(6):
            image[100:130, 50 + 80 * patch : 80 + 80 * patch] *= 2 ** (15 - patch) / 3000 / (1 + number)
        return image.astype(np.uint16)

    table = tmp_path / "scale.csv"
    table.write_text(
        "patch,column0_px,row0_px,column1_px,row1_px,reflectance\n"
        + "".join(f"{n},{50 + 80 * n},100,{80 + 80 * n},130,{0.9 / 2**n}\n" for n in range(6))
    )

    def oecf(count):
        photos = sorted((tmp_path / str(count)).iterdir())
        times = [1 / (1 + number) for number in range(count)]
        return impasto.calibrate.oecf(photos, table, tmp_path / "oecf.json", exposures_s=times)

    many(tmp_path / "2", 2, image=scale)
    many(tmp_path / "8", 8, image=scale)
    oecf(2)  # imports
    _, small = peak_bytes(lambda: oecf(2))
    found, large = peak_bytes(lambda: oecf(8))
    assert found.patches == 48
    assert large < small + PHOTOGRAPH


def test_wrong_options_are_told_together(tmp_path):
    lights = many(tmp_path / "photos", 2)
    with pytest.raises(OptionError) as error:
        impasto.calibrate.white(
            tmp_path / "photos", tmp_path / "w.json", box=(0, 0, 900, 9), lights=lights, reflectance=7,
            normal=(0, 0, -1), light="l00",
        )  # fmt: skip
    assert [problem.where for problem in error.value.problems] == [
        "--box", "--light l00", "--reflectance 7", "--normal"
    ]  # fmt: skip
