"""Photographs and lights read together, with everything that can be wrong between them."""

import numpy as np
import pytest
import tifffile

from impasto.capture import read_capture
from impasto.errors import CaptureError


def problems(folder, **options):
    with pytest.raises(CaptureError) as caught:
        read_capture(folder, **options)
    return [str(problem) for problem in caught.value.problems]


def test_pairs_by_name_in_the_order_of_the_light_file(make_capture):
    capture = read_capture(make_capture(text="c.tif 0.3 0 0.9\na.tif 0.1 0 0.9\nb.tif 0.2 0 0.9\n"))
    assert capture.lights.names == ("c", "a", "b")
    assert [photograph.name for photograph in capture.photographs] == ["c", "a", "b"]
    assert [int(next(photograph.bands(9))[1][0, 0, 0]) for photograph in capture.photographs] == [
        3000,
        1000,
        2000,
    ]
    np.testing.assert_allclose(
        capture.lights.direction[:, 0], np.array([0.3, 0.1, 0.2]) / np.hypot([0.3, 0.1, 0.2], 0.9)
    )
    np.testing.assert_array_equal(capture.lights.intensity, np.ones((3, 1)))
    assert capture.clip_level == pytest.approx(0.99 * 65535)
    assert capture.noise == {}
    assert capture.light_file.name == "dirs.lp"


@pytest.mark.parametrize(
    ("written", "noted"),
    [
        ("A.TIF", False),
        ("C:\\session\\a.tif", False),
        ("../session/a.tif", False),
        ("a", False),
        ("a.jpg", True),
        ("exports/A.JPG", True),
    ],
)
def test_names_are_matched_without_case_folder_and_ending(make_capture, written, noted):
    capture = read_capture(make_capture(names=("a.tif",), text=f"{written} 0 0 1\n"))
    assert capture.lights.names == ("a",)
    assert any("paired without their endings" in note for note in capture.notes) == noted


def test_names_in_different_unicode_forms_match(make_capture):
    decomposed, composed = "Ko\u0308ln", "K\u00f6ln"
    capture = read_capture(make_capture(names=(f"{decomposed}.tif",), text=f"{composed}.tif 0 0 1\n"))
    assert len(capture.photographs) == 1


def test_dots_in_names_are_no_endings(make_capture):
    names = ("a.1.tif", "a.2.tif")
    capture = read_capture(make_capture(names=names, text="a.2 0 0 1\na.1 0.1 0 1\n"))
    assert capture.lights.names == ("a.2", "a.1")


def test_every_mismatch_is_listed(make_capture):
    folder = make_capture(text="a.tif 0 0 1\nd.tif 0 0 1\ne.tif 0 0 1\n")
    listed = problems(folder)
    assert len(listed) == 4
    assert listed[0].startswith("dirs.lp row 2: no photograph is named d.tif")
    assert listed[1].startswith("dirs.lp row 3: no photograph is named e.tif")
    assert listed[2].startswith("b.tif: no light in dirs.lp has this name")
    assert listed[3].startswith("c.tif: no light in dirs.lp has this name")


def test_everything_wrong_is_listed_at_once(make_capture):
    text = (
        "a.tif 0.1 0.2 -0.9\n"
        "b.tif nan 0 1\n"
        "c.tif 0 0 0\n"
        "d.tif 0 0 1\n"
        "d.tif 0 0.1 1\n"
        "e.tif 0 0 1\n"
        "f.tif 0 0 1\n"
    )
    names = ("a.tif", "b.tif", "c.tif", "d.tif", "e.tif", "f.tif", "g.tif")
    folder = make_capture(
        names, text=text, **{"e.tif": np.zeros((5, 6, 3), np.uint16), "f.tif": np.zeros((4, 6), np.uint16)}
    )
    (folder / "broken.tif").write_bytes(b"II*\0")
    listed = problems(folder, exclude=["nowhere"])
    expected = [
        "--exclude nowhere: matches no photograph",
        "d.tif: is named by 2 lights: dirs.lp row 4, dirs.lp row 5",
        "broken.tif: no light in dirs.lp has this name",
        "g.tif: no light in dirs.lp has this name",
        "broken.tif: is not a readable TIFF file",
        "e.tif: has 6 x 5 px, 3 channels of uint16; 5 of 7 photographs have 6 x 4 px",
        "f.tif: has 6 x 4 px, 1 channel of uint16",
        "dirs.lp row 1: direction (0.1, 0.2, -0.9) lies below the surface; z must be > 0",
        "dirs.lp row 2: direction (nan, 0, 1) is not finite",
        "dirs.lp row 3: direction (0, 0, 0) points nowhere",
    ]
    assert len(listed) == len(expected)
    for problem, start in zip(listed, expected, strict=True):
        assert problem.startswith(start)


