"""The page draws what `impasto render` renders from the same published store, for every model."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.every_model import write_every_model
from tests.viewer_pages import complete, pictures, static_host

import impasto
from impasto.geometry import Lights, dome_direction
from impasto.models import MODELS
from impasto.pixels import luminance, read_pixels, render_pixels
from impasto.render import render_bands
from impasto.render.display import requested_rendition
from impasto.store import open_published, open_stack

WIDTH, HEIGHT = 544, 512
LIGHTS = 20
GOLDEN = Path(__file__).parent / "golden"


@pytest.fixture(scope="module")
def published(web, tmp_path_factory):
    """Return a published folder with every model."""
    folder = tmp_path_factory.mktemp("every-model")
    impasto.publish(write_every_model(folder, WIDTH, HEIGHT), folder / "site", photographs=4)
    return folder / "site"


@pytest.fixture(scope="module")
def page(published, browser):
    """Return a page of the published folder whose canvas has exactly the picture's pixels."""
    with static_host(published) as url:
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url)
        complete(page)
        yield page
        page.close()
        assert errors == []


def random_lights(seed):
    """Return lights all over the hemisphere, every third near, each as the core and as the page take it."""
    rng = np.random.default_rng(seed)
    zenith, azimuth = np.degrees(np.arccos(rng.uniform(0.05, 1, LIGHTS))), rng.uniform(0, 360, LIGHTS)
    intensity = rng.uniform(0.5, 2, LIGHTS)
    distance = rng.uniform(150, 1500, LIGHTS)
    direction = dome_direction(np.radians(zenith), np.radians(azimuth))
    position = np.where((np.arange(LIGHTS) % 3 == 0)[:, None], direction * distance[:, None], np.nan)
    names = tuple(str(number) for number in range(LIGHTS))
    lights = Lights(names, direction, position_mm=position, intensity=intensity[:, None])
    page = [
        {
            "zenith": float(zenith[i]),
            "azimuth": float(azimuth[i]),
            "distance_mm": None if math.isnan(position[i, 0]) else float(distance[i]),
            "size_deg": 0,
            "intensity": float(intensity[i]),
            "kelvin": 6504,
        }
        for i in range(LIGHTS)
    ]
    return lights, page


def rendered(store, model, lights):
    """Yield what `impasto render` shows under each light, without its files: (height, width, RGB), uint8."""
    fit, stack = open_published(store, model)
    rendition = requested_rendition(
        stack, display="srgb", exposure=1.0, white_point=None, adaptation="cat16", highlights="clip"
    )
    bands = [band.radiance for band in render_bands(fit, lights, stack.camera)]
    for radiance in np.concatenate(bands, axis=1):
        yield np.rint(255 * rendition(radiance).drive).astype(np.uint8)


def test_rendered_in_memory_is_what_the_command_writes(published, tmp_path):
    lights, _ = random_lights(3)
    store, one = published / "painting.zarr", lights.select(slice(0, 1))
    impasto.render(store, model="phong", lights=one, out=tmp_path, animate=False)
    (picture,) = rendered(store, "phong", one)
    difference = np.abs(picture.astype(int) - np.asarray(Image.open(tmp_path / "0.png")))
    assert difference.max() <= 1
    assert np.mean(difference > 0) < 1e-4  # halves may be rounded to either side


@pytest.mark.parametrize("model", MODELS)
def test_the_page_draws_what_the_core_renders(model, published, page):
    lights, shown = random_lights(sum(map(ord, model)))
    view = {"x": WIDTH / 2, "y": HEIGHT / 2, "scale": 1}
    page.evaluate("hash => { document.querySelector('impasto-viewer').hash = hash }", f"model={model}")
    complete(page)
    states = [{"lights": [light], "view": view} for light in shown]
    expected = rendered(published / "painting.zarr", model, lights)
    differences = []
    for want, got in zip(expected, pictures(page, states), strict=True):
        assert want.shape == got.shape == (HEIGHT, WIDTH, 3)
        assert want.std() > 10  # there is something to compare
        differences.append(np.abs(want.astype(int) - got).max(axis=2))
    differences = np.array(differences)
    assert differences.max() <= 2
    assert np.mean(differences <= 1) >= 0.999
    print(f"{model}: {np.mean(differences == 0):.6f} equal, {np.mean(differences <= 1):.6f} within 1")


