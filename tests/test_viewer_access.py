"""The page for everybody: languages, contrast, motion, narrow displays, and browsers without WebGL2."""

import shutil

import pytest
from tests.conftest import CHROMIUM_FLAGS
from tests.viewer_pages import complete, static_host

import impasto

VIEWER = "document.querySelector('impasto-viewer')"
ROOT = f"{VIEWER}.shadowRoot"
MODEL = "torrance-sparrow"


@pytest.fixture(scope="module")
def address(web, painting, tmp_path_factory):
    """Return the address of a published painting."""
    out = tmp_path_factory.mktemp("access") / "site"
    impasto.publish(painting, out, models=[MODEL])
    with static_host(out) as url:
        yield url


@pytest.fixture
def open_page(address, browser):
    """Return what opens the page in a context of its own."""
    contexts = []

    def open_page(size=(900, 600), **options):
        options.setdefault("locale", "en-GB")
        contexts.append(
            browser.new_context(viewport=dict(zip(("width", "height"), size, strict=True)), **options)
        )
        page = contexts[-1].new_page()
        page.goto(address)
        complete(page)
        return page

    yield open_page
    for context in contexts:
        context.close()


def test_the_page_speaks_german_and_has_every_control_named(open_page):
    page = open_page(locale="de-AT")
    assert page.get_by_label("Modell", exact=True).count() == 1
    assert page.get_by_text("Streiflicht").count() == 1
    # Whatever can be reached has a name for those who do not see it.
    nameless = page.evaluate(f"""
      [...{ROOT}.querySelectorAll("button, input, select, canvas, svg[role], textarea")]
        .filter(e => !e.hidden && !e.closest("[hidden]"))
        .filter(e => !(e.getAttribute("aria-label") || e.labels?.[0]?.textContent || e.textContent).trim())
        .map(e => e.outerHTML)
    """)
    assert nameless == []


@pytest.mark.parametrize("width", [360, 390, 1440])
def test_nothing_sticks_out_at_any_width(open_page, width):
    page = open_page(size=(width, 844), has_touch=width < 500)
    if width < 500:
        assert page.locator(".side").is_hidden()
        page.get_by_label("Show the controls").click()
    page.wait_for_timeout(100)
    overflow = page.evaluate(f"""
      [...{ROOT}.querySelectorAll(".panel *, .side")]
        .filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))
    """)
    assert overflow == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_every_control_is_reached_by_keyboard_and_shows_that_it_is(open_page):
    page = open_page()
    wanted = page.evaluate(f"""
      [...{ROOT}.querySelectorAll("button, input, select, canvas, [tabindex='0']")]
        .filter(e => e.checkVisibility() && !e.disabled && e.type !== "radio").length
    """)
    reached = set()
    for _ in range(2 * wanted):
        page.keyboard.press("Tab")
        focused = page.evaluate(f"""
          (() => {{
            const e = {ROOT}.activeElement;
            const all = [...{ROOT}.querySelectorAll("*")];
            return e && [all.indexOf(e), getComputedStyle(e).outlineStyle, e.type];
          }})()
        """)
        if focused:
            assert focused[1] != "none"
            if focused[2] != "radio":  # one stop for all of a group
                reached.add(focused[0])
    assert len(reached) == wanted


def test_colours_that_the_system_forces_keep_the_light_apart_from_its_ground(open_page):
    page = open_page(forced_colors="active", color_scheme="light")
    fill = f"s => getComputedStyle({ROOT}.querySelector(s)).fill"
    dome, light = (page.evaluate(fill, f".hemisphere {part}") for part in (".dome", ".light.active"))
    assert dome == "rgb(255, 255, 255)"
    assert light != dome
    page.evaluate(f"{VIEWER}.hash = 'show=parameters:c:0'")
    page.wait_for_timeout(200)
    assert "gradient" in page.evaluate(f"getComputedStyle({ROOT}.querySelector('.bar')).backgroundImage")


def test_more_contrast_is_given_where_it_is_asked_for(open_page):
    quiet = f"getComputedStyle({ROOT}.querySelector('label > span')).color"
    assert open_page().evaluate(quiet) == "rgb(185, 187, 181)"
    assert open_page(contrast="more").evaluate(quiet) == "rgb(255, 255, 255)"


@pytest.mark.parametrize("motion", ["reduce", "no-preference"])
def test_nothing_moves_by_itself(open_page, motion):
    page = open_page(reduced_motion=motion)
    before = page.evaluate(f"{VIEWER}.hash")
    page.evaluate(f"{VIEWER}.zoom(2, 100, 100)")
    # A zoom is there at once, and no style says that anything glides.
    assert page.evaluate(f"{VIEWER}.hash") != before
    moving = page.evaluate(f"""
      [{VIEWER}, ...{ROOT}.querySelectorAll("*")].map(e => getComputedStyle(e))
        .filter(s => s.animationName !== "none" || !/^(0s(, )?)+$/.test(s.transitionDuration)).length
    """)
    assert moving == 0


def test_a_browser_without_webgl2_is_told(address, browser):
    """The same browser once more, with its graphics switched off."""
    without = browser.browser_type.launch(
        executable_path=shutil.which("chromium"), args=[*CHROMIUM_FLAGS, "--disable-3d-apis"]
    )
    try:
        for locale, words in (("en-GB", "has no WebGL2"), ("de-DE", "kein WebGL2")):
            page = without.new_page(locale=locale)
            errors = []
            page.on("pageerror", lambda error, errors=errors: errors.append(str(error)))
            page.goto(address)
            page.get_by_role("alert").filter(has_text=words).wait_for(timeout=10_000)
            assert errors == []
    finally:
        without.close()


def test_the_page_is_drawn_again_after_the_graphics_card_has_stopped(open_page):
    page = open_page()
    page.evaluate(f"""
      window.stopped = {ROOT}.querySelector("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
      window.stopped.loseContext();
    """)
    page.get_by_text("The graphics card stopped").wait_for()
    page.evaluate("window.stopped.restoreContext()")
    page.get_by_text("The graphics card stopped").wait_for(state="detached")
    complete(page)


def test_nothing_is_asked_of_others(open_page, address):
    asked = []
    page = open_page()
    page.context.on("request", lambda request: asked.append(request.url))
    page.reload()
    complete(page)
    for show in ("normal", "height", "quality:residual_rms:0"):
        page.evaluate(f"{VIEWER}.hash = 'show={show}'")
        complete(page)
    assert asked
    assert [url for url in asked if not url.startswith((address, "blob:", "data:"))] == []
