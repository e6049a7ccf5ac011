"""How the page does with a painting of 20,000 x 15,000 pixels, in a browser that draws in software.

The store is one published tile many times over, so that a gigapixel takes no more disk than a postcard.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from pathlib import Path

from benchmarks.browser import Browser
from tests.conftest import CHROMIUM_FLAGS
from tests.viewer_pages import READY, static_host

import impasto
from impasto.capture.simulate import simulate
from impasto.store import level_sizes

SIZE = (15_000, 20_000)
TILE = 512
PANNING_S = 120
# A browser that has just started is busy with itself.
SETTLING_S = 3
WINDOW = {"width": 1440, "height": 900}
FIRST = """
new Promise(resolve => {
  const look = () => window.first ? resolve(window.first) : setTimeout(look, 20);
  look();
})
"""
VIEWER = "document.querySelector('impasto-viewer')"


def measure(folder: Path, panning_s: float = PANNING_S) -> dict[str, float]:
    """Return seconds and requests until the first picture, and the browser's largest memory while panning.

    Memory is the proportional set size of all processes of the browser, its graphics process included, above
    what they take before the page is opened.
    """
    site = write_large(folder)
    executable = shutil.which("chromium") or "chromium"
    profile = str(folder / "profile")
    with (
        static_host(site) as url,
        Browser(executable, CHROMIUM_FLAGS, profile, **WINDOW) as browser,
    ):
        browser.send(
            "Page.addScriptToEvaluateOnNewDocument",
            source="addEventListener('impasto-ready', e => window.first = e.detail)",
        )
        time.sleep(SETTLING_S)
        before = memory_bytes()
        browser.open(url)
        browser.evaluate(f"({READY})(120)")
        first = browser.evaluate(FIRST)
        browser.evaluate(f"{VIEWER}.hash = 'view=3000,3000,0.5'")
        x, y = WINDOW["width"] / 3, WINDOW["height"] / 2
        largest, frames, end = 0, 0, time.monotonic() + panning_s
        while time.monotonic() < end:
            browser.drag((x + 300, y), (x - 300, y + (40 if frames % 20 < 10 else -40)))
            time.sleep(0.2)
            frames += 1
            if frames % 25 == 0:  # another size, and the other end of the painting
                scale = (1.0, 0.25, 0.5)[frames // 25 % 3]
                place = f"{frames * 397 % 20000},{frames * 211 % 15000}"
                browser.evaluate(f"{VIEWER}.hash = 'view={place},{scale}'")
            largest = max(largest, memory_bytes() - before)
        return {
            "first_s": first["first"] / 1000,
            "whole_s": first["milliseconds"] / 1000,
            "requests": first["requests"],
            "memory_mb": largest / 1e6,
            "empty_browser_mb": before / 1e6,
            "drags": frames,
            "tiles_mb": browser.evaluate(f"{VIEWER}.cacheBytes") / 1e6,
        }


def write_large(folder: Path) -> Path:
    """Publish a tile, and make a published store of `SIZE` of it; return the folder."""
    simulate(folder / "photos", lights=12, size=(TILE, TILE), calibration=False)
    impasto.stack(folder / "photos", folder / "tile.zarr")
    impasto.fit(folder / "tile.zarr", models=["torrance-sparrow"])
    site = folder / "site"
    impasto.publish(folder / "tile.zarr", site)
    store = site / "painting.zarr"
    root = json.loads((store / "zarr.json").read_text())
    sizes = [SIZE, *level_sizes(*SIZE)]
    root["attributes"].update(size=list(SIZE), levels=len(sizes), height=None)
    metadata = root["consolidated_metadata"]["metadata"]
    for kind in ("parameters", "quality"):
        base = f"models/torrance-sparrow/0/{kind}"
        tile = store / base / "c" / "0" / "0" / "0"
        for level, (height, width) in enumerate(sizes):
            path = f"models/torrance-sparrow/{level}/{kind}"
            document = {**metadata[base], "shape": [height, width, metadata[base]["shape"][2]]}
            metadata[path] = document
            for row in range(-(-height // TILE)):
                for column in range(-(-width // TILE)):
                    chunk = store / path / "c" / str(row) / str(column) / "0"
                    chunk.parent.mkdir(parents=True, exist_ok=True)
                    if not chunk.exists():
                        os.link(tile, chunk)
    (store / "zarr.json").write_text(json.dumps(root))
    return site


def memory_bytes() -> int:
    """Return the proportional set size of all processes that this one has started."""
    children: dict[int, list[int]] = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        children.setdefault(int(fields[1]), []).append(int(status.parent.name))
    waiting, total = list(children.get(os.getpid(), ())), 0
    while waiting:
        process = waiting.pop()
        waiting += children.get(process, ())
        try:
            rollup = Path(f"/proc/{process}/smaps_rollup").read_text()
        except OSError:
            continue
        total += next(
            (int(line.split()[1]) << 10 for line in rollup.splitlines() if line.startswith("Pss:")), 0
        )
    return total
