"""The many ways in which .lp files are written."""

import math
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from impasto.capture.lights_lp import read_lp


def rows(text):
    file = read_lp(Path("dirs.lp"), text)
    assert not file.problems
    return [(row.file, row.direction) for row in file.rows]


ONE = ("a.jpg", (0.1, -0.2, 0.97))


@pytest.mark.parametrize(
    "text",
    [
        "1\na.jpg 0.1 -0.2 0.97\n",
        "a.jpg 0.1 -0.2 0.97",
        "1\r\na.jpg\t0.1\t-0.2\t0.97\r\n",
        "\n\n  1  \n\n  a.jpg   0.1  -0.2  0.97  \t \n\n",
        "# lights\n1\na.jpg 0.1 -0.2 0.97\n",
        '"a.jpg" 0.1 -0.2 0.97',
        "'a.jpg' 0.1 -0.2 0.97",
        "a.jpg 0,1 -0,2 0,97",
        "a.jpg;0,1;-0,2;0,97",
        "a.jpg; 0.1; -0.2; 0.97;",
        "a.jpg,0.1,-0.2,0.97",
        "a.jpg, 0.1, -0.2, 0.97",
        "a.jpg, 0,1, -0,2, 0,97",
        "a.jpg .1 -.2 .97",
        "a.jpg 1e-1 -2E-1 +0.97",
        "a.jpg 0.1 \N{MINUS SIGN}0.2 0.97",
    ],
)
def test_one_light_however_written(text):
    assert rows(text) == [ONE]


@pytest.mark.parametrize(
    "name",
    [
        "photo 12.jpg",
        "photo 12",
        "C:\\RTI session\\jpeg-exports\\a.jpg",
        "/Volumes/Disk 1/a.jpg",
        "Köln (2).tif",
        "a,b.jpg",
        "0.5",
    ],
)
def test_names_with_blanks_paths_and_numbers(name):
    assert rows(f"{name} 0.1 -0.2 0.97\n") == [(name, ONE[1])]


@pytest.mark.parametrize(("count", "noted"), [("2\n", False), ("", False), ("7\n", True), ("0\n", True)])
def test_count_line_may_be_missing_or_wrong(count, noted):
    file = read_lp(Path("dirs.lp"), f"{count}a.jpg 0 0 1\nb.jpg 0 0 1\n")
    assert len(file.rows) == 2
    assert not file.problems
    assert bool(file.notes) == noted


def test_all_unreadable_rows_are_listed():
    file = read_lp(Path("dirs.lp"), "3\na.jpg 0 0 1\nb.jpg 0 0\n\nc.jpg x y z\n0.1 0.2 0.9\n")
    assert [problem.where for problem in file.problems] == ["dirs.lp row 3", "dirs.lp row 5", "dirs.lp row 6"]
    assert "'b.jpg 0 0', expected: file x y z" in file.problems[0].what
    assert [row.file for row in file.rows] == ["a.jpg"]


def test_rows_of_numbers_that_are_none_are_kept_for_the_check():
    (row,) = read_lp(Path("dirs.lp"), "a.jpg nan inf 1").rows
    assert math.isnan(row.direction[0])
    assert math.isinf(row.direction[1])


@pytest.mark.parametrize("text", ["", "\n\n", "12\n"])
def test_empty_file(text):
    assert "holds no lights" in read_lp(Path("dirs.lp"), text).problems[0].what


# Names as file systems have them, but for blanks and quotes, which have their own tests above.
names = st.text(
    st.characters(codec="utf-8", exclude_categories=("C", "Z"), exclude_characters="\"'#/\\,;"), min_size=1
)
coordinates = st.floats(-1, 1, allow_subnormal=False)


@given(
    st.lists(st.tuples(names, coordinates, coordinates, coordinates), min_size=1, max_size=5),
    st.sampled_from([" ", "\t", " \t  ", "; "]),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
    st.booleans(),
)
@example([("12", 0.0, 0.0, 1.0)], " ", "\n", False, True)
def test_what_is_written_is_read(lights, separator, newline, comma, count):
    lines = [str(len(lights))] if count else []
    for name, *vector in lights:
        numbers = [f"{value:.9f}".replace(".", "," if comma else ".") for value in vector]
        lines.append(separator.join([f"{name}.tif", *numbers]))
    read = rows(newline.join(lines) + newline)
    assert [name for name, _ in read] == [f"{name}.tif" for name, *_ in lights]
    for (_, direction), (_, *vector) in zip(read, lights, strict=True):
        assert direction == pytest.approx(vector, abs=1e-9)