def near_site(published, site, model, way):
    """Copy a published folder of which a fit of a model found its lights near, in one of three ways.

    One distance, in pixels, or one that is smooth over direction, in mm, as stores have and had it.
    """
    shutil.copytree(published, site)
    root = site / "painting.zarr" / "zarr.json"
    document = json.loads(root.read_text())
    attributes = document["attributes"]
    told = {"distance": 1.2}
    if way == "one":
        attributes["camera"]["mm_per_px"] = None
    elif way == "table":
        told |= {"length": 0.6, "table": [[[0.1, 0.1, 0.1], [0.4, -0.2, 0.3], [0.2, 0.0, -0.3]]]}
    else:
        directions = dome_direction(np.radians([30.0, 60.0, 60.0]), np.radians([0.0, 120.0, 240.0])).tolist()
        told |= {"direction": directions, "length": 0.5, "weights": [[0.3, -0.2, 0.4]]}
    (entry,) = [entry for entry in attributes["models"] if entry["name"] == model]
    entry["self_calibration"] = {"distances": {"told": told}}
    root.write_text(json.dumps(document))
    return site


@pytest.mark.parametrize("way", ["one", "table", "kernel"])
def test_lights_far_away_are_drawn_as_near_as_the_fit_found_its_own(way, published, browser, tmp_path):
    model = "torrance-sparrow"
    near_site(published, tmp_path / "site", model, way)
    lights, shown = random_lights(5)
    far = [number for number in range(LIGHTS) if shown[number]["distance_mm"] is None]
    view = {"x": WIDTH / 2, "y": HEIGHT / 2, "scale": 1}
    expected = list(rendered(tmp_path / "site" / "painting.zarr", model, lights.select(far)))
    distant = list(rendered(published / "painting.zarr", model, lights.select(far)))
    with static_host(tmp_path / "site") as url:
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(f"{url}#model={model}")
        complete(page)
        states = [{"lights": [shown[number]], "view": view} for number in far]
        drawn = list(pictures(page, states))
        page.close()
    differences = np.array([
        np.abs(want.astype(int) - got).max(axis=2) for want, got in zip(expected, drawn, strict=True)
    ])  # fmt: skip
    assert differences.max() <= 2
    assert np.mean(differences <= 1) >= 0.999
    assert all(np.abs(near.astype(int) - far).mean() > 3 for near, far in zip(expected, distant, strict=True))


VIEWER = "document.querySelector('impasto-viewer')"
X, Y, AZIMUTH = 470, 90, 300.0


@pytest.fixture
def pixel(browser):
    """Return what opens a published folder at a model, and the panel of a pixel near a corner."""
    pages = []

    def opened(url, model):
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, locale="en-GB")
        pages.append(page)
        page.goto(f"{url}#model={model}")
        complete(page)
        page.evaluate(f"a => {VIEWER}.state.lights.forEach(light => {{ light.azimuth = a }})", AZIMUTH)
        page.evaluate(f"{VIEWER}.inspect({X}, {Y})")
        page.locator(".curve .line-0").wait_for()
        return page

    yield opened
    for page in pages:
        page.close()


def plotted(page, places):
    """Return angles and values of places of the plot of a pixel, by its grid and its labels."""
    lines = page.locator(".curve .grid").evaluate_all(
        "each => each.map(l => [+l.getAttribute('x1'), +l.getAttribute('y1')])"
    )
    left, right, bottom, top = lines[0][0], lines[4][0], lines[5][1], lines[7][1]
    highest = float(page.locator(".curve .end").last.text_content())
    x, y = np.transpose(places)
    return -90 + 180 * (x - left) / (right - left), highest * (bottom - y) / (bottom - top)