def test_rows_that_cannot_be_read_hide_no_other_mismatch(make_capture):
    text = "a.tif 0 1\nb.tif 0 0 1\nb.tif 0 0.1 1\nz.tif 0 0 1\n"
    assert [problem.split(":")[0] for problem in problems(make_capture(text=text))] == [
        "dirs.lp row 1",
        "dirs.lp row 4",
        "b.tif",
    ]


def test_missing_light_file_and_photographs_are_reported_together(tmp_path):
    (tmp_path / "image.xcf").write_bytes(b"")
    (tmp_path / "dark").mkdir()
    tifffile.imwrite(tmp_path / "dark" / "dark.tif", np.zeros((4, 4), np.uint16))
    listed = problems(tmp_path)
    assert len(listed) == 2
    assert "holds no light file" in listed[0]
    assert "holds no photographs" in listed[1]


def test_folder_that_is_none(tmp_path):
    assert "does not exist" in problems(tmp_path / "lost")[0]
    (tmp_path / "file").write_text("")
    assert "is not a folder" in problems(tmp_path / "file")[0]


def test_subfolders_and_hidden_files_are_not_looked_at(make_capture):
    folder = make_capture()
    (folder / "calibration").mkdir()
    tifffile.imwrite(folder / "calibration" / "white.tif", np.zeros((9, 9), np.uint8))
    (folder / "._a.tif").write_bytes(b"resource fork")
    assert len(read_capture(folder).photographs) == 3


def test_directions_of_other_lengths_are_normalised_with_a_note(make_capture):
    capture = read_capture(make_capture(text="a.tif 0 0 2\nb.tif 0 3 4\nc.tif 0 0 0.9999\n"))
    np.testing.assert_allclose(capture.lights.direction, [[0, 0, 1], [0, 0.6, 0.8], [0, 0, 1]])
    assert any("2 of 3 directions have not unit length (2 to 5)" in note for note in capture.notes)


@pytest.mark.parametrize("exclude", [["b"], ["b.tif"], ["B.*"], ["[b]"], ["?.tif", "*"]])
def test_exclude(make_capture, exclude):
    folder = make_capture()
    (folder / "b.tif").write_bytes(b"damaged, and therefore left out")
    if "*" in exclude:
        assert any("all photographs are left out" in problem for problem in problems(folder, exclude=exclude))
        return
    capture = read_capture(folder, exclude=exclude)
    assert capture.lights.names == ("a", "c")
    assert "left out on request: b.tif" in capture.notes


def test_exclude_serves_lights_and_photographs_without_partner(make_capture):
    folder = make_capture(text="a.tif 0 0 1\nb.tif 0 0 1\nlost.tif 0 0 1\n")
    assert read_capture(folder, exclude=["lost", "c"]).lights.names == ("a", "b")


def test_photographs_that_differ_only_in_ending(make_capture):
    folder = make_capture(("a.tif", "a.tiff"), text="a.tif 0 0 1\na.tiff 0 0.1 1\n")
    assert problems(folder)[0].startswith("a.tif, a.tiff: photographs have the same name")
    assert read_capture(folder, exclude=["a.tiff"]).photographs[0].path.name == "a.tif"


