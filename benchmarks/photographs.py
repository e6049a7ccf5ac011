"""Write the photographs of a simulated painting as a camera would: 16-bit linear RGB TIFF, zstd."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tifffile
from benchmarks.problem import ALBEDO, C_RANGE, INDEX, KAPPA, MODEL, STEEPEST_DEG, VIEW_DIRECTION, noise_sd
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.stats import rankdata
from tests.reference_models import radiance

BLOCK_PX = 256
# Value of a white diffuser; highlights above 65535 clip.
WHITE = 20_000


@dataclass(frozen=True)
class Capture:
    """A folder of photographs with its light file.

    Parameters
    ----------
    folder : Path
    height, width : int
    files : tuple of Path
    """

    folder: Path
    height: int
    width: int
    files: tuple[Path, ...]

    @property
    def pixels(self) -> int:
        return self.height * self.width


def write_capture(folder: Path, light_direction: NDArray[np.float64], height: int, width: int) -> Capture:
    """Photograph a painting of `height` by `width` pixels under each light.

    The painting repeats a block of smooth relief and pigments; the noise never repeats, so that files
    compress, and decode, as badly as real ones.
    """
    folder.mkdir(parents=True)
    clean = _block(light_direction)
    names = [f"photo-{i + 1:02d}.tif" for i in range(len(light_direction))]
    rows = [f"{name} {x:.9f} {y:.9f} {z:.9f}" for name, (x, y, z) in zip(names, light_direction, strict=True)]
    (folder / "lights.lp").write_text("\n".join([str(len(rows)), *rows]) + "\n", encoding="utf-8")
    files = tuple(folder / name for name in names)

    def write(index: int) -> None:
        rng = np.random.default_rng(index)
        image = np.empty((height, width, 3), np.uint16)
        for top in range(0, height, BLOCK_PX):
            for left in range(0, width, BLOCK_PX):
                part = image[top : top + BLOCK_PX, left : left + BLOCK_PX]
                seen = clean[index, : part.shape[0], : part.shape[1]]
                noise = noise_sd(seen).astype(np.float32) * rng.standard_normal(seen.shape, np.float32)
                part[:] = np.clip((seen + noise) * WHITE, 0, 65535)
        tifffile.imwrite(
            files[index], image, photometric="rgb", compression="zstd", compressionargs={"level": 3}
        )

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(write, range(len(files))))
    return Capture(folder, height, width, files)


def _block(light_direction: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the radiance of one block under each light, shape (L, BLOCK_PX, BLOCK_PX, 3)."""
    rng = np.random.default_rng(1)

    def smooth(low: float, high: float, width_px: float) -> NDArray[np.float64]:
        """Return a periodic map (pixel,), spread evenly from `low` to `high`."""
        noise = gaussian_filter(rng.standard_normal((BLOCK_PX, BLOCK_PX)), width_px, mode="wrap")
        return low + (high - low) * (rankdata(noise) - 0.5) / noise.size

    slope = np.tan(np.radians(STEEPEST_DEG)) / np.sqrt(2)
    normal = np.stack([smooth(-slope, slope, 4), smooth(-slope, slope, 4), np.ones(BLOCK_PX**2)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    c = np.exp(smooth(*np.log(C_RANGE), 12))
    seen = radiance(
        MODEL,
        normal,
        np.stack([smooth(*ALBEDO, 8) for _ in range(3)], axis=-1),
        smooth(*KAPPA, 12) / (4 * c**2),
        c,
        light_direction=light_direction,
        view_direction=VIEW_DIRECTION,
        index=INDEX,
    )
    return seen.reshape(-1, BLOCK_PX, BLOCK_PX, 3).astype(np.float32)
