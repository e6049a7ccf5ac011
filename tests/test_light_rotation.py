"""Lights that are all rotated about the painting's normal, which only neighbouring pixels tell."""

import numpy as np
import pytest

import impasto
from impasto.fit import streaming
from impasto.fit.light_rotation import find_rotation, rotated
from impasto.fit.sample import sample_pixels
from impasto.geometry import Lights
from impasto.store import open_stack

# Errors so large that the prior says nothing.
ANY = 1000.0


@pytest.fixture(scope="module")
def lights():
    zenith, azimuth = np.radians(np.linspace(20, 80, 60)), 2.4 * np.arange(60)
    direction = np.stack(
        [np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], axis=1
    )
    names = tuple(str(number) for number in range(60))
    return Lights(names, direction, intensity=np.full((60, 3), 2.0))


def photographed(slope_x, slope_y, lights, noise=0.0):
    """Return the radiance (L, M, 4) of white paint around points of a surface with slopes at (x, y)."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0, 100, (2, 500, 1)) + np.array([[0, 1, 0, -1], [1, 0, -1, 0]])[:, None]
    normal = np.stack([-slope_x(x, y), -slope_y(x, y), np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=0)
    radiance = np.maximum(np.einsum("lx,xmk->lmk", lights.direction, normal), 0.0) * lights.intensity[0, 0]
    return radiance + noise * rng.standard_normal(radiance.shape)


def waves(lights, **options):
    return photographed(
        lambda x, y: 0.2 * np.cos(x / 5) * np.sin(y / 7),
        lambda x, y: 0.2 * 5 / 7 * np.sin(x / 5) * np.cos(y / 7),
        lights,
        **options,
    )


@pytest.mark.parametrize("angle_deg", [-3.0, 0.0, 1.0, 20.0])
def test_rotated_lights_are_told_by_neighbours(lights, angle_deg):
    photographs = waves(lights)
    photographs[3, 10] = np.nan
    stated = rotated(lights, -np.radians(angle_deg))
    found = find_rotation(photographs, stated, ANY)
    np.testing.assert_allclose(np.degrees(found), angle_deg, atol=0.05)
    np.testing.assert_allclose(rotated(stated, found).direction, lights.direction, atol=1e-3)


def test_errors_that_are_small_rotate_little(lights):
    stated = rotated(lights, -np.radians(1.0))
    found = [find_rotation(waves(lights, noise=0.02), stated, error) for error in (0.1, 1.0, ANY)]
    assert 0.0 < found[0] < found[1] / 2 < found[2] / 2


def test_what_is_no_relief_tells_nothing(lights):
    rng = np.random.default_rng(2)
    stated = rotated(lights, -np.radians(5.0))
    noise = photographed(*(lambda x, y: 0.05 * rng.standard_normal(x.shape) for _ in range(2)), lights)
    flat = [photographed(*2 * [lambda x, y: np.zeros_like(x)], lights, noise=size) for size in (0.02, 0.0)]
    for photographs in (noise, *flat):
        assert abs(np.degrees(find_rotation(photographs, stated, 2.0))) < 0.1


def test_few_lights_or_neighbours_tell_nothing(lights):
    stated, photographs = rotated(lights, 0.1), waves(lights)
    few = np.arange(0, 60, 6)
    assert find_rotation(photographs[few], stated.select(few), ANY) == 0.0
    assert find_rotation(photographs[:, :20], stated, ANY) == 0.0
    assert find_rotation(np.full_like(photographs, np.nan), stated, ANY) == 0.0


def test_crosses_are_neighbours_however_tiles_are_cut(tmp_path, monkeypatch):
    impasto.simulate(tmp_path / "photos", dome=True, lights=6, size=(90, 71))
    impasto.stack(tmp_path / "photos", tmp_path / "store.zarr")
    stack = open_stack(tmp_path / "store.zarr")
    whole = stack.radiance(slice(0, 71), slice(0, 90), np.arange(6))
    row, column = np.arange(2, 70, 4), np.arange(2, 89, 4)
    around = [(row - 1, column), (row, column + 1), (row + 1, column), (row, column - 1)]
    expected = np.stack([whole[:, down][:, :, right] for down, right in around], axis=3)
    for tile_bytes in (1, streaming._TILE_BYTES):
        monkeypatch.setattr(streaming, "_TILE_BYTES", tile_bytes)
        crosses = sample_pixels(stack, range(6), False).crosses * stack.scale + stack.offset
        np.testing.assert_allclose(crosses, expected.reshape(6, -1, 4, 3), rtol=1e-6)
