"""The light's colour from highlights: right under coloured lights, silent where there is no evidence."""

import json

import numpy as np
import pytest
import tifffile

from impasto import store as stores
from impasto.fit import fit
from impasto.geometry import dome_direction, pixel_position_mm
from impasto.stack import stack
from impasto.stack.highlights import separate
from reference_models import radiance
from store_files import attributes, noise_images, write_capture

SIDE = 72
LIGHTS = 18
WARM = np.array([1.25, 1.0, 0.75])
PAINTS = np.array(
    [
        *([0.6, 0.08, 0.06], [0.7, 0.45, 0.08], [0.1, 0.35, 0.12], [0.06, 0.12, 0.5], [0.3, 0.15, 0.08]),
        *([0.75, 0.72, 0.68], [0.1, 0.1, 0.1], [0.45, 0.1, 0.35], [0.12, 0.4, 0.45], [0.4, 0.4, 0.1]),
    ]
)
GOLD = np.array([1.0, 0.72, 0.3])


def write_painting(folder, light_rgb, *, gilded=0.0, glossy=True, paints=PAINTS, near_mm=None):
    """Photograph patches of paint on a relief, a share of them gilded, and return the folder."""
    folder.mkdir()
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    patch = rng.integers(0, len(paints), (9, 9)).repeat(SIDE // 9, 0).repeat(SIDE // 9, 1).ravel()
    normal = np.stack([0.25 * np.sin(x / 5), 0.25 * np.cos(y / 4), np.ones((SIDE, SIDE))], -1).reshape(-1, 3)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    zenith, azimuth = np.linspace(0.15, 1.1, LIGHTS), 2.4 * np.arange(LIGHTS)
    direction = dome_direction(zenith, azimuth)
    settings = {"light_direction": direction}
    if near_mm is not None:
        position = pixel_position_mm(slice(0, SIDE), slice(0, SIDE), SIDE, SIDE, 1.0)
        settings |= {"light_position_mm": near_mm * direction, "position_mm": position}
    lobe = (np.full(SIDE**2, 6.0 if glossy else 0.0), rng.uniform(0.12, 0.3, SIDE**2))
    image = radiance("torrance-sparrow", normal, paints[patch], *lobe, light_rgb=np.ones(3), **settings)
    is_gold = (x < gilded * SIDE).ravel()
    body = np.tile(0.2 * GOLD, (SIDE**2, 1))
    gold = radiance("torrance-sparrow", normal, body, *lobe, light_rgb=8 * GOLD, **settings)
    image = np.where(is_gold[:, None], gold, image) * light_rgb * 0.35
    image *= 1 + 0.004 * rng.standard_normal(image.shape)
    lights = []
    for number, values in enumerate(image):
        name = f"light{number:02d}.tif"
        values = np.clip(values * 65535, 0, 65535).astype(np.uint16).reshape(SIDE, SIDE, 3)
        tifffile.imwrite(folder / name, values, photometric="rgb")
        key, place = ("direction", direction) if near_mm is None else ("position_mm", near_mm * direction)
        lights.append(f'[[light]]\nfile = "{name}"\n{key} = {place[number].tolist()}\n')
    (folder / "lights.toml").write_text("[camera]\nmm_per_px = 1.0\n\n" + "\n".join(lights))
    return folder


def estimate(tmp_path, light_rgb, **painting):
    path = tmp_path / "s.zarr"
    stack(write_painting(tmp_path / "photos", light_rgb, **painting), path)
    return path, stores.open_stack(path)


@pytest.mark.parametrize("light_rgb", [WARM, [0.6, 1.3, 1.1]])
@pytest.mark.parametrize("gilded", [0.0, 1 / 3])
def test_a_coloured_light_is_found_whatever_is_gilded(tmp_path, light_rgb, gilded):
    _, found = estimate(tmp_path, light_rgb, gilded=gilded)
    expected = np.asarray(light_rgb) / np.mean(light_rgb)
    np.testing.assert_allclose(found.light_rgb, expected, rtol=0.02)
    assert found.light_rgb_source.startswith("estimated from ")


@pytest.mark.parametrize("gilded", [0.0, 1 / 3])
def test_a_neutral_light_stays_neutral(tmp_path, gilded):
    _, found = estimate(tmp_path, np.ones(3), gilded=gilded)
    assert found.light_rgb.tolist() == [1, 1, 1]
    assert found.light_rgb_source.startswith("estimated from ")


@pytest.mark.parametrize(
    "painting",
    [{"glossy": False}, {"paints": PAINTS[:1]}, {"paints": PAINTS[5:6]}, {"gilded": 1.0}],
    ids=["matte", "one red paint", "one white paint", "all gold"],
)
def test_without_evidence_the_light_is_taken_to_be_white(tmp_path, painting):
    path, found = estimate(tmp_path, WARM, **painting)
    assert found.light_rgb.tolist() == [1, 1, 1]
    assert found.light_rgb_source == "assumed white"
    assert "taken to be neutral in the photographs: " in attributes(path / "stack")["notes"][-1]


def test_near_lights_are_seen_from_each_pixel(tmp_path):
    _, found = estimate(tmp_path, WARM, near_mm=90)
    np.testing.assert_allclose(found.light_rgb, WARM / WARM.mean(), rtol=0.02)


def test_grey_photographs_have_no_colour_to_tell(tmp_path):
    grey = write_capture(tmp_path / "photos", noise_images(8, 40, 40, channels=1))
    summary = stack(grey, tmp_path / "s.zarr")
    assert stores.open_stack(tmp_path / "s.zarr").light_rgb.tolist() == [1]
    assert not any("neutral" in note for note in summary.notes)


def test_the_specular_term_takes_the_colour(tmp_path):
    path, found = estimate(tmp_path, WARM)
    summary = fit(path, models=["torrance-sparrow"])
    assert any(f"colour of the light, {found.light_rgb[0]:g} " in note for note in summary.notes)
    with_colour = np.median(maps(path)["chi2_reduced"])
    assert attributes(path / "fits" / "torrance-sparrow")["light_rgb"] == found.light_rgb.tolist()
    document = path / "stack" / "zarr.json"
    metadata = json.loads(document.read_text())
    metadata["attributes"]["light_rgb"] = [1.0, 1.0, 1.0]
    document.write_text(json.dumps(metadata))
    fit(path, models=["torrance-sparrow"], overwrite=True)
    assert with_colour < 0.2 * np.median(maps(path)["chi2_reduced"])


def maps(path):
    return stores.read_fit(path, "torrance-sparrow", slice(0, SIDE), slice(0, SIDE))


def test_the_icon_is_lit_neutrally(shared, tmp_path):
    """Its gilding is not: half of the picture has golden highlights."""
    stack(shared / "captures" / "icon", tmp_path / "s.zarr")
    np.testing.assert_allclose(stores.open_stack(tmp_path / "s.zarr").light_rgb, 1, atol=0.01)


def test_highlights_of_any_lobe_and_normal_have_the_colour_of_the_light():
    rng = np.random.default_rng(0)
    direction = dome_direction(np.linspace(0.1, 0.7, 14), 2.4 * np.arange(14))
    normal = dome_direction(rng.uniform(0, 0.4, 200), rng.uniform(0, 6, 200))
    body, light_rgb = rng.uniform(0.05, 0.8, (200, 3)), np.array([0.9, 1.0, 1.1])
    matte = np.clip(normal @ direction.T, 0, None)[..., None] * body[:, None]
    lobe = np.zeros((200, 14))
    lobe[np.arange(200), rng.integers(0, 14, 200)] = 3.0
    lobe += rng.uniform(0, 0.01, lobe.shape)  # and a little of it everywhere
    seen = matte + lobe[..., None] * light_rgb
    found = separate(seen, np.ones((200, 14), bool), direction[None], 1e-4)
    assert len(found.excess) == 200
    ratio = found.excess / light_rgb
    np.testing.assert_allclose(ratio / ratio.mean(axis=1, keepdims=True), 1, atol=1e-5)
    # A matte surface has none.
    assert len(separate(matte, np.ones((200, 14), bool), direction[None], 1e-4).excess) == 0


def test_samples_that_are_not_usable_do_not_matter():
    rng = np.random.default_rng(1)
    direction = dome_direction(np.linspace(0.1, 0.7, 14), 2.4 * np.arange(14))
    seen = np.broadcast_to(direction[:, 2:], (1, 14, 3)) * [0.2, 0.4, 0.6] + np.eye(14)[3][:, None] * 2
    usable = np.ones((1, 14), bool)
    usable[0, 7] = False
    first = separate(seen, usable, direction[None], 1e-4)
    seen = seen.copy()
    seen[0, 7] = rng.uniform(5, 9, 3)
    second = separate(seen, usable, direction[None], 1e-4)
    np.testing.assert_array_equal(first.excess, second.excess)
    np.testing.assert_allclose(first.excess, 2, rtol=1e-4)
    seen[0, 7] = np.nan
    np.testing.assert_array_equal(separate(seen, usable, direction[None], 1e-4).excess, first.excess)
    usable[0, 5:] = False
    assert len(separate(seen, usable, direction[None], 1e-4).excess) == 0
