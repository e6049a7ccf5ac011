"""The residual term: closed forms against their definitions, fading, and what a fit with it gives."""

import shutil

import numpy as np
import OpenImageIO as oiio
import pytest
import zarr

import impasto
from impasto.errors import OptionError
from impasto.fit import FitOptions
from impasto.fit.light_process import LightProcess, compress, hull_of
from impasto.fit.remainder import product
from impasto.fit.strength import find_strength
from impasto.geometry import Lights, arm_direction, dome_direction
from impasto.residual import ZERO, ResidualTerm, decode, encode, kernel
from impasto.store import open_fit, open_stack

RNG = np.random.default_rng(4)
MODEL = "torrance-sparrow"


@pytest.mark.parametrize("shape", [(5000, 200, 18), (7, 3, 2), (3, 2000, 200), (0, 4, 2)])
def test_a_product_in_pieces_is_the_product(shape):
    pixels, count, components = shape
    samples = RNG.normal(size=(pixels, count)).astype(np.float32)
    table = RNG.normal(size=(components, count)).astype(np.float32).T
    np.testing.assert_allclose(product(samples, table), samples @ table, rtol=1e-4, atol=1e-3)


def lights(count=24, zenith_deg=70):
    zenith = np.arccos(RNG.uniform(np.cos(np.radians(zenith_deg)), 1, count))
    return dome_direction(zenith, RNG.uniform(0, 2 * np.pi, count))


def test_the_encoding_is_undone():
    radiance = np.array([0.0, 1e-4, 0.3, 1.0, 80.0], np.float32)
    np.testing.assert_allclose(decode(encode(radiance, 0.003), 0.003), radiance, rtol=1e-5, atol=1e-6)
    assert encode([-1.0, np.nan], 0.003) == pytest.approx(0.0, abs=1e-8)


def test_left_out_errors_are_those_of_processes_that_have_not_seen_the_light():
    direction, samples = lights(), RNG.normal(size=(24, 50))
    process = LightProcess(direction, 0.4, 0.1)
    closed = process.left_out(samples @ samples.T / 50)
    for left in range(24):
        rest = np.delete(np.arange(24), left)
        others = LightProcess(direction[rest], 0.4, 0.1)
        row = kernel(direction[left : left + 1], direction[rest], 0.4)
        predicted = row @ np.linalg.solve(others.gram(), samples[rest])
        assert closed[left] == pytest.approx(np.square(predicted - samples[left]).mean(), rel=1e-8)


def test_components_of_full_number_are_the_process_itself():
    direction = lights(10)
    samples = RNG.normal(size=(300, 10, 2)) * [1.0, 0.3]
    flat = samples.reshape(300, -1)
    moments = (flat.T @ flat / 300).reshape(10, 2, 10, 2)
    process = LightProcess(direction, 0.7, 0.2)
    hull = hull_of(direction)
    whole = compress(process, hull, moments, 20)
    assert whole.kept == pytest.approx(1.0)
    new = direction[:3] + 0.05
    new /= np.linalg.norm(new, axis=1, keepdims=True)
    row = kernel(new, direction, 0.7)
    exact = np.einsum("lm,mn,pnc->plc", row, np.linalg.inv(process.gram()), samples)
    coefficients = np.einsum("klc,plc->pk", whole.encoder, samples)
    basis = np.einsum("kcn,ln->lkc", whole.weights, row)
    np.testing.assert_allclose(np.einsum("pk,lkc->plc", coefficients, basis), exact, atol=1e-6)
    few = compress(process, hull, moments, 4)
    assert 0.3 < few.kept < 1.0
    assert len(few.encoder) == 4


@pytest.mark.parametrize("planar", [False, True])
def test_the_hull_holds_its_lights_and_nothing_far_from_them(planar):
    direction = arm_direction(np.radians([-60, -20, 10, 55])) if planar else lights(30, 50)
    hull = hull_of(direction)
    assert (direction @ hull.T > -1e-6).all()
    away = dome_direction(np.radians([80.0, 80.0]), np.radians([90.0, 200.0]))
    assert (away @ hull.T).min(axis=1).max() < -0.1
    np.testing.assert_allclose(np.linalg.norm(hull, axis=1), 1.0, atol=1e-6)


