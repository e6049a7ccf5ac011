"""CSV, TOML and matrix light files, and how a light file is found."""

import math
from pathlib import Path

import numpy as np
import pytest

from impasto.capture.light_files import find_light_file, read_light_file
from impasto.errors import CaptureError

HALF = math.sqrt(0.5)


def read(tmp_path, name, text, encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return read_light_file(path)


def directions(file):
    assert not file.problems, file.problems
    return [row.direction for row in file.rows]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name,arm_angle_deg\na.tif,45\n", (HALF, 0, HALF)),
        ("file,angle\na.tif,-45\n", (-HALF, 0, HALF)),
        ("Name;Arm\na.tif;45,0\n", (HALF, 0, HALF)),
        ("file\tzenith_deg\tazimuth_deg\na.tif\t45\t90\n", (0, HALF, HALF)),
        ("zenith, azimuth, file\n 45, 180, a.tif\n", (-HALF, 0, HALF)),
        ("file,x,y,z\na.tif,0.1,0.2,0.9\n", (0.1, 0.2, 0.9)),
        ('file;x;y;z\n"a.tif";0,1;0,2;0,9\n', (0.1, 0.2, 0.9)),
        ("\n\nfile,arm\r\na.tif,0\r\n\r\n", (0, 0, 1)),
    ],
)
def test_csv(tmp_path, text, expected):
    file = read(tmp_path, "lights.csv", text)
    assert directions(file) == [pytest.approx(expected, abs=1e-12)]
    assert file.rows[0].file == "a.tif"


def test_csv_with_gain_exposure_and_an_unknown_column(tmp_path):
    text = "file,arm,gain,exposure_s,angular_size_deg,weather\na.tif,0,1.5,0.25,2,fine\nb.tif,5,,,,\n"
    first, second = read(tmp_path, "lights.csv", text).rows
    assert (first.gain, first.exposure_s, first.angular_size_deg) == ((1.5,), 0.25, 2)
    assert (second.gain, second.exposure_s) == ((1.0,), None)
    assert math.isnan(second.angular_size_deg)
    assert "columns not used: weather" in read(tmp_path, "lights.csv", text).notes[0]


@pytest.mark.parametrize(
    ("text", "reasons"),
    [
        ("", ["columns nothing, expected file, and one of"]),
        ("a.tif,0,0,1\n", ["expected file, and one of"]),
        ("file,zenith\na.tif,3\n", ["expected file, and one of"]),
        ("file,arm,x,y,z\na.tif,3,0,0,1\n", ["expected file, and one of"]),
        ("file,arm,angle\na.tif,3,4\n", ["more than one column for arm_angle_deg"]),
        ("file,arm\n", ["holds no lights"]),
        (
            "file,arm\na.tif,left\nb.tif,\n,4\nc.tif,1,2\n",
            ["'left' is not", "nothing", "no photograph", "3 fields"],
        ),
        ("file,x,y,z\na.tif,1,2,\n", ["2 numbers, expected 3"]),
    ],
)
def test_bad_csv_lists_every_row(tmp_path, text, reasons):
    problems = read(tmp_path, "lights.csv", text).problems
    assert len(problems) == len(reasons)
    for problem, reason in zip(problems, reasons, strict=True):
        assert reason in problem.what


TOML = """
[camera]
view = { theta_deg = 0, phi_deg = 5 }
distance_mm = 1200
mm_per_px = 0.05

[photographs]
transfer = 1.8
clip_level = 4000
noise = { read = 0.002 }

[[light]]
file = "a.tif"
arm_angle_deg = 45

[[light]]
file = "b.tif"
position_mm = [100, 0.0, 1000]
gain = [1, 1.1, 1.2]
angular_size_deg = 2.5
exposure_s = 0.5

[[light]]
file = "c.tif"
zenith_deg = 45
azimuth_deg = 90
gain = 2

[[light]]
file = "d.tif"
direction = [0, 0, 1]
"""


def test_toml(tmp_path):
    file = read(tmp_path, "capture.toml", TOML)
    assert directions(file) == [
        pytest.approx((HALF, 0, HALF)),
        (100, 0, 1000),
        pytest.approx((0, HALF, HALF)),
        (0, 0, 1),
    ]
    assert [row.position_mm for row in file.rows] == [None, (100, 0, 1000), None, None]
    assert [row.gain for row in file.rows] == [(1,), (1, 1.1, 1.2), (2,), (1,)]
    assert (file.rows[1].angular_size_deg, file.rows[1].exposure_s) == (2.5, 0.5)
    np.testing.assert_allclose(
        file.camera.view_direction, [0, math.sin(math.radians(5)), math.cos(math.radians(5))]
    )
    assert (file.camera.distance_mm, file.camera.mm_per_px) == (1200, 0.05)
    assert (file.transfer, file.clip_level, file.noise) == ("gamma:1.8", 4000, {"read": 0.002})


@pytest.mark.parametrize(
    ("view", "expected"),
    [
        ("[0, 0, 2]", (0, 0, 1)),
        ("{ vector = [0, 3, 4] }", (0, 0.6, 0.8)),
        ("{ zenith_deg = 90.0, azimuth_deg = 0 }", None),
        ("{ zenith_deg = 5 }", None),
        ("{ zenith_deg = 5, phi_deg = 1 }", None),
        ("{}", None),
        ("[0, 1]", None),
    ],
)
def test_view(tmp_path, view, expected):
    text = f'[camera]\nview = {view}\n[[light]]\nfile = "a"\narm_angle_deg = 0\n'
    file = read(tmp_path, "capture.toml", text)
    if expected:
        assert not file.problems
        np.testing.assert_allclose(file.camera.view_direction, expected)
    else:
        (problem,) = file.problems
        assert "view" in str(problem)