def line(page, number):
    path = page.locator(f".curve .line-{number}").get_attribute("d")
    return plotted(page, [[float(n) for n in point.split()] for point in path[1:].split("L")])


@pytest.mark.parametrize("way", ["one", "table"])
def test_the_curves_of_a_pixel_are_those_of_lights_as_near_as_they_are_drawn(way, published, pixel, tmp_path):
    model = "torrance-sparrow-ambient"
    site = near_site(published, tmp_path / "site", model, way)
    fit, stack = open_published(site / "painting.zarr", model)
    angle = np.arange(-89, 90)
    lights = Lights([""] * 179, dome_direction(np.radians(angle), np.full(179, np.radians(AZIMUTH))))
    tile = slice(Y, Y + 1), slice(X, X + 1)
    with static_host(site) as url:
        page = pixel(url, model)
        curves = [line(page, number) for number in (0, 1)]
    for residual, (at, values) in zip((False, True), curves, strict=True):
        want = luminance(
            render_pixels(read_pixels(fit, *tile, residual=residual), lights, stack.camera)[:, 0]
        )
        np.testing.assert_allclose(at, angle, atol=0.05)
        np.testing.assert_allclose(values, want, atol=0.005 * want.max())
    distant = open_published(published / "painting.zarr", model)[0]
    far = luminance(render_pixels(read_pixels(distant, *tile), lights, stack.camera)[:, 0])
    assert np.abs(far - want).max() > 0.1 * want.max()


def test_photographs_under_lights_at_a_position_count_as_the_pixel_sees_them(published, pixel, tmp_path):
    shutil.copytree(published, tmp_path / "site")
    root = tmp_path / "site" / "painting.zarr" / "zarr.json"
    document = json.loads(root.read_text())
    camera = document["attributes"]["camera"]
    lights = document["attributes"]["photographs"]["lights"]
    extent = WIDTH * camera["mm_per_px"]
    # One that stands in the plane as the pixel sees it and not from the centre, one the other way round.
    place = camera["mm_per_px"] * np.array([X - (WIDTH - 1) / 2, (HEIGHT - 1) / 2 - Y, 0.0])
    towards = dome_direction(np.radians(50.0), np.radians(AZIMUTH))
    for light, position in zip(
        lights, (place + 0.8 * extent * towards, 0.8 * extent * towards), strict=False
    ):
        light["direction"] = (position / np.linalg.norm(position)).tolist()
        light["position_mm"] = position.tolist()
    for light in lights[2:]:
        light["direction"] = dome_direction(np.radians(50.0), np.radians(AZIMUTH + 90)).tolist()
    root.write_text(json.dumps(document))
    with static_host(tmp_path / "site") as url:
        page = pixel(url, "phong")
        page.get_by_role("button", name="photographs").click()
        page.locator(".curve .measured").first.wait_for()
        dots = page.locator(".curve .measured")
        ((angle,), (value,)) = plotted(
            page, dots.evaluate_all("each => each.map(c => [+c.getAttribute('cx'), +c.getAttribute('cy')])")
        )
    assert angle == pytest.approx(50.0, abs=0.05)
    stack = open_stack(published.parent / "every-model.zarr")
    number = stack.lights.names.index(lights[0]["name"])
    radiance = stack.radiance(slice(Y, Y + 1), slice(X, X + 1), [number])[0, 0, 0]
    falloff = np.square(lights[0]["position_mm"]).sum() / (0.8 * extent) ** 2
    assert abs(falloff - 1) > 0.1
    assert value == pytest.approx(luminance(radiance / lights[0]["intensity"]) / falloff, rel=0.02)


