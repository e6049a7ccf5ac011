"""Renderings: what lies in the files, in what encoding, and what happens at the edges."""

import sys

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import Image

import impasto
from impasto.colour import encode_srgb
from impasto.colour.adaptation import WHITE_POINTS, xy_to_xyz
from impasto.colour.displays import display_p3
from impasto.colour.primaries import SRGB, rgb_to_xyz_matrix
from impasto.colour.rendition import Rendition
from impasto.errors import OptionError, OutputError, StoreError
from impasto.geometry import Lights
from impasto.render import _band_rows, render_bands
from impasto.store import open_fit, open_stack
from impasto.summaries.render import render_lines

MODEL = "torrance-sparrow"


def read(path):
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    return image.read_image(spec.format)


def test_a_photograph_is_rendered_as_it_was_taken(painting, tmp_path):
    """Under a photograph's own light the rendering is the photograph, to the fit's residual."""
    stack = open_stack(painting)
    lights = stack.lights.select([3, 8])
    impasto.render(painting, model=MODEL, lights=lights, out=tmp_path)
    for index, name in zip([3, 8], lights.names, strict=True):
        photograph = stack.radiance(slice(0, stack.shape[1]), slice(0, stack.shape[2]), [index])[0]
        rendered = read(tmp_path / f"{name}.exr")
        error = np.sqrt(np.nanmean((rendered - photograph) ** 2)) / photograph.mean()
        assert error < 0.15
        # The neighbour's light would not do.
        other = read(tmp_path / f"{lights.names[1 if index == 3 else 0]}.exr")
        assert np.sqrt(np.nanmean((other - photograph) ** 2)) / photograph.mean() > 2 * error


def test_display_pictures_are_the_encoded_radiance(painting, tmp_path):
    impasto.render(painting, model=MODEL, light=[(40, 120)], out=tmp_path, exposure=2.0)
    linear, shown = read(tmp_path / "1.exr"), read(tmp_path / "1.png")
    assert shown.dtype == np.uint8
    np.testing.assert_array_equal(shown, np.rint(encode_srgb(linear, 2.0) * 255))


def test_intensity_scales_the_radiance(painting, tmp_path):
    direction = np.array([[0.3, 0.2, 0.9327379]])
    for name, intensity in (("one", 1.0), ("two", 2.0)):
        lights = Lights((name,), direction, intensity=np.array([[intensity]]))
        impasto.render(painting, model="phong", lights=lights, out=tmp_path, raw=True)
    one, two = read(tmp_path / "one.exr"), read(tmp_path / "two.exr")
    # All of it: the ambient term stands for light that the painting and the room throw back.
    np.testing.assert_allclose(two, 2 * one, rtol=1e-5)