def test_toml_lists_all_that_is_wrong(tmp_path):
    text = """
weather = "fine"
[camera]
mm_per_pixel = 0.1
distance_mm = -3
[photographs]
transfer = "rec709"
noise = { reed = 1 }
[[light]]
file = "a.tif"
angle = 3
[[light]]
arm_angle_deg = "left"
"""
    problems = [str(problem) for problem in read(tmp_path, "capture.toml", text).problems]
    assert any("unknown key weather. Allowed here: lights, camera, photographs, light" in p for p in problems)
    assert any(
        "[camera]: unknown key mm_per_pixel. Allowed here: view, distance_mm, mm_per_px" in p
        for p in problems
    )
    assert any("distance_mm = -3: input should be greater than 0" in p for p in problems)
    assert any("'rec709' is not one of linear, srgb or a gamma" in p for p in problems)
    assert any(
        "[photographs.noise]: unknown key reed. Allowed here: read, photon, relative" in p for p in problems
    )
    assert any(
        "light 1 (a.tif): unknown key angle. Allowed here: direction, arm_angle_deg" in p for p in problems
    )
    assert any("light 2: key file is missing" in p for p in problems)
    assert any("light 2: arm_angle_deg = 'left'" in p for p in problems)
    assert len(problems) == 8


@pytest.mark.parametrize(
    ("light", "reason"),
    [
        ("", "by nothing, expected exactly one of"),
        ("arm_angle_deg = 3\ndirection = [0, 0, 1]", "by direction and arm_angle_deg"),
        ("direction = [0, 1]", "2 numbers, expected 3"),
        ("azimuth_deg = 3", "only one of zenith_deg and azimuth_deg"),
    ],
)
def test_toml_light_that_is_not_placed_once(tmp_path, light, reason):
    (problem,) = read(tmp_path, "capture.toml", f'[[light]]\nfile = "a.tif"\n{light}\n').problems
    assert problem.where == "capture.toml light 1 (a.tif)"
    assert reason in problem.what


def test_toml_syntax_error_names_the_line(tmp_path):
    (problem,) = read(tmp_path, "capture.toml", "[camera]\nview = \n").problems
    assert "line 2" in problem.what


def test_toml_may_refer_to_another_light_file(tmp_path):
    (tmp_path / "dirs.lp").write_text("a.tif 0 0 1\n")
    file = read(tmp_path, "capture.toml", 'lights = "dirs.lp"\n[camera]\nmm_per_px = 0.1\n')
    assert directions(file) == [(0, 0, 1)]
    assert file.camera.mm_per_px == 0.1
    assert find_light_file(tmp_path).name == "capture.toml"
    both = 'lights = "dirs.lp"\n[[light]]\nfile = "a.tif"\narm_angle_deg = 0\n'
    assert "has both" in read(tmp_path, "capture.toml", both).problems[0].what


MATRIX = "0.1 0.2 0.3 0.4\n0 0 0 0\n0.9 0.8 0.7 0.6\n"


def test_matrix(tmp_path):
    assert directions(read(tmp_path, "light_directions.txt", MATRIX))[3] == (0.4, 0, 0.6)
    transposed = "0.1 0 0.9\n0.2 0 0.8\n0,3\t0\t0,7\n0.4 0 0.6\n"
    assert directions(read(tmp_path, "light_directions.txt", transposed))[3] == (0.4, 0, 0.6)


@pytest.mark.parametrize("text", ["", "1 2\n3 4\n", "1 2 3\n4 5\n6 7 8\n", "1 2 3\n4 5 x\n7 8 9\n"])
def test_bad_matrix(tmp_path, text):
    assert read(tmp_path, "light_directions.txt", text).problems


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path, encoding):
    (row,) = read(tmp_path, "dirs.lp", "1\nKöln.tif 0 0 1\n", encoding).rows
    assert row.file == "Köln.tif"


def test_several_light_files_must_be_chosen_from(tmp_path):
    for name in ("b.csv", "a.lp", "light_directions.txt", "notes.txt", ".hidden.lp"):
        (tmp_path / name).write_text("")
    with pytest.raises(CaptureError, match=r"3 light files: a\.lp, b\.csv, light_directions\.txt.*--lights"):
        find_light_file(tmp_path)


def test_no_light_file(tmp_path):
    with pytest.raises(CaptureError, match="holds no light file"):
        find_light_file(tmp_path)
    with pytest.raises(CaptureError, match="cannot be read: No such file"):
        read_light_file(tmp_path / "dirs.lp")
    with pytest.raises(CaptureError, match=r"has the ending \.xlsx"):
        read_light_file(tmp_path / "lights.xlsx")


def test_the_documented_example_is_valid(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "captures.md").read_text(encoding="utf-8")
    example = page.split("```toml\n")[1].split("```")[0]
    file = read(tmp_path, "capture.toml", example)
    assert not file.problems
    assert [row.file for row in file.rows] == ["arm_-30.tif", "lamp_left.tif"]
    assert file.clip_level == 64000