def test_matrix_without_names_pairs_in_natural_order_and_says_so(make_capture):
    names = ("i1.tif", "i2.tif", "i10.tif")
    folder = make_capture(names, "light_directions.txt", "0 0.6 0\n0 0 0.6\n1 0.8 0.8\n")
    capture = read_capture(folder)
    assert capture.lights.names == ("i1", "i2", "i10")
    np.testing.assert_allclose(capture.lights.direction[2], [0, 0.6, 0.8])
    assert any("natural order of their names, i1.tif to i10.tif" in note for note in capture.notes)
    without = read_capture(folder, exclude=["i2"])
    np.testing.assert_allclose(without.lights.direction, capture.lights.direction[[0, 2]])
    tifffile.imwrite(folder / "target.tif", np.zeros((4, 6, 3), np.uint16), photometric="rgb")
    assert problems(folder) == [
        "light_directions.txt: holds 3 directions without names, the folder 4 photographs. Remove what does "
        "not belong there, or give the lights by name in a .lp or CSV file."
    ]
    assert read_capture(folder, exclude=["target"]).lights.names == ("i1", "i2", "i10")


def test_lights_option_names_a_file_anywhere_or_in_the_folder(make_capture, tmp_path_factory):
    folder = make_capture()
    (folder / "other.lp").write_text("a 0 0 1\nb 0 0 1\nc 0 0 1\n")
    elsewhere = tmp_path_factory.mktemp("lights") / "third.csv"
    elsewhere.write_text("file,arm\na,1\nb,2\nc,3\n")
    assert read_capture(folder, lights="other.lp").lights.direction[0, 2] == 1
    assert read_capture(folder, lights=elsewhere).lights.direction[2, 0] == pytest.approx(
        np.sin(np.radians(3))
    )
    assert "cannot be read" in problems(folder, lights="lost.lp")[0]


def toml(*lights, head=""):
    return head + "".join(f'[[light]]\nfile = "{name}"\n{rest}\n' for name, rest in lights)


def test_near_lights_gains_and_sizes(make_capture):
    text = toml(
        ("a.tif", "position_mm = [300, 0, 400]\ngain = [1, 1.5, 2]\nangular_size_deg = 3"),
        ("b.tif", "arm_angle_deg = 0\ngain = 2"),
        head="[camera]\nmm_per_px = 0.1\n",
    )
    lights = read_capture(make_capture(("a.tif", "b.tif"), "capture.toml", text)).lights
    np.testing.assert_allclose(lights.direction, [[0.6, 0, 0.8], [0, 0, 1]])
    np.testing.assert_array_equal(lights.position_mm, [[300, 0, 400], [np.nan] * 3])
    np.testing.assert_array_equal(lights.intensity, [[1, 1.5, 2], [2, 2, 2]])
    np.testing.assert_array_equal(lights.angular_size_deg, [3, np.nan])


def test_lights_of_impossible_strength_size_or_scale(make_capture):
    text = toml(
        ("a.tif", "position_mm = [300, 0, 400]\ngain = 0"),
        ("b.tif", "arm_angle_deg = inf\ngain = [1, 2]"),
        ("c.tif", "arm_angle_deg = 90\nangular_size_deg = -1\nexposure_s = 0"),
        head="[camera]\ndistance_mm = 1000\n",
    )
    listed = problems(make_capture(lights="capture.toml", text=text))
    expected = [
        "capture.toml light 1 (a.tif): gain (0) is not above 0",
        "capture.toml light 2 (b.tif): direction (nan, 0, nan) is not finite",
        "capture.toml light 2 (b.tif): gain has 2 numbers, the photographs have 3 channels",
        "capture.toml light 3 (c.tif): direction (1, 0, 6.123e-17) lies below the surface",
        "capture.toml light 3 (c.tif): angular_size_deg -1 is not from 0 to 180",
        "capture.toml light 3 (c.tif): exposure_s 0 is not above 0",
        "capture.toml: has 1 lights with position_mm and a camera with distance_mm, but no mm_per_px",
    ]
    assert len(listed) == len(expected)
    for problem, start in zip(listed, expected, strict=True):
        assert problem.startswith(start)


def test_exposures_count_as_intensity(make_capture):
    text = toml(
        ("a.tif", "arm_angle_deg = 0\nexposure_s = 0.1"),
        ("b.tif", "arm_angle_deg = 10\nexposure_s = 0.1"),
        ("c.tif", "arm_angle_deg = 20\nexposure_s = 0.025\ngain = 2"),
    )
    capture = read_capture(make_capture(lights="capture.toml", text=text))
    np.testing.assert_allclose(capture.lights.intensity[:, 0], [1, 1, 0.5])
    assert any("exposure time differs, 0.025 to 0.1 s" in note for note in capture.notes)