def test_a_far_position_is_a_direction_and_a_near_one_is_not(painting, tmp_path):
    direction = np.array([[0.6, 0.0, 0.8]])
    far = Lights(("far",), direction, position_mm=direction * 1e7)
    near = Lights(("near",), direction, position_mm=direction * 120.0)
    for lights in (Lights(("distant",), direction), far, near):
        impasto.render(painting, model=MODEL, lights=lights, out=tmp_path, raw=True)
    distant = read(tmp_path / "distant.exr")
    np.testing.assert_allclose(read(tmp_path / "far.exr"), distant, rtol=2e-3, atol=1e-4)
    close = read(tmp_path / "near.exr")
    width = close.shape[1]
    ratio = close / distant
    assert np.nanmedian(ratio[:, -width // 8 :]) > 1.5 > 0.9 > np.nanmedian(ratio[:, : width // 8])


def test_a_sweep_is_a_sequence_and_an_animation(painting, tmp_path):
    summary = impasto.render(painting, model=MODEL, arm=[-40, 0, 40], out=tmp_path)
    assert summary.lights == ("1", "2", "3")
    assert {path.name for path in tmp_path.iterdir()} == {
        *(f"{number}.{ending}" for number in (1, 2, 3) for ending in ("exr", "png")),
        f"{MODEL}.webp",
    }
    with Image.open(summary.animation) as animation:
        assert animation.n_frames == 3
        animation.seek(1)
        frame = np.asarray(animation.convert("RGB"), float)
    # WebP loses a little, but it is the second picture and none of the others.
    away = [np.abs(frame - read(tmp_path / f"{number}.png")).mean() for number in (1, 2, 3)]
    assert away[1] < 8
    assert away[1] < min(away[0], away[2]) / 2
    assert {path for path in summary.files} == set(tmp_path.iterdir())


def test_raw_writes_the_linear_files_only(painting, tmp_path):
    impasto.render(painting, model=MODEL, arm=[-40, 0, 40], out=tmp_path, raw=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1.exr", "2.exr", "3.exr"]


def test_bands_give_what_the_whole_picture_gives(painting, monkeypatch):
    fit, stack = open_fit(painting, MODEL), open_stack(painting)
    lights = stack.lights.select([0, 5])
    whole = [band.radiance for band in render_bands(fit, lights, stack.camera)]
    assert len(whole) == 1
    monkeypatch.setattr(sys.modules["impasto.render"], "_band_rows", lambda width, floats: 7)
    bands = [band.radiance for band in render_bands(fit, lights, stack.camera)]
    assert len(bands) > 3
    np.testing.assert_array_equal(np.concatenate(bands, axis=1), whole[0])


def test_bands_stay_within_their_memory_whatever_the_width():
    for width in (100, 4000, 20_000):
        rows = _band_rows(width, 90)
        assert rows * width * 90 * 4 <= 200e6 or rows == 32
        assert rows % 256 == 0 or rows < 256


def test_an_unidentified_highlight_is_rendered_matte_and_no_fit_is_missing(painting, monkeypatch, tmp_path):
    from impasto.store import Fit

    original = Fit.read

    def spoilt(self, rows, columns, names=None):
        maps = original(self, rows, columns, names)
        if rows.start == 0:
            maps["specular"][0, 0] = maps["c"][0, 0] = np.nan
            for name in maps:
                maps[name][0, 1] = np.nan
        return maps

    monkeypatch.setattr(Fit, "read", spoilt)
    summary = impasto.render(painting, model=MODEL, light=[(10, 0)], out=tmp_path)
    rendered = read(tmp_path / "1.exr")
    assert np.isfinite(rendered[0, 0]).all()
    assert np.isnan(rendered[0, 1]).all()
    assert (read(tmp_path / "1.png")[0, 1] == 0).all()
    assert (summary.missing_pixels, summary.matte_pixels) == (1, 1)


def test_what_cannot_be_rendered_is_told_before_anything_is_written(painting, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(OptionError, match="no light"):
        impasto.render(painting, model=MODEL, out=out)
    with pytest.raises(OptionError, match="below the surface"):
        impasto.render(painting, model=MODEL, light=[(120, 0)], out=out)
    with pytest.raises(OptionError, match="gloss"):
        impasto.render(painting, model="gloss", light=[(20, 0)], out=out)
    with pytest.raises(StoreError, match="no such fit"):
        impasto.render(painting, model="lambert", light=[(20, 0)], out=out)
    with pytest.raises(StoreError, match="no such store"):
        impasto.render(tmp_path / "absent.zarr", model=MODEL, light=[(20, 0)], out=out)
    for exposure in (0, 1e38, float("nan")):
        with pytest.raises(OptionError, match=r"exposure .* is not above 0, up to 1e\+09"):
            impasto.render(painting, model=MODEL, light=[(20, 0)], out=out, exposure=exposure)
    assert not out.exists()
    out.write_text("a file")
    with pytest.raises(OutputError, match="is a file"):
        impasto.render(painting, model=MODEL, light=[(20, 0)], out=out)


def test_a_rendering_for_another_display_carries_its_profile(painting, tmp_path):
    """Display P3 pictures, 16 bits in TIFF, and the same through the profile in a file."""
    profile = tmp_path / "monitor.icc"
    profile.write_bytes(display_p3().profile)
    for name, display in (("named", "display-p3"), ("filed", profile)):
        summary = impasto.render(
            painting, model=MODEL, light=[(40, 120)], out=tmp_path / name, display=display, tiff=True
        )
    assert summary.files[1].name == "1.tif"
    named = tifffile.imread(tmp_path / "named" / "1.tif")
    assert named.dtype == np.uint16
    linear = read(tmp_path / "named" / "1.exr")
    expected = Rendition(display_p3())(linear).drive
    np.testing.assert_allclose(named / 65535, expected, atol=1e-4)
    np.testing.assert_allclose(tifffile.imread(tmp_path / "filed" / "1.tif") / 65535, expected, atol=2e-3)
    for name in ("named", "filed"):
        with tifffile.TiffFile(tmp_path / name / "1.tif") as file:
            assert file.pages[0].iccprofile == profile.read_bytes()


def test_what_the_display_cannot_show_is_counted_and_masked(painting, tmp_path):
    summary = impasto.render(
        painting,
        model=MODEL,
        light=[(40, 120)],
        out=tmp_path,
        exposure=6.0,
        white_point="A",
        highlights="shoulder",
        gamut_mask=True,
    )
    white = xy_to_xyz(WHITE_POINTS["A"])
    shown = Rendition(exposure=6.0, white_xyz=white, highlights="shoulder")(read(tmp_path / "1.exr"))
    np.testing.assert_array_equal(read(tmp_path / "1.png"), np.rint(shown.drive * 255))
    mask = read(tmp_path / "1_gamut.png")[..., 0]
    np.testing.assert_array_equal(mask == 170, shown.too_bright)
    np.testing.assert_array_equal(mask == 255, shown.outside)
    assert summary.too_bright == shown.too_bright.mean() > 0
    assert summary.out_of_gamut == shown.outside.mean() > 0
    assert summary.white_xy == pytest.approx(WHITE_POINTS["A"])
    lines = "\n".join(render_lines(summary))
    assert "soft shoulder" in lines
    assert "outside the display's gamut" in lines


def test_the_light_can_be_the_white(painting, tmp_path):
    light = open_stack(painting).light_rgb
    given, named = (
        impasto.render(painting, model=MODEL, light=[(40, 0)], out=tmp_path, white_point=white)
        for white in ((0.3127, 0.329), "light")
    )
    xyz = rgb_to_xyz_matrix(SRGB) @ light
    assert named.white_xy == pytest.approx(tuple(xyz[:2] / xyz.sum()))
    assert given.white_xy == pytest.approx((0.3127, 0.329))


def test_display_options_that_cannot_be_used_are_told_together(painting, tmp_path):
    with pytest.raises(OptionError) as raised:
        impasto.render(
            painting,
            model=MODEL,
            light=[(20, 0)],
            out=tmp_path / "out",
            display="cinema",
            exposure=-1,
            white_point="moon",
            adaptation="cat02",
            highlights="bloom",
        )
    assert [problem.where for problem in raised.value.problems] == [
        "--exposure -1",
        "--adaptation cat02",
        "--highlights bloom",
        "--display cinema",
        "--white-point moon",
    ]
    assert not (tmp_path / "out").exists()