def test_the_term_fades_to_nothing_outside_the_hull():
    direction = lights(30, 40)
    term = ResidualTerm(
        direction, 0.5, RNG.normal(size=(4, 3, 30)), np.ones(4), 0.01, hull_of(direction), 0.17
    )
    assert term.share(direction) == pytest.approx(1.0)
    low = dome_direction(np.radians([75.0]), [1.0])
    assert term.share(low) == 0.0
    radiance = np.full((1, 5, 3), 0.3, np.float32)
    codes = np.full((5, 4), ZERO + 1, np.uint16)
    term.add(radiance, codes, low, np.ones((1, 1, 3), np.float32))
    assert (radiance == np.float32(0.3)).all()
    term.add(radiance, codes, direction[:1], np.ones((1, 1, 3), np.float32))
    assert (radiance != np.float32(0.3)).all()


def test_added_as_docs_store_md_says():
    direction = lights(12)
    weights, step = RNG.normal(size=(3, 3, 12)), np.array([0.01, 0.02, 0.005])
    strength = RNG.normal(0.0, 0.2, size=(3, 12))
    term = ResidualTerm(
        direction,
        0.4,
        weights,
        step,
        0.004,
        hull_of(direction),
        0.17,
        strength_length=0.6,
        strength_weights=strength,
    )
    codes = RNG.integers(ZERO - 9, ZERO + 9, size=(7, 3)).astype(np.uint16)
    light = direction[:2]
    irradiance = np.array([[[1.0, 1.2, 0.8]], [[2.0, 2.0, 2.0]]], np.float32)
    model = RNG.uniform(0.0, 1.0, size=(2, 7, 3)).astype(np.float32)
    model[0, 3] = np.nan
    got = model.copy()
    term.add(got, codes, light, irradiance)
    for place in np.ndindex(2, 7, 3):
        which, pixel, channel = place
        near = np.exp(-np.square(light[which] - direction).sum(axis=1) / (2 * 0.4**2))
        value = np.sqrt(model[place] / irradiance[which, 0, channel] + 0.004) - np.sqrt(0.004)
        value += ((codes[pixel].astype(float) - ZERO) * step) @ (weights[:, channel] @ near)
        expected = ((max(value, 0) + np.sqrt(0.004)) ** 2 - 0.004) * irradiance[which, 0, channel]
        around = np.exp(-np.square(light[which] - direction).sum(axis=1) / (2 * 0.6**2))
        expected *= np.exp(strength[channel] @ around)
        np.testing.assert_allclose(got[place], expected, rtol=2e-4, atol=1e-5)


def test_strengths_that_are_smooth_over_direction_are_told_to_lights_between():
    direction, between = lights(60), lights(37, zenith_deg=55)

    def smooth(at):
        return 0.2 * np.sin(4.0 * at[:, :1] + [0.0, 0.3, 0.6]) * at[:, 1:2]

    told = find_strength(direction, smooth(direction) + RNG.normal(0.0, 0.01, (60, 1)))
    term = ResidualTerm.of({"residual": {**plain_term(direction), "strength": told}})
    found = np.log(term.strength(between))
    assert np.sqrt(np.square(found - smooth(between)).mean()) < 0.3 * smooth(between).std()
    far = dome_direction(np.radians([88.0]), [1.0])
    assert term.strength(far) == pytest.approx(1.0)


def test_strengths_that_have_nothing_to_do_with_direction_are_not_told():
    rng = np.random.default_rng(11)
    draws = [find_strength(lights(40), rng.normal(0.0, 0.1, (40, 1)) + np.zeros(3)) for _ in range(50)]
    assert sum(told is not None for told in draws) <= 2


def test_even_lights_are_as_bright_as_stated():
    direction = lights(30)
    strength = {"length": 0.4, "weights": RNG.normal(0.0, 0.1, (3, 30)).tolist()}
    term = ResidualTerm.of({"residual": {**plain_term(direction), "strength": strength}})
    stated = Lights(("a", "b"), direction[:2], intensity=np.array([[1.0], [2.0]]))
    model = np.array([0.3, 0.6], np.float32)[:, None, None] * np.ones((2, 4, 3), np.float32)
    codes = np.full((4, 1), ZERO, np.uint16)
    followed, even = model.copy(), model.copy()
    term.add(followed, codes, stated.direction, stated.irradiance())
    assert np.abs(followed / model - 1.0).max() > 0.05
    found = term.even(stated)
    even *= (found.intensity / stated.intensity)[:, None].astype(np.float32)
    term.add(even, codes, found.direction, found.irradiance())
    np.testing.assert_allclose(even, model, rtol=1e-4)


