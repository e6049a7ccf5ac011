"""Fixtures that every test may use."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of reference figures and photographs beside the checkout, or skip."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip("the reference figures and photographs (../shared) are not on this machine")
    return folder


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
