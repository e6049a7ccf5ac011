"""Fixtures that every test may use."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# SwiftShader draws WebGL without a graphics card, the same on every machine.
CHROMIUM_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of reference figures and photographs beside the checkout, or skip."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip("the reference figures and photographs (../shared) are not on this machine")
    return folder


def _absent(reason: str) -> None:
    # Where a machine tests every change, nothing may be left out unseen.
    (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)


@pytest.fixture(scope="session")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of 16 small simulated photographs of 60 x 44 pixels, under a dome of lights."""
    from impasto.capture.simulate import simulate

    folder = tmp_path_factory.mktemp("capture") / "photos"
    simulate(folder, preset="swatches", lights=16, size=(60, 44), calibration=False)
    return folder


@pytest.fixture(scope="session")
def painting(capture: Path) -> Path:
    """Return a store with the stack of `capture` and both default fits; not to be changed."""
    import impasto

    store = capture.with_name("painting.zarr")
    impasto.stack(capture, store)
    impasto.fit(store)
    return store


@pytest.fixture(scope="session")
def web() -> Path:
    """Return the folder of the built pages, or skip."""
    folder = Path(__file__).resolve().parents[1] / "src" / "impasto" / "web"
    if not (folder / "index.html").is_file():
        _absent("the pages are not built: make src/impasto/web/.built")
    return folder


@pytest.fixture(scope="session")
def browser() -> "Iterator[Browser]":
    """Return a browser that draws WebGL2 in software, or skip; make contexts and pages of it as needed."""
    executable = shutil.which("chromium")
    if executable is None:
        _absent("chromium is not installed: make browser")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=executable, args=CHROMIUM_FLAGS)
        yield chromium
        chromium.close()
