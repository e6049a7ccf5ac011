"""Captures to stack, and ways to compare and to damage stores."""

import hashlib
import json
from contextlib import contextmanager

import numpy as np
import tifffile

from impasto.geometry import dome_direction


def write_capture(folder, images, transfer=None):
    """Write photographs (a list of arrays) with their lights on a spiral, and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for number, image in enumerate(images):
        zenith, azimuth = 0.2 + 0.8 * number / max(len(images) - 1, 1), 2.4 * number
        x, y, z = dome_direction(zenith, azimuth)
        name = f"light{number:02d}.tif"
        photometric = "rgb" if image.ndim == 3 and image.shape[2] == 3 else "minisblack"
        tifffile.imwrite(folder / name, image, photometric=photometric, rowsperstrip=64)
        rows.append(f"{name} {x:.9f} {y:.9f} {z:.9f}")
    (folder / "lights.lp").write_text("\n".join([str(len(rows)), *rows]) + "\n")
    return folder


def noise_images(count, height, width, channels=3, dtype=np.uint16, seed=0):
    """Return images that no compression shrinks much."""
    rng = np.random.default_rng(seed)
    top = 200 if dtype == np.uint8 else 50000
    shape = (height, width, channels) if channels > 1 else (height, width)
    return [rng.integers(5, top, shape).astype(dtype) for _ in range(count)]


def contents(store):
    """Return path and digest of every file of a store; equal for stores that are equal byte by byte."""
    return {
        str(path.relative_to(store)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(store.rglob("*"))
        if path.is_file()
    }


def flip_byte(path, position):
    """Change one byte of a file."""
    data = bytearray(path.read_bytes())
    data[position] ^= 0x10
    path.write_bytes(bytes(data))


def photograph(store, light):
    """Return the shard of a photograph in a stack."""
    return store / "stack" / "radiance" / "c" / str(light) / "0" / "0" / "0"


def chunks_in(shard, count):
    """Return offset and size of each of the `count` chunks of a shard, by the index at its end."""
    return np.frombuffer(shard.read_bytes()[-4 - 16 * count : -4], "<u8").reshape(count, 2).tolist()


def attributes(group):
    """Return the attributes of a group or array."""
    return json.loads((group / "zarr.json").read_text())["attributes"]


def change_attributes(group, change):
    """Change the attributes of a group or array by a function of them."""
    metadata = json.loads((group / "zarr.json").read_text())
    change(metadata["attributes"])
    (group / "zarr.json").write_text(json.dumps(metadata))


def fit_attributes(model, **more):
    """Return attributes of a fit that was not computed."""
    return {
        "program": "impasto",
        "version": "0",
        "model": model,
        "procedure": "joint",
        "index_of_refraction": 1.5,
        "fresnel": "facet",
        "options": {"exclude": []},
        "light_rgb": [1.0, 1.0, 1.0],
        "photographs": 4,
        "settings_sha256": "none",
        "pixels": {},
        "clipped_samples": 0,
        **more,
    }


@contextmanager
def largest_file(size):
    """Let no file grow beyond `size` bytes: to a program this is a full disk."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