def test_exposures_from_exif(make_capture):
    folder = make_capture()
    for name, denominator, f_number in (("a", 60, 8), ("b", 30, 8), ("c", 60, 4)):
        tags = [(33434, "2I", 1, (1, denominator), True), (33437, "2I", 1, (f_number, 1), True)]
        tifffile.imwrite(
            folder / f"{name}.tif", np.zeros((4, 6, 3), np.uint16), photometric="rgb", extratags=tags
        )
    np.testing.assert_allclose(read_capture(folder).lights.intensity[:, 0], [1, 2, 4])


def test_unknown_exposure_among_differing_ones(make_capture):
    text = toml(
        ("a.tif", "arm_angle_deg = 0\nexposure_s = 0.1"),
        ("b.tif", "arm_angle_deg = 10"),
        ("c.tif", "arm_angle_deg = 20\nexposure_s = 0.2"),
    )
    (problem,) = problems(make_capture(lights="capture.toml", text=text))
    assert problem.startswith("b.tif: has no exposure time, and the others have different ones")


def test_photographs_must_be_encoded_alike(make_capture):
    from icc_profiles import gamma_curve, rgb

    folder = make_capture()
    pixels = np.zeros((4, 6, 3), np.uint16)
    tifffile.imwrite(
        folder / "b.tif", pixels, photometric="rgb", iccprofile=rgb(gamma_curve(2.2), name="Odd")
    )
    (problem,) = problems(folder)
    assert problem.startswith("b.tif: is encoded as icc:Odd; 2 of 3 photographs as linear")
    manifest = '[photographs]\ntransfer = "srgb"\nclip_level = 60000\n'
    (folder / "capture.toml").write_text(f'lights = "dirs.lp"\n{manifest}')
    capture = read_capture(folder)
    assert {photograph.transfer for photograph in capture.photographs} == {"srgb"}
    assert capture.clip_level == 60000
    assert "all 3 photographs: decoded as srgb (as the light file states)" in capture.notes


def test_floats_cannot_be_encoded(make_capture):
    floats = {name: np.zeros((4, 6, 3), np.float32) for name in ("a.tif", "b.tif", "c.tif")}
    folder = make_capture(**floats)
    assert read_capture(folder).clip_level == np.inf
    (folder / "capture.toml").write_text('lights = "dirs.lp"\n[photographs]\ntransfer = "srgb"\n')
    assert len(problems(folder)) == 3


def test_one_profile_with_curves_for_more_channels_than_there_are(make_capture):
    from icc_profiles import gamma_curve, rgb

    folder = make_capture(("a.tif",))
    odd = rgb(gamma_curve(1.0), gamma_curve(2.0))
    tifffile.imwrite(folder / "a.tif", np.zeros((4, 6), np.uint8), photometric="minisblack", iccprofile=odd)
    assert "curves for 3 channels, the photograph has 1" in problems(folder)[0]


def test_icon(shared):
    capture = read_capture(shared / "captures" / "icon")
    assert len(capture.photographs) == len(capture.lights) == 72
    first = capture.photographs[0]
    assert (first.height, first.width, first.channels, first.dtype) == (395, 402, 3, np.uint8)
    assert first.transfer == "srgb"
    assert capture.clip_level == 254
    np.testing.assert_allclose(
        capture.lights.direction[0], [0.205158607, -0.237020612, 0.949595268], atol=1e-8
    )
    assert capture.notes == ("all 72 photographs: decoded as srgb (8 bits without a profile: assumed)",)
    rows = [band for photograph in capture.photographs[:3] for _, band in photograph.bands(100)]
    assert sum(map(len, rows)) == 3 * 395


def test_cat(shared):
    cat = shared / "captures" / "cat"
    capture = read_capture(cat / "Objects", lights=cat / "light_directions.txt")
    assert capture.lights.names == tuple(f"Image_{number:02d}" for number in range(1, 13))
    assert {photograph.channels for photograph in capture.photographs} == {1}
    np.testing.assert_allclose(capture.lights.direction[11], [-0.13562, -0.18023, 0.97423], atol=1e-5)
    assert any("natural order" in note for note in capture.notes)
