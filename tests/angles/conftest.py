"""A glossy canvas photographed on an arm every 2°, of which every second photograph is kept to judge."""

from pathlib import Path

import pytest

import impasto
from impasto.store import open_stack


@pytest.fixture(scope="session")
def arm_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a store with the stack of 73 photographs of sample (h), 64 x 48 pixels, and no fit."""
    folder = tmp_path_factory.mktemp("angles") / "h"
    impasto.simulate(folder, sample="h", arm=True, lights=73, size=(64, 48), format="exr", calibration=False)
    store = folder.with_name("h.zarr")
    impasto.stack(folder, store, show_progress=False)
    return store


@pytest.fixture(scope="session")
def interleaved(arm_store: Path) -> list[str]:
    """Return the names of every second photograph."""
    return list(open_stack(arm_store).lights.names[1::2])
