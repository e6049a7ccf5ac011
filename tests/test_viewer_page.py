"""The page as people use it: by mouse, touch and keyboard, in a real browser."""

import io
import json

import pytest
from PIL import Image, ImageCms
from tests.viewer_pages import complete, static_host

import impasto

VIEWER = "document.querySelector('impasto-viewer')"
WIDE, NARROW = (900, 600), (390, 844)
MODEL = "torrance-sparrow"


@pytest.fixture(scope="module")
def address(web, painting, tmp_path_factory):
    """Return the address of a published painting with two models and four photographs."""
    out = tmp_path_factory.mktemp("page") / "site"
    impasto.publish(painting, out, photographs=4, title="A study <b>in</b> ochre")
    with static_host(out) as url:
        yield url


@pytest.fixture
def open_page(address, browser):
    """Return what opens the page in a context of its own; errors in the page fail the test."""
    contexts, errors = [], []

    def open_page(hash="", size=WIDE, **options):
        width, height = size
        options.setdefault("locale", "en-GB")
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"{address}#{hash}")
        complete(page)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert errors == []


def state(page):
    return page.evaluate(f"{VIEWER}.state")


def drag(page, start, *places):
    page.mouse.move(*start)
    page.mouse.down()
    for place in places:
        page.mouse.move(*place, steps=4)
    page.mouse.up()


def centre(locator):
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_the_light_is_dragged_on_the_hemisphere(open_page):
    page = open_page()
    x, y = centre(page.locator(".hemisphere"))
    before = page.screenshot()
    drag(page, (x, y), (x + 50, y - 1))
    light = state(page)["lights"][0]
    assert 30 < light["zenith"] < 80
    assert abs(light["azimuth"]) < 5
    complete(page)
    assert page.screenshot() != before
    page.get_by_label("On the arm only").check()
    drag(page, (x, y), (x - 40, y - 60))
    light = state(page)["lights"][0]
    assert light["azimuth"] == 180
    assert "arm=1" in page.evaluate(f"{VIEWER}.hash")


def test_the_light_is_dragged_in_the_picture(open_page):
    page = open_page()
    page.get_by_label("Drag the light in the picture").check()
    x, y = centre(page.locator("canvas"))
    drag(page, (x, y), (x, y - 300))
    light = state(page)["lights"][0]
    assert light["azimuth"] == pytest.approx(90, abs=2)
    assert light["zenith"] > 30
    assert state(page)["view"] is None


def test_all_of_the_light_can_be_set_by_keyboard(open_page):
    page = open_page("light=30,0")
    page.locator(".hemisphere").focus()
    page.keyboard.press("ArrowRight")
    assert state(page)["lights"][0]["zenith"] == pytest.approx(32)
    page.keyboard.press("Shift+ArrowLeft")
    assert state(page)["lights"][0]["zenith"] == pytest.approx(22)
    assert page.locator(".hemisphere").get_attribute("aria-valuetext") == "zenith 22°, azimuth 0°"
    page.get_by_role("slider", name="Intensity").press("ArrowRight")
    assert state(page)["lights"][0]["intensity"] == pytest.approx(1.05)
    page.get_by_role("button", name="Add a light").press("Enter")
    assert len(state(page)["lights"]) == 2
    page.get_by_role("button", name="Remove this light").press("Enter")
    assert len(state(page)["lights"]) == 1


def test_pan_and_zoom_by_mouse_and_keyboard(open_page):
    page = open_page()
    x, y = centre(page.locator("canvas"))
    page.mouse.move(x + 100, y)
    held = page.evaluate(f"{VIEWER}.toPicture({x + 100}, {y})")
    page.mouse.wheel(0, -400)
    page.wait_for_timeout(100)
    zoomed = state(page)["view"]
    assert page.evaluate(f"{VIEWER}.toPicture({x + 100}, {y})") == pytest.approx(held, abs=1e-3)
    drag(page, (x, y), (x - 90, y + 30))
    panned = state(page)["view"]
    assert panned["x"] - zoomed["x"] == pytest.approx(90 / zoomed["scale"], rel=0.01)
    assert panned["y"] - zoomed["y"] == pytest.approx(-30 / zoomed["scale"], rel=0.01)
    page.locator("canvas").focus()
    page.keyboard.press("ArrowRight")
    assert state(page)["view"]["x"] > panned["x"]
    page.keyboard.press("-")
    assert state(page)["view"]["scale"] < zoomed["scale"]
    page.keyboard.press("1")
    assert state(page)["view"]["scale"] == 1
    page.keyboard.press("0")
    assert state(page)["view"] is None


