"""A white reference is read from one photograph at a time."""

import tracemalloc

import numpy as np
import pytest
import tifffile

import impasto
from impasto.errors import OptionError


def many(folder, count):
    """Write photographs of an even card of 600 x 400 pixels, and their light file."""
    folder.mkdir()
    card = np.full((400, 600, 3), 20000, np.uint16)
    for number in range(count):
        tifffile.imwrite(folder / f"l{number:02d}.tif", card, photometric="rgb")
    lights = folder.with_suffix(".lp")
    lights.write_text(f"{count}\n" + "".join(f"l{number:02d}.tif 0 0 1\n" for number in range(count)))
    return lights


def peak_bytes(folder, lights, out):
    tracemalloc.start()
    found = impasto.calibrate.white(folder, out, box=(100, 100, 200, 200), lights=lights)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return found, peak


def test_memory_does_not_grow_with_the_photographs(tmp_path):
    few, more = (many(tmp_path / str(count), count) for count in (3, 12))
    impasto.calibrate.white(tmp_path / "3", tmp_path / "w.json", box=(0, 0, 9, 9), lights=few)  # imports
    _, small = peak_bytes(tmp_path / "3", few, tmp_path / "w.json")
    found, large = peak_bytes(tmp_path / "12", more, tmp_path / "w.json")
    assert found.lights == 12
    photograph = 400 * 600 * 3 * 2
    assert large < small + photograph


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