def test_the_residual_is_added_only_where_asked_and_under_lights_that_tell_it(published, page):
    model = "torrance-sparrow-ambient"
    page.evaluate(f"{VIEWER}.hash = 'model={model}'")
    complete(page)
    light = page.evaluate(f"{VIEWER}.state.lights[0]")
    near, far = {**light, "zenith": 20, "azimuth": 0}, {**light, "zenith": 88, "azimuth": 0}
    states = [{"lights": [each], "residual": added} for each in (near, far) for added in (True, False)]
    inside, inside_alone, outside, outside_alone = pictures(page, states)
    assert np.abs(inside.astype(int) - inside_alone).mean() > 3
    difference = np.abs(outside.astype(int) - outside_alone)
    assert difference.max() <= 1
    assert np.mean(difference > 0) < 1e-4  # rounding of the square root and back


def test_the_residual_is_a_map_a_box_and_a_line(page, browser):
    other = browser.new_page(viewport={"width": 900, "height": 600}, locale="en-GB")
    other.goto(page.url.partition("#")[0] + "#model=phong")
    complete(other)
    assert other.get_by_label("Add what the model leaves over").is_visible()
    other.get_by_label("Add what the model leaves over").uncheck()
    assert other.evaluate(f"{VIEWER}.state.residual") is False
    assert "residual=0" in other.evaluate(f"{VIEWER}.hash")
    other.get_by_label("Show", exact=True).select_option("residual")
    complete(other)
    other.locator(".ticks span", has_text="-").first.wait_for()
    ticks = [float(text) for text in other.locator(".ticks span").all_text_contents()]
    assert ticks == [-ticks[4], -ticks[3], 0, ticks[3], ticks[4]]
    assert ticks[4] > 0.01
    other.get_by_label("Compare", exact=True).select_option("alone")
    assert other.locator(".caption").all_text_contents() == ["phong", "The model alone"]
    other.evaluate(f"{VIEWER}.inspect(300, 200)")
    other.locator(".curve .line-1").wait_for()
    curves = [other.locator(f".curve .line-{number}").get_attribute("d") for number in (0, 1)]
    assert curves[0] != curves[1]
    other.get_by_label("Model", exact=True).select_option("phong-no-ambient")
    assert other.get_by_label("Add what the model leaves over").is_hidden()
    assert other.evaluate(f"{VIEWER}.state.show") == "radiance"
    other.close()


def golden_cases():
    """Return the golden cases by model and optics."""
    groups = {}
    for name in ("hand", "lobes", "mitsuba"):
        for case in json.loads((GOLDEN / f"{name}.json").read_text())["cases"]:
            key = (case["model"], case["index"], case["fresnel"])
            groups.setdefault(key, []).append(case)
    return groups


GROUPS = golden_cases()


@pytest.mark.parametrize(("model", "index", "fresnel"), GROUPS)
def test_the_shader_meets_the_golden_values(model, index, fresnel, page):
    cases = GROUPS[model, index, fresnel]
    optics = {"index": index, "element": fresnel == "element"}
    got = page.evaluate(
        "([model, optics, cases]) => document.querySelector('impasto-viewer').basis(model, optics, cases)",
        [model, optics, cases],
    )
    got = np.array(got)
    np.testing.assert_allclose(got[:, 0], [case["diffuse_basis"] for case in cases], rtol=1e-5, atol=1e-6)
    if MODELS[model].lobes:
        want = np.array([np.atleast_1d(case["specular_basis"]) for case in cases])
        # As for the core in single precision: directions rounded to it move a lobe of width c by 1e-7 / c.
        np.testing.assert_allclose(got[:, 1:], want, rtol=2e-4, atol=1e-6)


def test_the_shader_has_every_model_of_the_core(page):
    """A model that the core lists and the page lacks would not be offered, without a word."""
    listed = page.evaluate("document.querySelector('impasto-viewer').models")
    plain = {name: spec for name, spec in MODELS.items() if "ambient" not in name}
    assert {entry["name"]: (entry["shape"], entry["lobes"]) for entry in listed} == {
        name: (list(spec.shape_names), spec.lobes) for name, spec in plain.items()
    }
    offered = page.evaluate(
        "document.querySelector('impasto-viewer').store.attributes.models.map(m => m.name)"
    )
    assert set(offered) == set(MODELS)
