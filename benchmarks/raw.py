"""Raw files with all corrections on, against what cannot be avoided: LibRaw's decoding alone.

`python -m benchmarks.raw decode FOLDER` measures that floor and prints seconds.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from benchmarks.problem import light_directions
from benchmarks.whole import impasto, wake_memory
from numpy.typing import NDArray

from impasto.capture.simulate.dng import write_dng

PHOTOGRAPHS = 40
# Mosaics that differ; the others are further names of these, so that they fill no disk.
MOSAICS = 2
# Share of saturated photosites, as highlights have it.
_SATURATED = 0.002
_CARD, _PAINTING, _CAP = 30_000, 15_000, 40


def write_raws(folder: Path, height: int, width: int, photographs: int = PHOTOGRAPHS) -> Path:
    """Write photographs, a cap shot and a card, and calibrate by these; return the photographs' folder."""
    photos = folder / "photos"
    photos.mkdir(parents=True)
    rng = np.random.default_rng(1)
    names = [f"photo-{number + 1:02d}.dng" for number in range(photographs)]
    for number, name in enumerate(names):
        if number < MOSAICS:
            write_dng(photos / name, _picture(rng, _PAINTING, (height, width)), exposure_s=0.02)
        else:
            os.link(photos / names[number % MOSAICS], photos / name)
    directions = light_directions()[:photographs]
    lights = [f"{name} {x:.9f} {y:.9f} {z:.9f}" for name, (x, y, z) in zip(names, directions, strict=True)]
    (photos / "lights.lp").write_text("\n".join([str(len(names)), *lights]) + "\n", encoding="utf-8")
    write_dng(folder / "cap.dng", _picture(rng, _CAP, (height, width), saturated=0), exposure_s=0.02)
    write_dng(folder / "card.dng", _picture(rng, _CARD, (height, width), saturated=0), exposure_s=0.02)
    (folder / "white").mkdir()
    os.link(folder / "card.dng", folder / "white" / names[0])
    box = f"{width // 3},{height // 3},{width // 2},{height // 2}"
    impasto("calibrate", "dark", str(folder / "cap.dng"), str(folder / "dark.json"))
    impasto("calibrate", "flat", str(folder / "card.dng"), str(folder / "flat.json"))
    impasto("calibrate", "white", str(folder / "white"), str(folder / "white.json"), "--box", box,
            "--lights", str(photos / "lights.lp"))  # fmt: skip
    return photos


def _picture(
    rng: np.random.Generator, level: int, size: tuple[int, int], saturated: float = _SATURATED
) -> NDArray[np.uint16]:
    """Return an even grey that darkens towards the corners, with noise and patches that are saturated."""
    down, across = (np.linspace(-1, 1, length, dtype=np.float32) for length in size)
    image = level * (1 - 0.15 * (down[:, None, None] ** 2 + across[None, :, None] ** 2))
    image = image + np.sqrt(level) * rng.standard_normal((*size, 3), np.float32)
    blocks = rng.random((-(-size[0] // 16), -(-size[1] // 16))) < saturated
    image[np.kron(blocks, np.ones((16, 16), bool))[: size[0], : size[1]]] = 65535
    return np.clip(image, 0, 65535).astype(np.uint16)


def measure(folder: Path, height: int, width: int, photographs: int = PHOTOGRAPHS) -> dict[str, float]:
    """Time decoding alone, twice, and `impasto stack` between, on photographs that are written here."""
    photos, store = write_raws(folder, height, width, photographs), folder / "raw.zarr"
    os.sync()  # writing the photographs is not part of the way
    memory = photographs * height * width * 6 + (1 << 30)  # of the stack's files and the process
    wake_memory(memory)
    before = _decoding(photos)
    corrections = [f"--{kind}={folder / kind}.json" for kind in ("dark", "flat", "white")]
    wake_memory(memory)
    stack = impasto("stack", str(photos), str(store), *corrections)
    wake_memory(memory)
    after = _decoding(photos)
    shutil.rmtree(folder)
    decoding = {name: (before[name] + after[name]) / 2 for name in before}
    return {
        "megapixels": height * width / 1e6,
        "stack_s": stack["wall_s"],
        "decode_s": decoding["wall_s"],
        "ratio": stack["wall_s"] / decoding["wall_s"],
        "cpu_ratio": stack["cpu_s"] / decoding["cpu_s"],
        "peak_gb": stack["peak_gb"],
    }


def _decoding(photos: Path) -> dict[str, float]:
    command = [sys.executable, "-m", "benchmarks.raw", "decode", str(photos)]
    result: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return result


def _decode(files: list[Path]) -> dict[str, float]:
    """Decode every file on all cores by LibRaw with impasto's settings, and throw the pixels away."""
    import rawpy

    from impasto.capture.raw import development

    def decode(file: Path) -> int:
        with rawpy.imread(str(file)) as raw:
            return int(raw.postprocess(**development()).size)

    started, used = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(decode, files))
    return {"wall_s": time.perf_counter() - started, "cpu_s": time.process_time() - used}


if __name__ == "__main__":
    print(json.dumps(_decode(sorted(Path(sys.argv[2]).glob("*.dng")))))
