"""Make docs/images/overview.jpg, the picture of the README, from the simulated painting of the demo.

    .venv/bin/python examples/overview_picture.py docs/images/overview.jpg

From the left: a photograph that was kept out of the fit, its rendering, its normals, and the width of its
highlights.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm
from PIL import Image

import impasto
from impasto.colour import encode_srgb, quantise
from impasto.store import open_fit, open_stack

SIZE = (400, 400)
WIDEST_C, NARROWEST_C = 0.6, 0.03
GAP_PX = 6


def main(path: Path) -> None:
    """Run the demo and put four of its pictures side by side."""
    with tempfile.TemporaryDirectory() as folder:
        summary = impasto.demo(Path(folder) / "demo", size=SIZE, say=print)
        stack = open_stack(summary.store)
        # The highest of the held-out lights shows the most highlights.
        chosen = min(summary.evaluated.models[0].lights, key=lambda entry: entry.zenith_deg)
        light = stack.lights.names.index(chosen.name)
        rows, columns = slice(0, SIZE[1]), slice(0, SIZE[0])
        photograph = stack.radiance(rows, columns, [light])[0]
        rendering = np.asarray(Image.open(summary.rendered[0].out / f"{chosen.name}.png"))
        maps = open_fit(summary.store, summary.rendered[0].model).read(rows, columns, ["normal", "c"])
        width = colormaps["viridis"](
            LogNorm(NARROWEST_C, WIDEST_C, clip=True)(np.nan_to_num(maps["c"], nan=1))
        )
        panels = [
            quantise(encode_srgb(photograph, summary.exposure)),
            rendering,
            quantise(np.nan_to_num((maps["normal"] + 1) / 2)),
            quantise(width[..., :3]),
        ]
        gap = np.full((SIZE[1], GAP_PX, 3), 255, np.uint8)
        joined = np.concatenate([part for panel in panels for part in (panel, gap)][:-1], axis=1)
        Image.fromarray(joined).save(path, quality=82, subsampling=0, optimize=True)
        print(path, joined.shape, path.stat().st_size)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