def test_two_fingers_zoom_and_do_not_click(open_page):
    page = open_page(size=NARROW, has_touch=True, is_mobile=True, device_scale_factor=2)
    x, y = centre(page.locator("canvas"))
    session = page.context.new_cdp_session(page)

    def touch(kind, *spread):
        points = [{"x": x - s, "y": y, "id": 1} for s in spread] + [
            {"x": x + s, "y": y, "id": 2} for s in spread
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 40)
    for spread in (50, 60, 70, 80):
        touch("touchMove", spread)
    touch("touchEnd")
    page.wait_for_timeout(100)
    fitted = min(page.evaluate("[innerWidth / 60, innerHeight / 44]"))
    assert state(page)["view"]["scale"] > 1.5 * fitted
    assert page.locator(".details").is_hidden()
    # One finger moves it.
    before = state(page)["view"]
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    session.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x - 60, "y": y}]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_timeout(100)
    assert state(page)["view"]["x"] > before["x"]


def test_models_and_maps_are_chosen_and_maps_have_legends(open_page):
    page = open_page()
    page.get_by_label("Model", exact=True).select_option("phong")
    assert state(page)["model"] == "phong"
    assert page.locator(".legend").count() == 0
    shown = page.get_by_label("Show", exact=True)
    seen = set()
    with_legend = ("height", "ratio", "gloss", "quality:residual_rms:0")
    for show in ("specular", "diffuse", "normal", "albedo", *with_legend):
        shown.select_option(show)
        complete(page)
        page.wait_for_timeout(150)
        seen.add(page.locator("canvas").screenshot())
        legend = page.locator(".legend")
        assert legend.count() == (show in with_legend)
        if legend.count():
            assert len(legend.locator(".ticks span").all_text_contents()) == 5
    assert len(seen) == 8
    shown.select_option("parameters:shininess:0")
    page.get_by_label("Model", exact=True).select_option(MODEL)
    assert state(page)["show"] == "radiance"  # this model has no shininess


def test_models_and_photographs_are_compared(open_page):
    page = open_page(f"model={MODEL}&light=40,120")
    page.get_by_label("Compare", exact=True).select_option("model:phong")
    complete(page)
    assert page.locator(".caption").all_text_contents() == [MODEL, "phong"]
    handle = page.get_by_role("button", name="Swipe line")
    x, y = centre(handle)
    drag(page, (x, y), (x + 200, y))
    dragged = state(page)["swipe"]
    assert dragged > 0.6
    handle.press("ArrowLeft")
    assert state(page)["swipe"] == pytest.approx(dragged - 0.02)
    page.get_by_label("Arrangement").select_option("side")
    assert page.locator(".divider button").is_hidden()
    page.get_by_label("Compare", exact=True).select_option("photograph:nearest")
    complete(page)
    assert "its light is" in page.locator(".caption.right").text_content()
    page.get_by_role("button", name="Light as in the photograph").click()
    assert "its light is 0° away" in page.locator(".caption.right").text_content()


def test_a_pixel_tells_its_parameters_and_its_curve(open_page, painting):
    page = open_page(f"model={MODEL}")
    x, y = page.evaluate(f"{VIEWER}.toPage(30.5, 20.5)")
    page.mouse.click(x, y)
    page.locator(".details table").wait_for()
    assert page.locator(".details h3").text_content() == "Pixel 30, 20"
    fit = impasto.open(painting)["fits/torrance-sparrow"]
    rows = dict(
        zip(
            page.locator(".details th[scope=row]").all_text_contents(),
            page.locator(".details td").all_text_contents(),
            strict=True,
        )
    )
    assert float(rows["c"]) == pytest.approx(float(fit["c"][20, 30]), rel=5e-3)
    assert float(rows["specular magnitude As"]) == pytest.approx(float(fit["specular"][20, 30]), rel=5e-3)
    assert float(rows["diffuse magnitude, red"]) == pytest.approx(float(fit["diffuse"][20, 30, 0]), rel=5e-3)
    assert rows["How the fit ended"] == "converged"
    assert len(page.locator(".curve path").get_attribute("d")) > 500
    page.get_by_role("button", name="Add the measured points").click()
    page.get_by_text("photographs have their light in this plane").wait_for()


