"""The residual term: closed forms against their definitions, fading, and what a fit with it gives."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import OpenImageIO as oiio
import pytest
import zarr

import impasto
from impasto.direction_table import look_up, node_directions
from impasto.errors import OptionError
from impasto.fit import FitOptions
from impasto.fit.light_process import LightProcess, compress, hull_of
from impasto.fit.notes import residual_notes
from impasto.fit.remainder import left_over
from impasto.fit.strength import find_strength
from impasto.geometry import Camera, Lights, arm_direction, dome_direction, zenith_azimuth
from impasto.light_strength import scale_lights
from impasto.pixels import Pixels, near_positions_mm, render_pixels
from impasto.residual import ZERO, ResidualTerm, encode, kernel, told
from impasto.store import open_fit, open_stack
from store_files import write_capture

RNG = np.random.default_rng(4)
MODEL = "torrance-sparrow"
OPTICS = {"index_of_refraction": 1.5, "fresnel": "facet"}
CAMERA = Camera(np.array([0.0, 0.0, 1.0]))


def lights(count=24, zenith_deg=70, rng=RNG):
    zenith = np.arccos(rng.uniform(np.cos(np.radians(zenith_deg)), 1, count))
    return dome_direction(zenith, rng.uniform(0, 2 * np.pi, count))


def test_a_published_store_has_the_term_in_a_table():
    pixels = flat(np.full((5, 3), 0.3))
    term = plain_term(lights(20)) | {"weights": RNG.normal(size=(1, 3, 20)).tolist()}
    table = np.linspace(-0.03, 0.03, 256)
    codes = RNG.integers(0, 256, size=(5, 1))
    published = replace(pixels, residual=codes.astype(np.uint8))
    got = rendered(published, term | {"table": table.tolist()})
    steps = np.rint(table[codes] / 1e-6) + ZERO
    expected = rendered(replace(pixels, residual=steps.astype(np.uint16)), term | {"step": [1e-6]})
    np.testing.assert_allclose(got, expected, rtol=1e-4)
    assert np.ptp(got[0], axis=0).min() > 0.01


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


def flat(diffuse, codes=None, **columns):
    """Return matte pixels (P, C) that face the camera."""
    count = len(diffuse)
    none = np.empty((count, 0), np.float32)
    settings = {
        "attributes": {"model": "lambert", "light_rgb": [1.0] * diffuse.shape[1]} | OPTICS,
        "size": (count, 1),
        "row": np.arange(count),
        "column": np.zeros(count, int),
        "normal": np.tile(np.float32([0.0, 0.0, 1.0]), (count, 1)),
        "diffuse": np.asarray(diffuse, np.float32),
        "specular": none,
        "shape": none,
        "ambient": None,
        "view_tilt": None,
        "residual": codes,
    }
    return Pixels(**settings | columns)


def rendered(pixels, term, under=None):
    """Return pixels with a residual term under lights, by default from their normal."""
    under = Lights(("up",), np.array([[0.0, 0.0, 1.0]])) if under is None else under
    return render_pixels(replace(pixels, attributes={**pixels.attributes, "residual": term}), under, CAMERA)


def test_the_term_fades_to_nothing_outside_the_hull():
    direction = lights(30, 40)
    found = plain_term(direction) | {"weights": RNG.normal(size=(1, 3, 30)).tolist(), "step": [1.0]}
    assert ResidualTerm.of({"residual": found}).share(direction) == pytest.approx(1.0)
    low = dome_direction(np.radians([75.0]), [1.0])
    assert ResidualTerm.of({"residual": found}).share(low) == 0.0
    pixels = flat(np.full((5, 3), 0.3), np.full((5, 1), ZERO + 1, np.uint16))
    for place, same in ((low, True), (direction[:1], False)):
        under = Lights(("a",), place)
        changed = rendered(pixels, found, under) != rendered(replace(pixels, residual=None), found, under)
        assert changed.any() != same


@pytest.mark.parametrize("tabled", [True, False])
def test_added_as_docs_store_md_says(tabled):
    direction = lights(12)
    strength = RNG.normal(0.0, 0.2, size=(3, 12))
    table = RNG.normal(0.0, 0.2, size=(3, 4, 6))
    found = {
        "components": 3,
        "step": [0.01, 0.02, 0.005],
        "toe": 0.004,
        "direction": direction.tolist(),
        "length": 0.4,
        "weights": (weights := RNG.normal(size=(3, 3, 12))).tolist(),
        "hull": hull_of(direction).tolist(),
        "fade": 0.17,
        "strength": {"table": table.tolist()} if tabled else {"length": 0.6, "weights": strength.tolist()},
    }
    codes = RNG.integers(ZERO - 9, ZERO + 9, size=(7, 3)).astype(np.uint16)
    intensity = np.array([[1.0, 1.2, 0.8], [2.0, 2.0, 2.0]])
    diffuse = RNG.uniform(0.0, 1.0, size=(7, 3))
    diffuse[3] = np.nan
    stated = Lights(("a", "b"), direction[:2], intensity=intensity)
    got = rendered(flat(diffuse, codes), found, scale_lights({"residual": found}, stated))
    for place in np.ndindex(2, 7, 3):
        which, pixel, channel = place
        near = np.exp(-np.square(direction[which] - direction).sum(axis=1) / (2 * 0.4**2))
        value = np.sqrt(diffuse[pixel, channel] * direction[which, 2] + 0.004) - np.sqrt(0.004)
        value += ((codes[pixel].astype(float) - ZERO) * found["step"]) @ (weights[:, channel] @ near)
        expected = ((max(value, 0) + np.sqrt(0.004)) ** 2 - 0.004) * intensity[which, channel]
        if tabled:
            around = np.append(table[channel], table[channel, :, :1], axis=1)
            zenith, azimuth = np.degrees(zenith_azimuth(direction[which]))
            row = [np.interp(azimuth % 360.0, np.arange(0, 361, 60), values) for values in around]
            expected *= np.exp(np.interp(zenith, [0, 30, 60, 90], row))
        else:
            around = np.exp(-np.square(direction[which] - direction).sum(axis=1) / (2 * 0.6**2))
            expected *= np.exp(strength[channel] @ around)
        np.testing.assert_allclose(got[place], expected, rtol=2e-4, atol=1e-5)


def photographed(count, channels, *, near=False, floats=False):
    """Return a stack as `left_over` takes it, its values (L, N, C), pixels and lights; always the same."""
    rng = np.random.default_rng(2)
    direction = lights(9, rng=rng)
    under = Lights(
        tuple("abcdefghi"),
        direction,
        position_mm=direction * 300 if near else None,
        intensity=rng.uniform(0.8, 1.2, size=(9, channels)),
    )
    camera = Camera(np.array([0.0, 0.0, 1.0]), mm_per_px=0.5 if near else None)
    stack = SimpleNamespace(camera=camera, scale=1 / 50000, offset=-0.002, clip_level=np.full(channels, 0.8))
    values = rng.integers(0, 50000, size=(9, count, channels)).astype(np.float32 if floats else np.uint16)
    if floats:
        values[2, 0] = np.nan
    diffuse = rng.uniform(0.0, 1.0, size=(count, channels))
    diffuse[count // 2] = np.nan
    slope = np.array([0.0, 0.0, 1.0]) + rng.uniform(-0.3, 0.3, size=(count, 3))
    normal = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    return stack, values, flat(diffuse, normal=normal.astype(np.float32)), under


@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize(("count", "channels"), [(1, 3), (16, 1), (1200, 3), (37, 2)])
def test_left_over_is_the_difference_of_encoded_radiances(count, channels, floats, near):
    stack, values, pixels, under = photographed(count, channels, floats=floats, near=near)
    rest = left_over(stack, values, pixels, under, 0.004)
    place = near_positions_mm(pixels.row, pixels.column, pixels.size, under, stack.camera)
    irradiance = under.irradiance(place)
    measured = values.astype(np.float64) * stack.scale + stack.offset
    model = render_pixels(pixels, under, stack.camera)
    expected = encode(measured / irradiance, 0.004) - encode(model / irradiance, 0.004)
    clipped = measured >= stack.clip_level
    expected = np.where(clipped, np.maximum(expected, 0.0), expected)
    expected[np.isnan(measured) | np.isnan(model)] = 0.0
    assert rest.shape == (count, 9, channels)
    np.testing.assert_allclose(rest, expected.transpose(1, 0, 2), atol=3e-6)
    if count > 30:
        assert clipped.any()
        assert (rest[count // 2] == 0.0).all()


@pytest.mark.parametrize("components", [1, 6, 18, 31])
def test_codes_are_products_with_the_encoder_whatever_the_other_pixels(components):
    stack, values, pixels, under = photographed(1200, 3)
    encoder = RNG.normal(scale=3e3, size=(components, 27)).astype(np.float32)
    encoder[0] *= 100.0  # beyond both ends of the codes
    codes = left_over(stack, values, pixels, under, 0.004, encoder)
    rest = left_over(stack, values, pixels, under, 0.004).reshape(1200, -1).astype(np.float64)
    expected = np.clip(np.rint(rest @ encoder.T.astype(np.float64)), -ZERO, ZERO - 1) + ZERO
    assert codes.dtype == np.uint16
    assert np.abs(codes - expected).max() <= 1
    assert (codes == expected).mean() > 0.98
    assert (codes[600] == ZERO).all()
    assert {0, 65535} <= set(codes[:, 0].tolist())
    part = slice(333, 901)
    alone = left_over(stack, values[:, part], pixels.select(part), under, 0.004, encoder)
    np.testing.assert_array_equal(alone, codes[part])
    columns = np.asfortranarray(encoder)
    np.testing.assert_array_equal(left_over(stack, values, pixels, under, 0.004, columns), codes)


def test_strengths_that_are_smooth_over_direction_are_told_to_lights_between():
    direction, between = lights(60), lights(37, zenith_deg=55)

    def smooth(at):
        return 0.2 * np.sin(4.0 * at[:, :1] + [0.0, 0.3, 0.6]) * at[:, 1:2]

    found = find_strength(direction, smooth(direction) + RNG.normal(0.0, 0.01, (60, 1)))
    off = np.log(strength_around({**plain_term(direction), "strength": found}, between)) - smooth(between)
    assert np.sqrt(np.square(off).mean()) < 0.3 * smooth(between).std()
    far = dome_direction(np.radians([88.0]), [1.0])
    assert strength_around({**plain_term(direction), "strength": found}, far) == pytest.approx(1.0)


@pytest.mark.parametrize("way", ["spokes", "rings"])
def test_strengths_of_a_lamp_that_is_led_around_are_told_to_lights_between(way):
    """Of 12 spokes of 6 lights, or of 6 rings, each a little stronger or weaker; every fourth is left out."""
    rng = np.random.default_rng(3)
    spoke, ring = (index.ravel() for index in np.meshgrid(np.arange(12), np.arange(6), indexing="ij"))
    direction = dome_direction(np.radians(15.0 + 12.0 * ring), np.radians(30.0 * spoke))
    drawn = 0.15 * rng.standard_normal(12)[spoke if way == "spokes" else ring][:, None]
    left_out = (spoke + ring) % 4 == 0
    found = find_strength(direction[~left_out], drawn[~left_out])
    assert (found["azimuth"], found["zenith"]) == (way == "spokes", way == "rings")
    off = told(found, direction[left_out], ()) - drawn[left_out]
    assert np.sqrt(np.square(off).mean()) < 0.4 * drawn[left_out].std()


def test_a_table_over_direction_keeps_what_is_smooth():
    def smooth(at):
        return np.stack([at[..., 0] * at[..., 1], np.sin(2.0 * at[..., 2] + at[..., 0])])

    between = dome_direction(RNG.uniform(0.0, np.pi / 2, 300), RNG.uniform(-4.0, 7.0, 300))
    nodes = node_directions()
    np.testing.assert_allclose(look_up(smooth(nodes), between), smooth(between).T, atol=0.006)
    exact = look_up(smooth(nodes), nodes.reshape(-1, 3))
    np.testing.assert_allclose(exact, smooth(nodes).reshape(2, -1).T, atol=1e-9)
    below = dome_direction(np.radians([90.0, 120.0]), [1.0, 1.0])
    np.testing.assert_allclose(*look_up(smooth(nodes), below), atol=1e-12)


def test_strengths_that_have_nothing_to_do_with_direction_are_not_told():
    rng = np.random.default_rng(11)
    draws = [find_strength(lights(40), rng.normal(0.0, 0.1, (40, 1)) + np.zeros(3)) for _ in range(50)]
    assert sum(each is not None for each in draws) <= 2


def test_a_fit_says_where_renderings_could_follow_the_lamp():
    errors = {"model": 30.0, "with_residual": 36.0}
    found = {"left_out_db": errors, "length": 0.3, "noise": 0.1, "components": 18, "kept": 0.9}
    assert len(residual_notes(found)) == 1
    assert "--as-photographed" in residual_notes({**found, "strength": {}})[1]


def strength_around(found, direction):
    """Return how strong the lights around directions (L, 3) were, by the attribute of a term."""
    stated = Lights(tuple(map(str, range(len(direction)))), direction)
    return scale_lights({"residual": found}, stated).intensity


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


@pytest.mark.parametrize(("metal", "used"), [((1.0, 0.7, 0.3), "own"), ((1.0, 1.0, 1.0), "white")])
def test_highlights_have_a_colour_of_their_own_where_lights_left_out_ask_for_it(metal, used, tmp_path):
    count, side = 40, 12
    rng = np.random.default_rng(2)
    pixels = replace(
        flat(rng.uniform(0.05, 0.2, (side * side, 3))),
        attributes={"model": MODEL, "light_rgb": [1.0, 1.0, 1.0]} | OPTICS,
        normal=lights(side * side, 12, rng).astype(np.float32),
        specular=rng.uniform(4.0, 6.0, (side * side, 1)).astype(np.float32),
        shape=np.full((side * side, 1), 0.25, np.float32),
        specular_rgb=np.tile(np.float32(metal), (side * side, 1)),
    )
    folder = write_capture(tmp_path / "photos", [np.zeros((side, side, 3), np.float32)] * count)
    placed = Lights(
        tuple(map(str, range(count))), np.loadtxt(folder / "lights.lp", skiprows=1, usecols=(1, 2, 3))
    )
    photographs = render_pixels(pixels, placed, CAMERA).reshape(count, side, side, 3)
    photographs *= 0.5 / photographs.max() * rng.normal(1.0, 0.005, photographs.shape).astype(np.float32)
    write_capture(folder, list(photographs))
    impasto.stack(folder, tmp_path / "p.zarr")
    options = FitOptions(residual=True, residual_components=6)
    impasto.fit(tmp_path / "p.zarr", models=[MODEL], options=options)
    fit = open_fit(tmp_path / "p.zarr", MODEL)
    found = fit.attributes["highlight_colour"]
    assert found["used"] == used
    assert (found["left_out_db"]["own"] > found["left_out_db"]["white"] + 0.1) == (used == "own")
    assert ("specular_rgb" in fit.names) == (used == "own")
    if used == "own":
        colour = fit.read(slice(0, side), slice(0, side), ["specular_rgb"])["specular_rgb"]
        np.testing.assert_allclose(np.median(colour / colour[..., :1], axis=(0, 1)), metal, rtol=0.05)


def test_renderings_follow_the_lamps_strengths_only_where_they_are_asked_to(painting, tmp_path):
    store = fitted(painting, tmp_path, residual=True, residual_components=2, self_calibrate=False)
    group = zarr.open_group(store / "fits" / MODEL, mode="r+")
    found = dict(group.attrs["residual"])
    channels, count = len(found["weights"][0]), len(found["direction"])
    found["strength"] = {"length": 0.4, "weights": np.full((channels, count), 0.05).tolist()}
    group.attrs["residual"] = found
    light = (20.0, 60.0)
    images = []
    untold = impasto.render(
        painting, model=MODEL, light=[light], out=tmp_path / "untold", raw=True, as_photographed=True
    )
    assert untold.lamp_untold
    for follow in (True, False):
        out = tmp_path / str(follow)
        done = impasto.render(store, model=MODEL, light=[light], out=out, raw=True, as_photographed=follow)
        assert not done.lamp_untold
        images.append(oiio.ImageInput.open(str(out / "1.exr")).read_image("float"))
    stronger = strength_around(found, dome_direction(*np.radians([light]).T))
    assert stronger.min() > 1.05
    np.testing.assert_allclose(images[0], images[1] * stronger[0], rtol=1e-3, atol=1e-5)


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
