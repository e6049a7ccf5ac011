"""Simulated paintings: relief and normals that fit, the same design at every size, the paints promised."""

import numpy as np
import pytest

from impasto.capture.simulate.painting.relief import Grid, normals, smooth_noise, weave
from impasto.capture.simulate.presets import LUMINANCE, PRESETS, SAMPLES, Order, paint_sample


def order(side=128, width=None, **changed):
    options = {
        "seed": 0,
        "model": "torrance-sparrow",
        "measured": None,
        "mm_per_px": 0.5,
        "relief_scale": 1.0,
    }
    return Order(Grid(side, width or side), **(options | changed))


@pytest.fixture(scope="module")
def still_life():
    return PRESETS["still-life"](order(160))


def tilt_deg(surface):
    return np.degrees(np.arccos(surface.normal[..., 2]))


def test_normals_of_a_plane_that_rises_to_the_right_and_up():
    row, column = np.mgrid[0:6, 0:8]
    normal = normals(0.3 * 0.5 * column - 0.1 * 0.5 * row, mm_per_px=0.5)
    expected = np.array([-0.3, -0.1, 1.0]) / np.sqrt(1.1)
    np.testing.assert_allclose(normal, np.broadcast_to(expected, (6, 8, 3)), atol=1e-6)


def test_the_still_lifes_normals_belong_to_its_heights(still_life):
    np.testing.assert_array_equal(still_life.normal, normals(still_life.height_mm, still_life.mm_per_px))
    np.testing.assert_allclose(np.linalg.norm(still_life.normal, axis=-1), 1, atol=1e-6)


def test_the_still_life_has_the_slopes_of_heavy_brushwork(still_life):
    median, steep = np.percentile(tilt_deg(still_life), (50, 99))
    assert 3 < median < 12
    assert 12 < steep < 60


def test_the_still_life_is_made_of_its_paints(still_life):
    names = [entry.name for entry in still_life.materials]
    share = np.bincount(still_life.material.ravel(), minlength=len(names)) / still_life.material.size
    shares = dict(zip(names, share, strict=True))
    for paint, least in {
        "lead white": 0.08,
        "burnt sienna": 0.08,
        "ultramarine": 0.05,
        "vermilion": 0.03,
        "shell gold": 0.08,
        "retouching": 0.002,
    }.items():
        assert shares[paint] > least
    assert (still_life.diffuse >= 0).all()
    assert (still_life.diffuse <= 1).all()


def test_the_varnish_varies_and_the_retouching_is_matte(still_life):
    retouched = still_life.material == [entry.name for entry in still_life.materials].index("retouching")
    assert np.median(still_life.alpha[retouched]) > 2 * np.median(still_life.alpha[~retouched])
    assert np.percentile(still_life.alpha, 95) > 2 * np.percentile(still_life.alpha, 5)


def test_the_design_does_not_depend_on_the_number_of_pixels(still_life):
    """Twice the pixels, averaged two by two, show the same painting."""
    fine = PRESETS["still-life"](order(320))
    coarse = fine.diffuse.reshape(160, 2, 160, 2, 3).mean(axis=(1, 3))
    assert np.corrcoef(coarse.ravel(), still_life.diffuse.ravel())[0, 1] > 0.95
    heights = fine.height_mm.reshape(160, 2, 160, 2).mean(axis=(1, 3))
    assert np.corrcoef(heights.ravel(), still_life.height_mm.ravel())[0, 1] > 0.9


def test_a_wide_format_shows_more_wall_and_table_around_the_same_scene(still_life):
    wide = PRESETS["still-life"](order(160, 240))
    assert wide.size == (160, 240)
    jug = [entry.name for entry in wide.materials].index("ultramarine")
    share = np.mean(wide.material == jug) * 1.5
    assert share == pytest.approx(np.mean(still_life.material == jug), rel=0.2)


def test_the_seed_moves_the_strokes():
    one, other = (PRESETS["still-life"](order(64, seed=seed)) for seed in (0, 1))
    again = PRESETS["still-life"](order(64, seed=0))
    np.testing.assert_array_equal(one.height_mm, again.height_mm)
    assert not np.array_equal(one.height_mm, other.height_mm)


def test_pixel_size_scales_heights_and_relief_scale_scales_slopes():
    plain, large, flat = (
        PRESETS["swatches"](order(64, **changed))
        for changed in ({}, {"mm_per_px": 1.0}, {"relief_scale": 0.0})
    )
    np.testing.assert_allclose(large.height_mm, 2 * plain.height_mm, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(large.normal, plain.normal, atol=1e-5)
    assert (flat.normal == [0, 0, 1]).all()


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_have_the_papers_ratio_of_specular_to_diffuse(name):
    """[Chen2007]_, Table II, Torrance-Sparrow."""
    ratios = dict(zip("abcdefgh", (5793.6, 3.8, 1712.9, 17.8, 142.6, 4.3, 1752.1, 560.9), strict=True))
    surface = paint_sample(order(64, model="torrance-sparrow-smith"), SAMPLES[name])
    ratio = np.median(surface.specular / (surface.diffuse @ LUMINANCE))
    assert ratio == pytest.approx(ratios[name], rel=0.1)
    assert surface.diffuse.max() < 1


def test_glossier_levels_have_narrower_lobes():
    alpha = {
        level: [s.alpha for s in SAMPLES.values() if s.gloss == level] for level in ("high", "medium", "low")
    }
    assert max(alpha["high"]) < min(alpha["medium"])
    assert max(alpha["medium"]) < min(alpha["low"])
    assert [len(alpha[level]) for level in alpha] == [2, 3, 3]


def test_swatches_span_the_range_of_c():
    surface = PRESETS["swatches"](order(60))
    np.testing.assert_allclose(np.unique(surface.shape), np.geomspace(0.02, 0.9, 10), rtol=1e-6)
    assert len(np.unique(surface.material)) == 6


def test_mixed_models_give_each_material_its_own_shape():
    surface = PRESETS["swatches"](order(60, model="mixed"))
    models = [entry.model for entry in surface.materials]
    assert set(models) == {"phong", "torrance-sparrow", "torrance-sparrow-gaussian", "torrance-sparrow-smith"}
    phong = surface.material == models.index("phong")
    np.testing.assert_allclose(surface.shape[phong], surface.alpha[phong] ** -2.0, rtol=1e-5)


def test_a_weave_too_fine_for_the_pixels_fades_instead_of_aliasing():
    rng = np.random.default_rng(0)
    assert weave(Grid(400, 400), rng).std() > 0.01
    assert weave(Grid(48, 48), rng).std() == 0


def test_smooth_noise_has_unit_variance_and_its_scale():
    rng = np.random.default_rng(0)
    noise = np.array([smooth_noise(Grid(200, 200), 5.0, rng) for _ in range(4)])
    assert noise.std() == pytest.approx(1, abs=0.1)
    near = np.mean(noise[:, :, :-1] * noise[:, :, 1:])
    far = np.mean(noise[:, :, :-60] * noise[:, :, 60:])  # 30 mm apart
    assert near > 0.9
    assert abs(far) < 0.1