def test_the_ruler_measures_in_mm(open_page, painting):
    page = open_page("view=30,22,10")
    page.get_by_label("Ruler").check()
    start, end = (page.evaluate(f"{VIEWER}.toPage({x}, 22)") for x in (20, 40))
    drag(page, start, end)
    mm = impasto.store.open_stack(painting).camera.mm_per_px
    told = page.locator(".caption.above").text_content()
    assert float(told.split()[1]) == pytest.approx(20 * mm, rel=0.01)
    assert told.endswith("mm")


def test_the_address_brings_back_the_view_and_the_light(open_page, address):
    page = open_page()
    page.evaluate(
        f"{VIEWER}.hash = 'model=phong&show=albedo&light=52,200,,3,1.5,4000;20,10&active=1&exposure=1"
        "&exaggeration=2&compare=photograph:1&split=side&view=31,20,12'"
    )
    page.wait_for_url("**view=31,20,12**")
    kept = state(page)
    page.reload()
    complete(page)
    assert state(page) == kept
    assert kept["lights"][0]["kelvin"] == 4000
    assert len(kept["lights"]) == 2
    assert kept["exposure"] == 1


def test_an_address_that_makes_no_sense_does_no_harm(open_page):
    page = open_page("model=gloss&show=<b>&light=x,y&compare=model:none&view=1,2&split=%&exposure=1e9")
    assert state(page)["model"] == MODEL
    assert state(page)["show"] == "radiance"
    assert state(page)["compare"] == ""
    assert state(page)["exposure"] == 6


def test_a_snapshot_is_a_png_with_a_colour_profile(open_page):
    page = open_page("light=40,120")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save the picture (PNG)").click()
    path = waiting.value.path()
    assert waiting.value.suggested_filename.endswith(".png")
    with Image.open(path) as image:
        image.load()
        assert image.size == tuple(
            page.evaluate(
                "[0, 1].map(i => [c.width, c.height][i])".replace(
                    "c.", f"{VIEWER}.shadowRoot.querySelector('canvas')."
                )
            )
        )
        profile = ImageCms.ImageCmsProfile(io.BytesIO(image.info["icc_profile"]))
        assert profile.profile.xcolor_space.strip() == "RGB"
        assert max(high for _, high in image.convert("RGB").getextrema()) > 60


def test_annotations_keep_their_view_and_are_exported(open_page):
    page = open_page("light=40,120&view=30,22,12")
    page.get_by_label("Annotate").check()
    page.mouse.click(*page.evaluate(f"{VIEWER}.toPage(28.5, 19.5)"))
    page.get_by_label("Note").fill("Retouched? <i>see</i> the gloss")
    page.get_by_role("button", name="Save", exact=True).click()
    assert page.locator(".notes i").count() == 0
    page.evaluate(f"{VIEWER}.hash = 'light=70,0'")
    page.reload()
    complete(page)
    page.locator(".notes button").first.click()
    assert state(page)["lights"][0]["zenith"] == 40
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Export").click()
    exported = json.loads(waiting.value.path().read_text())
    assert exported["type"] == "AnnotationPage"
    assert exported["items"][0]["target"]["selector"] == {"type": "PointSelector", "x": 28, "y": 19}
    page.get_by_label("Remove 1").click()
    assert page.locator(".notes li").count() == 0
    page.locator("input[type=file]").set_input_files(
        {"name": "a.json", "mimeType": "application/json", "buffer": json.dumps(exported).encode()}
    )
    page.locator(".notes li").wait_for()
