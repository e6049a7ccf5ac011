"""Every page of an experiment, as pictures: python -m benchmarks.experiment_pages --out FOLDER.

Each page is shown in a window of 1280 x 800 and one of 2560 x 1440, for somebody to look at. The tests walk
the same way, and check the geometry, the contrast and the focus of what they see.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.experiment_server import ADMIN_TOKEN, Observer, ServerProcess, fill_in

import impasto
from impasto.capture.simulate import simulate
from impasto.psychophysics.experiment.manifest import Layout, Presentation

if TYPE_CHECKING:
    from playwright.sync_api import Page

WINDOWS = ((1280, 800), (2560, 1440))
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_WRONG_CODE = "2222222222222222"
_GAPS = ("ArrowRight", "ArrowDown", "ArrowLeft", "ArrowUp")


@dataclass(frozen=True)
class Stop:
    """A page that is shown.

    Parameters
    ----------
    name : str
    windows : tuple of (int, int), optional
        Sizes of the window in which to look at it.
    """

    name: str
    windows: tuple[tuple[int, int], ...] = WINDOWS


def make_experiments(store: Path, folder: Path) -> dict[str, Path]:
    """Make an experiment with everything that may be asked, one of forced choice, one that alternates."""

    def make(name: str, *, layout: Layout = "beside", everything: bool = False) -> Path:
        presentation = Presentation(
            layout=layout,
            ties=everything,
            vision_checks=everything,
            display_check=everything,
            repeats=0,
            catch_every=0,
            practice=1,
            break_every=1,
            minimum_view_s=0.2,
            adaptation_s=3 if everything else 0,
        )
        out = folder / name
        impasto.experiment.create([store], out=out, angles=3, presentation=presentation, show_progress=False)
        return out

    return {
        "ties": make("ties", everything=True),
        "forced": make("forced"),
        "alternating": make("alternating", layout="alternating"),
    }


def walk(page: Page, experiments: dict[str, Path]) -> Iterator[Stop]:
    """Go through all pages, and stop at each while it is shown."""
    with ExitStack() as stack:
        addresses = {
            name: stack.enter_context(ServerProcess(folder, f"sqlite:///{folder}/answers.sqlite")).address
            for name, folder in experiments.items()
        }
        yield from _before_the_trials(page, addresses["ties"], experiments["ties"])
        yield from _trials_with_ties(page, addresses["ties"])
        yield from _forced_choice(page, addresses["forced"], experiments["forced"])
        yield from _alternating(page, addresses["alternating"], experiments["alternating"])
        yield from _laboratory(page, addresses["ties"], experiments["ties"])


def show(page: Page, window: tuple[int, int]) -> None:
    """Give the window a size, and wait until the page has taken it."""
    page.set_viewport_size({"width": window[0], "height": window[1]})
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def _next(page: Page, title: str = "") -> None:
    """Fill in the card that is shown, send it, and wait for what comes after it."""
    fill_in(page)
    before = page.locator(".card").element_handle()
    page.locator("button[type=submit]").click()
    before.wait_for_element_state("hidden")
    if title:
        page.locator("h1", has_text=title).wait_for()


def _before_the_trials(page: Page, address: str, folder: Path) -> Iterator[Stop]:
    (invitation,) = impasto.experiment.invite(folder)
    page.goto(address)
    page.locator("h1").wait_for()
    yield Stop("code")
    page.locator("[name=code]").fill(_WRONG_CODE)
    _next(page, "Welcome")
    yield Stop("code-wrong")
    page.locator("[name=code]").fill(invitation.code)
    _next(page)
    page.locator("[name=agreed]").wait_for()
    yield Stop("consent")
    _next(page, "Viewing conditions")
    yield Stop("viewing")
    _next(page, "Check of the display")
    yield Stop("display-check")
    for plate in ("control", "protan", "deutan", "tritan"):
        _next(page, "Which number do you see?")
        yield Stop(f"plate-{plate}")
        page.locator("[name=read]").fill(page.locator(".plate").get_attribute("data-shown"))
    _next(page, "Sharpness of sight")
    yield Stop("acuity")
    _next(page)
    page.locator(".ring").wait_for()
    yield Stop("acuity-ring")
    while page.locator(".ring").count():
        ring = page.locator(".ring").element_handle()
        page.keyboard.press(_GAPS[int(ring.get_attribute("data-turn"))])
        ring.wait_for_element_state("hidden")
    page.locator("h1").wait_for()
    yield Stop("instructions")
    _next(page)
    page.locator(".adaptation").wait_for()
    yield Stop("adaptation")


def _trials_with_ties(page: Page, address: str) -> Iterator[Stop]:
    observer = Observer(page, address)
    observer.wait_until_asked()
    yield Stop("trial-ties")
    yield Stop("too-small", ((900, 320),))
    show(page, WINDOWS[0])
    page.context.set_offline(True)
    observer.answer("tie", key=False)
    page.locator("#notice").wait_for()
    yield Stop("no-connection")
    page.context.set_offline(False)
    observer.wait_for_the_next()
    observer.wait_until_asked()
    observer.answer("left")
    page.locator("h1", has_text="Time for a pause").wait_for()
    yield Stop("pause")
    page.goto(address)  # the window knows its code
    page.locator("h1", has_text="Welcome back").wait_for()
    yield Stop("welcome-back")
    while observer.wait_until_asked():
        observer.answer("right")
        observer.wait_for_the_next()
    yield Stop("thanks")


def _forced_choice(page: Page, address: str, folder: Path) -> Iterator[Stop]:
    (invitation,) = impasto.experiment.invite(folder)
    observer = Observer(page, address)
    observer.open(invitation.code)
    observer.reach_the_trials()
    observer.wait_until_asked()
    page.keyboard.press("Tab")
    yield Stop("trial-forced")
    impasto.experiment.forget(folder, invitation.observer)
    observer.answer("left")
    page.locator("#notice", has_text="has deleted").wait_for()
    yield Stop("deleted")


def _alternating(page: Page, address: str, folder: Path) -> Iterator[Stop]:
    (invitation,) = impasto.experiment.invite(folder)
    observer = Observer(page, address)
    observer.open(invitation.code)
    observer.reach_the_trials()
    yield Stop("trial-alternating-not-all-seen")
    for key in ("ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
    observer.wait_until_asked()
    yield Stop("trial-alternating")


def _laboratory(page: Page, address: str, folder: Path) -> Iterator[Stop]:
    impasto.experiment.simulate(folder, observers=6)
    page.goto(f"{address}/admin")
    page.locator("[name=token]").fill("nonsense")
    page.locator("button[type=submit]").click()
    page.get_by_text("not valid").wait_for()
    yield Stop("laboratory-token")
    page.locator("[name=token]").fill(ADMIN_TOKEN)
    page.locator("button[type=submit]").click()
    page.get_by_text("of them SIMULATED").wait_for()
    yield Stop("laboratory")


def main() -> int:
    """Take the pictures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.experiment_pages", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        simulate(folder / "photos", preset="still-life", lights=24, size=(400, 300), calibration=False)
        impasto.stack(folder / "photos", folder / "painting.zarr")
        impasto.fit(folder / "painting.zarr")
        experiments = make_experiments(folder / "painting.zarr", folder)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page()
        for stop in walk(page, experiments):
            for width, height in stop.windows:
                show(page, (width, height))
                page.screenshot(path=out / f"{stop.name}-{width}x{height}.png", full_page=True)
        browser.close()
    print(f"{len(list(out.glob('*.png')))} pictures in {out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
