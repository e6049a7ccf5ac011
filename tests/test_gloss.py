"""The virtual glossmeter against figures computed elsewhere, and what it says of a painting."""

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

import impasto
from impasto.errors import OptionError
from impasto.evaluate.gloss import PixelGloss, region_gloss
from impasto.evaluate.glossmeter import GLOSSMETERS
from impasto.models import parse_model
from impasto.pixels import Pixels

OPTICS = {"index_of_refraction": 1.5, "fresnel": "facet"}


def flat_pixels(model, shape, *, kappa=1.0, albedo=0.0, count=1):
    spec = parse_model(model)
    return Pixels(
        attributes={"model": model, "light_rgb": [1.0, 1.0, 1.0], **OPTICS},
        size=(1, count),
        row=np.zeros(count, int),
        column=np.arange(count),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        diffuse=np.full((count, 3), albedo),
        specular=np.full((count, spec.lobes), kappa / (4 * shape**2)),
        shape=np.full((count, 1), shape),
        ambient=None,
        view_tilt=None,
    )


@pytest.mark.parametrize(("meter", "expected"), list(zip(GLOSSMETERS, [82.05, 89.14, 98.97], strict=True)))
def test_a_mirror_of_index_1_5_reads_what_fresnel_says(meter, expected):
    assert 100 * meter.mirror(1.5) / meter.glass == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("meter", "expected", "tolerance"),
    list(zip(GLOSSMETERS, [1.203, 2.494, 0.033], [5e-3, 5e-3, 1e-2], strict=True)),
)
def test_a_white_diffuser_reads_the_standard_s_correction(meter, expected, tolerance):
    assert meter.measure(lambda light, view: light[:, 2]) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize(
    ("model", "expected"),
    [("torrance-sparrow", [25.1, 66.0, 70.0]), ("torrance-sparrow-smith", [25.1, 66.0, 68.6])],
)
def test_a_smooth_interface_reads_what_was_computed_elsewhere(model, expected):
    pixels = flat_pixels(model, 0.0172)
    readings = [region_gloss(pixels, meter) for meter in GLOSSMETERS]
    assert (np.abs(np.divide(readings, expected) - 1) < [5e-3, 5e-3, 1e-2]).all()


@pytest.mark.parametrize("c", [0.0172, 0.05, 0.17, 0.6])
@pytest.mark.parametrize("meter", GLOSSMETERS)
def test_the_table_for_single_pixels_agrees_with_the_integral(meter, c):
    pixels = flat_pixels("torrance-sparrow", c, albedo=0.3)
    table = PixelGloss(pixels.model, OPTICS, meter)
    np.testing.assert_allclose(table(pixels), region_gloss(pixels, meter), rtol=1e-2)


def test_tilted_pixels_make_a_surface_less_glossy_than_each_is():
    """And the meter rests on their mean plane, however that lies in the picture."""
    pixels = flat_pixels("torrance-sparrow", 0.03, count=2000)
    tilt = np.random.default_rng(1).normal(0, 0.05, (2000, 2))
    normal = np.column_stack([tilt, np.ones(2000)])
    rough = Pixels(**{**vars(pixels), "normal": normal / np.linalg.norm(normal, axis=1, keepdims=True)})
    leaning = np.array([[0.95, 0, 0.3122], [0, 1, 0], [-0.3122, 0, 0.95]])
    leant = Pixels(**{**vars(rough), "normal": rough.normal @ leaning})
    meter = GLOSSMETERS[0]
    flat = region_gloss(pixels, meter)
    assert region_gloss(rough, meter) < 0.5 * flat
    assert region_gloss(leant, meter) == pytest.approx(region_gloss(rough, meter), rel=0.02)


def test_drawn_regions_and_pixels_are_read_and_mapped(painting, tmp_path):
    _, height, width, _ = impasto.open(painting)["stack"]["radiance"].shape
    drawn = np.zeros((height, width, 3), np.uint8)
    drawn[:, : width // 2, 0] = 255
    drawn[: height // 2, width // 2 :] = 7
    tifffile.imwrite(tmp_path / "drawn.tif", drawn, photometric="rgb")
    summary = impasto.gloss(
        painting,
        model="torrance-sparrow",
        regions=tmp_path / "drawn.tif",
        pixels=[(3, 5)],
        out=tmp_path / "maps",
    )
    assert [region.name for region in summary.regions] == ["whole painting", "7", "#ff0000", "pixel 3,5"]
    whole, corner, half, pixel = summary.regions
    assert whole.pixels + whole.unknown_pixels == height * width
    assert half.pixels + half.unknown_pixels == height * (width // 2)
    assert corner.pixels + corner.unknown_pixels == (height // 2) * (width - width // 2)
    assert not summary.absolute
    assert summary.extrapolated_deg == (60.0, 85.0)
    for reading, angle in zip(pixel.readings, (20, 60, 85), strict=True):
        image = oiio.ImageInput.open(str(tmp_path / "maps" / f"gloss_{angle}.exr")).read_image("float")
        assert image.reshape(height, width)[5, 3] == pytest.approx(reading.gloss, rel=1e-6)
        assert (tmp_path / "maps" / f"gloss_{angle}.png").is_file()


def test_a_matte_model_reads_as_a_diffuser():
    pixels = flat_pixels("lambert", 1.0, albedo=0.5)
    pixels = Pixels(**{**vars(pixels), "shape": np.empty((1, 0)), "specular": np.empty((1, 0))})
    for meter in GLOSSMETERS:
        expected = 0.5 * meter.measure(lambda light, view: light[:, 2])
        assert PixelGloss(pixels.model, OPTICS, meter)(pixels)[0] == pytest.approx(expected, rel=1e-3)
        assert region_gloss(pixels, meter) == pytest.approx(expected, rel=1e-3)


def test_all_pixels_outside_are_named_at_once(painting):
    with pytest.raises(OptionError) as error:
        impasto.gloss(painting, model="phong", pixels=[(0, 0), (-1, 2), (5, 10_000)])
    assert [problem.where for problem in error.value.problems] == ["--pixel -1,2", "--pixel 5,10000"]


@pytest.mark.parametrize(
    ("write", "what"),
    [
        (lambda path: tifffile.imwrite(path, np.ones((7, 9), np.uint8)), "9 x 7"),
        (lambda path: path.write_bytes(b"no image"), "not a readable TIFF"),
        (lambda path: None, "does not exist"),
    ],
)
def test_regions_that_do_not_fit_are_refused(painting, tmp_path, write, what):
    write(tmp_path / "drawn.tif")
    with pytest.raises(OptionError) as error:
        impasto.gloss(painting, model="phong", regions=tmp_path / "drawn.tif")
    assert what in str(error.value)
    assert "drawn.tif" in error.value.problems[0].where


def test_a_photograph_is_no_drawing(painting, tmp_path):
    _, height, width, _ = impasto.open(painting)["stack"]["radiance"].shape
    noise = np.random.default_rng(0).integers(0, 255, (height, width, 3)).astype(np.uint8)
    tifffile.imwrite(tmp_path / "drawn.tif", noise, photometric="rgb")
    with pytest.raises(OptionError, match="colours"):
        impasto.gloss(painting, model="phong", regions=tmp_path / "drawn.tif")
