"""Gonio curves: what is measured, the models' parts, and the errors by band."""

import csv

import numpy as np
import pytest
import tifffile

import impasto
from impasto.errors import OptionError
from impasto.evaluate.curves import half_width_deg
from impasto.pixels import luminance, read_pixels
from impasto.store import open_fit, open_stack


def test_a_pixel_s_curve_is_its_photographs_and_its_renderings(painting, tmp_path):
    summary = impasto.gonio(painting, out=tmp_path, models=["torrance-sparrow", "phong"], pixels=[(7, 4)])
    stack = open_stack(painting)
    (curve,) = summary.curves
    measured = stack.radiance(slice(4, 5), slice(7, 8))[:, 0, 0] / stack.lights.intensity
    seen = curve.clipped == 0
    np.testing.assert_allclose(curve.measured[seen], measured[seen], rtol=1e-6)
    assert list(curve.models) == ["torrance-sparrow", "phong"]
    for model in curve.models.values():
        total = model.diffuse + model.specular
        assert (model.specular >= -1e-6).all()
        error = luminance(total) - luminance(curve.measured)
        rest = seen & (curve.band == "rest")
        expected = error[rest].sum() / luminance(curve.measured)[rest].sum()
        assert model.signed_error["rest"] == pytest.approx(expected, rel=1e-6)
    with (tmp_path / "pixel-7-4.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["light"] for row in rows] == list(stack.lights.names)
    assert float(rows[3]["phong_diffuse_g"]) == pytest.approx(curve.models["phong"].diffuse[3, 1], rel=1e-4)
    assert (tmp_path / "pixel-7-4.png").is_file()


def test_a_region_s_curve_is_the_mean_of_its_pixels(painting, tmp_path):
    stack = open_stack(painting)
    _, height, width, _ = stack.shape
    drawn = np.zeros((height, width), np.uint8)
    drawn[2:5, 3:9] = 1
    tifffile.imwrite(tmp_path / "drawn.tif", drawn)
    model = "torrance-sparrow"
    region = impasto.gonio(painting, out=tmp_path, models=[model], regions=tmp_path / "drawn.tif").curves[0]
    pixels = read_pixels(open_fit(painting, model), slice(2, 5), slice(3, 9))
    assert region.pixels == pixels.whole.sum()
    measured = stack.radiance(slice(2, 5), slice(3, 9)).reshape(len(stack.lights), -1, 3)[:, pixels.whole]
    usable = (measured < stack.clip_level).all(axis=-1)
    light = int(np.argmax(usable.all(axis=1)))
    mean = measured[light].mean(axis=0) / stack.lights.intensity[light]
    np.testing.assert_allclose(region.measured[light], mean, rtol=1e-5)


def test_telling_pixels_differ_in_their_highlights(painting, tmp_path):
    summary = impasto.gonio(painting, out=tmp_path)
    assert [curve.name for curve in summary.curves] == [
        "high highlight",
        "typical highlight",
        "low highlight",
        "poorly described",
    ]
    assert all(file.is_file() for file in summary.files)


def test_the_half_width_is_that_of_the_lobe(painting):
    """Near the normal a Trowbridge-Reitz lobe halves where tan² δ = c² (√2 − 1), δ the facet's angle."""
    stack, c = open_stack(painting), 0.05
    pixels = read_pixels(open_fit(painting, "torrance-sparrow"), slice(0, 1), slice(0, 1))
    width = half_width_deg(pixels, np.array([c]), np.array([0.0, 0.0, 1.0]), stack.camera)
    assert width == pytest.approx(2 * np.degrees(np.arctan(c * np.sqrt(np.sqrt(2) - 1))), abs=0.1)


def test_what_cannot_be_shown_is_refused(painting, tmp_path):
    with pytest.raises(OptionError, match="no reflectance model"):
        impasto.gonio(painting, out=tmp_path, models=["gloss"])
    with pytest.raises(OptionError, match="outside"):
        impasto.gonio(painting, out=tmp_path, pixels=[(-1, 0)])


def test_a_place_without_a_fit_is_refused(capture, tmp_path):
    """All samples count as shadowed, so too few lights are left for any pixel."""
    few = tmp_path / "few.zarr"
    impasto.stack(capture, few)
    impasto.fit(few, models=["torrance-sparrow"], options=impasto.FitOptions(shadow_level=100.0))
    with pytest.raises(OptionError, match="no models to show"):
        impasto.gonio(few, out=tmp_path / "out", pixels=[(3, 5)])
    with pytest.raises(OptionError, match="no pixel has a highlight"):
        impasto.gonio(few, out=tmp_path / "out")
    with pytest.raises(OptionError, match="no pixel has all parameters"):
        impasto.compare(few)
    with pytest.raises(OptionError, match="no gloss to predict"):
        impasto.gloss(few, model="torrance-sparrow")
