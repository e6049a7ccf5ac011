"""Captures on an arm: photographs of surfaces whose normals and reflectance are known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tifffile
from tests.reference_models import radiance

import impasto
from impasto.geometry import dome_direction, tilt_direction

ARM_DEG = np.arange(-72, 73, 4.0)
VIEW_PHI_DEG = 5.0


@dataclass
class Scene:
    """The truth of a capture: normals (H, W, 3), tilts θ and φ in the arm's frame (H, W), and its store."""

    normal: np.ndarray
    theta: np.ndarray
    phi: np.ndarray
    mean_radiance: float
    store: Path


def tilts(spread_deg, height=32, width=48, seed=0):
    """Return tilts θ and φ of a bumpy surface, radians, two ndarrays of shape (height, width)."""
    rng = np.random.default_rng(seed)
    return np.radians(spread_deg) * rng.standard_normal((2, height, width))


def arm(azimuth_deg=0.0, arm_deg=ARM_DEG):
    """Return light directions on an arm at an azimuth, shape (L, 3)."""
    zenith = np.radians(arm_deg)
    return dome_direction(np.abs(zenith), np.radians(azimuth_deg) + np.where(zenith < 0, np.pi, 0.0))


def view(azimuth_deg=0.0, phi_deg=VIEW_PHI_DEG):
    """Return a view tilted out of the plane of an arm at an azimuth, shape (3,)."""
    return turned(tilt_direction(0.0, np.radians(phi_deg)), azimuth_deg)


def turned(direction, azimuth_deg):
    """Turn directions (..., 3) about Z."""
    cosine, sine = np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg))
    return direction @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])


def store_images(folder, images, lights, view_direction, *, clip_level=None, near=False):
    """Stack photographs (L, H, W, C) taken under lights (L, 3), and return the store."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = [
        "[camera]",
        f"view = {list(map(float, view_direction))}",
        "mm_per_px = 0.1",
        "[photographs]",
        "transfer = 'linear'",
        "noise = { read = 1e-4, photon = 0, relative = 0.005 }",
    ]
    if clip_level is not None:
        entries.append(f"clip_level = {clip_level}")
    for number, (image, light) in enumerate(zip(images, lights, strict=True)):
        kind = "rgb" if image.shape[-1] == 3 else "minisblack"
        tifffile.imwrite(folder / f"arm{number:02d}.tif", image.astype(np.float32), photometric=kind)
        place = (
            f"position_mm = {[500 * float(x) for x in light]}"
            if near
            else f"direction = {list(map(float, light))}"
        )
        entries.append(f"[[light]]\nfile = 'arm{number:02d}.tif'\n{place}")
    (folder / "lights.toml").write_text("\n".join(entries))
    store = folder.with_name(f"{folder.name}.zarr")
    impasto.stack(folder, store, show_progress=False)
    return store


def make_scene(
    folder,
    *,
    model="torrance-sparrow",
    shape=0.1,
    specular=20.0,
    diffuse=(0.3, 0.2, 0.1),
    ambient=None,
    **options,
):
    """Stack photographs of a bumpy or flat surface of one of the models; options as for `photograph`."""

    def reflect(normal, lights, camera):
        pixels = len(normal)
        return radiance(
            model,
            normal,
            np.tile(diffuse, (pixels, 1)),
            np.full(pixels, specular),
            np.full(pixels, shape),
            None if ambient is None else np.full((pixels, 3), ambient),
            light_direction=lights,
            view_direction=camera,
        )

    return photograph(folder, reflect, **options)


def photograph(
    folder,
    reflect,
    *,
    spread_deg=4.0,
    azimuth_deg=0.0,
    arm_deg=ARM_DEG,
    view_phi_deg=VIEW_PHI_DEG,
    noise=0.005,
    **options,
):
    """Stack photographs of a surface, and return what is true of it.

    `reflect` takes normals (N, 3), light directions (L, 3) and the view (3,) and returns radiance (L, N, C).
    """
    theta, phi = tilts(spread_deg)
    normal = turned(tilt_direction(theta, phi), azimuth_deg)
    lights, camera = arm(azimuth_deg, arm_deg), view(azimuth_deg, view_phi_deg)
    images = reflect(normal.reshape(-1, 3), lights, camera)
    images = images * (1 + noise * np.random.default_rng(1).standard_normal(images.shape))
    images = images.reshape(len(lights), *theta.shape, -1)
    store = store_images(folder, images, lights, camera, **options)
    return Scene(normal, theta, phi, float(images.mean()), store)
