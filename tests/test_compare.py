"""The comparison of fitted models: ratios, errors by kind of light, and the choice per pixel."""

import numpy as np
import pytest
import tifffile

import impasto
from impasto.errors import OptionError
from impasto.pixels import luminance, read_pixels, render_pixels
from impasto.store import open_fit, open_stack


@pytest.fixture(scope="module")
def compared(painting, tmp_path_factory):
    out = tmp_path_factory.mktemp("compare")
    return impasto.compare(painting, models=["torrance-sparrow", "phong"], out=out)


def whole_pixels(painting, model):
    stack = open_stack(painting)
    _, height, width, _ = stack.shape
    return stack, read_pixels(open_fit(painting, model), slice(0, height), slice(0, width))


def test_errors_are_those_of_the_renderings(painting, compared):
    stack, pixels = whole_pixels(painting, "phong")
    _, other = whole_pixels(painting, "torrance-sparrow")
    whole = pixels.whole & other.whole
    _, height, width, channels = stack.shape
    radiance = stack.radiance(slice(0, height), slice(0, width)).reshape(len(stack.lights), -1, channels)
    radiance = radiance[:, whole].astype(float)
    usable = radiance < stack.clip_level
    error = render_pixels(pixels.select(whole), stack.lights, stack.camera) - radiance
    intensity = stack.lights.intensity[:, None]
    rms = np.sqrt(np.mean((error / intensity)[usable] ** 2)) / np.mean((radiance / intensity)[usable])
    region = compared.regions[0]
    assert region.pixels == whole.sum()
    assert region.pixels + region.unknown_pixels == height * width
    phong = region.models[1]
    assert phong.rms == pytest.approx(rms, rel=1e-3)
    assert phong.unknowns == 2 + 1 + 1 + 3 + 3
    assert min(phong.rms_highlight, phong.rms_elsewhere) < phong.rms


def test_the_ratio_is_the_mean_of_the_pixels_ratios(painting, compared):
    _, pixels = whole_pixels(painting, "torrance-sparrow")
    pixels = pixels.select(pixels.whole)
    ratio = pixels.specular[:, 0] / luminance(pixels.diffuse)
    told = compared.regions[0].models[0].ratio
    # Of 20,000 pixels, which are most of this painting's.
    assert told.mean == pytest.approx(ratio.mean(), rel=0.02)
    assert told.low <= told.median <= told.high


def test_a_model_that_is_named_twice_counts_once(painting, compared):
    summary = impasto.compare(painting, models=["torrance-sparrow", "phong", "phong-ambient"])
    assert summary.regions == compared.regions


def test_pixels_choose_one_model_each(painting, compared):
    assert sum(model.chosen for model in compared.regions[0].models) == pytest.approx(1)
    choice = tifffile.imread(compared.files[0])
    shares = [np.mean(choice[choice > 0] == number) for number in (1, 2)]
    assert shares == pytest.approx([model.chosen for model in compared.regions[0].models])
    assert compared.files[1].is_file()


def test_an_unneeded_ambient_term_is_not_chosen(tmp_path):
    """The simulated paint has none, so its three unknowns do not pay for themselves."""
    impasto.simulate(tmp_path / "photos", preset="swatches", dome=True, lights=24, size=(48, 32))
    impasto.stack(tmp_path / "photos", tmp_path / "p.zarr")
    models = ["torrance-sparrow", "torrance-sparrow-ambient"]
    impasto.fit(tmp_path / "p.zarr", models=models)
    with_out, _ = impasto.compare(tmp_path / "p.zarr", models=models).regions[0].models
    assert with_out.chosen > 0.7


def test_regions_divide_the_painting(painting, tmp_path):
    _, height, width, _ = open_stack(painting).shape
    drawn = np.zeros((height, width), np.uint8)
    drawn[:, : width // 3], drawn[:, width // 3 :] = 1, 2
    tifffile.imwrite(tmp_path / "drawn.tif", drawn)
    whole, left, right = impasto.compare(painting, regions=tmp_path / "drawn.tif").regions
    assert (left.name, right.name) == ("1", "2")
    assert left.pixels + right.pixels == whole.pixels


def test_a_model_that_is_not_there_is_refused(painting):
    with pytest.raises(OptionError, match="no reflectance model"):
        impasto.compare(painting, models=["gloss"])