def plain_term(direction):
    """Return the attribute of a term that adds nothing."""
    return {
        "components": 1,
        "step": [1.0],
        "toe": 0.01,
        "direction": direction.tolist(),
        "length": 0.3,
        "weights": np.zeros((1, 3, len(direction))).tolist(),
        "hull": hull_of(direction).tolist(),
        "fade": 0.17,
    }


def fitted(painting, tmp_path, **options):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    shutil.rmtree(store / "fits")
    shutil.rmtree(store / "pyramids", ignore_errors=True)
    impasto.fit(store, models=[MODEL], options=FitOptions(**options))
    return store


def test_a_fit_with_it_renders_closer_and_keeps_the_maps(painting, tmp_path):
    store = fitted(painting, tmp_path, residual=True, residual_components=6, self_calibrate=False)
    fit, stack = open_fit(store, MODEL), open_stack(store)
    height, width = fit.shape
    rows, columns = slice(0, height), slice(0, width)
    plain = open_fit(painting, MODEL).read(rows, columns, ["normal", "diffuse"])
    maps = fit.read(rows, columns)
    np.testing.assert_array_equal(maps["normal"], plain["normal"])
    assert maps["residual"].dtype == np.uint16
    from impasto.render import render_bands

    photographs = stack.radiance(rows, columns)
    errors = []
    for residual in (False, True):
        (band,) = render_bands(fit, stack.lights, stack.camera, residual=residual)
        difference = encode(band.radiance, 0.01) - encode(photographs, 0.01)
        errors.append(np.nanmean(np.square(difference[photographs < stack.clip_level])))
    assert errors[1] < 0.8 * errors[0]


def test_renderings_of_even_light_do_not_follow_the_strengths(painting, tmp_path):
    store = fitted(painting, tmp_path, residual=True, residual_components=2, self_calibrate=False)
    group = zarr.open_group(store / "fits" / MODEL, mode="r+")
    found = dict(group.attrs["residual"])
    channels, count = len(found["weights"][0]), len(found["direction"])
    found["strength"] = {"length": 0.4, "weights": np.full((channels, count), 0.05).tolist()}
    group.attrs["residual"] = found
    light = (20.0, 60.0)
    images = []
    for even in (False, True):
        out = tmp_path / str(even)
        impasto.render(store, model=MODEL, light=[light], out=out, raw=True, even_light=even)
        images.append(oiio.ImageInput.open(str(out / "1.exr")).read_image("float"))
    strength = ResidualTerm.of({"residual": found}).strength(dome_direction(*np.radians([light]).T))
    assert strength.min() > 1.05
    np.testing.assert_allclose(images[0], images[1] * strength[0], rtol=1e-3, atol=1e-5)


def test_the_papers_procedure_has_none(painting):
    with pytest.raises(OptionError, match="residual"):
        impasto.fit(painting, models=[MODEL], procedure="paper", options=FitOptions(residual=True))


def test_a_number_of_components_is_checked(painting):
    with pytest.raises(OptionError, match="expected 1 to"):
        impasto.fit(painting, models=[MODEL], options=FitOptions(residual_components=0))


def test_strengths_are_found_that_were_not_stated(painting, tmp_path):
    """The same photographs, with light 3 said to be a fifth weaker than it was."""
    import json

    store = fitted(painting, tmp_path, self_calibrate=True)
    document = store / "stack" / "light_intensity"
    before = np.array(open_fit(store, MODEL).attributes["self_calibration"]["gain"])
    stack = open_stack(store)
    assert json.loads((document / "zarr.json").read_text())["shape"][0] == len(stack.lights)

    array = zarr.open_array(document, mode="r+")
    stated = array[...]
    stated[3] *= 0.8
    array[...] = stated
    impasto.fit(store, models=[MODEL], options=FitOptions(self_calibrate=True), overwrite=True)
    after = np.array(open_fit(store, MODEL).attributes["self_calibration"]["gain"])
    ratio = (after / before).mean(axis=1)
    others = np.delete(ratio, 3)
    assert ratio[3] / np.median(others) == pytest.approx(1.25, rel=0.02)
    np.testing.assert_allclose(others / np.median(others), 1.0, atol=0.04)
