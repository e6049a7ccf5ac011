"""Directions of lights, found from photographs of a painting of which the truth is known."""

import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
import zarr

import impasto
from impasto.fit import FitOptions
from impasto.fit.choice import Choice
from impasto.store import fit_attributes, open_stack

MODEL = "torrance-sparrow"


@pytest.fixture(scope="module")
def relief(tmp_path_factory):
    """Return a store with 60 photographs of a simulated painting, under lights stated as they were."""
    folder = tmp_path_factory.mktemp("relief")
    impasto.simulate(folder / "photos", dome=True, lights=60, size=(128, 96))
    impasto.stack(folder / "photos", folder / "relief.zarr")
    return folder / "relief.zarr"


def misstated(relief, tmp_path, error_deg):
    """Return a copy in which strengths are misstated by 10 % and directions by an angle, and the truth."""
    store = tmp_path / "misstated.zarr"
    shutil.copytree(relief, store)
    rng = np.random.default_rng(5)
    direction = zarr.open_array(store / "stack" / "light_direction", mode="r+")
    true = direction[...]
    stated = true + np.radians(error_deg) * rng.standard_normal(true.shape)
    direction[...] = stated / np.linalg.norm(stated, axis=1, keepdims=True)
    intensity = zarr.open_array(store / "stack" / "light_intensity", mode="r+")
    intensity[...] = intensity[...] * np.exp(0.1 * rng.standard_normal((len(true), 1)))
    return store, true


def directions_found(store, **options):
    impasto.fit(store, models=[MODEL], options=FitOptions(self_calibrate=True, **options), overwrite=True)
    return fit_attributes(store, MODEL)["self_calibration"].get("directions")


def error_deg(found, true):
    cosine = np.sum(np.asarray(found) * true, axis=1)
    return np.sqrt(np.square(np.degrees(np.arccos(np.minimum(cosine, 1.0)))).mean())


def test_directions_that_were_misstated_are_found(relief, tmp_path):
    store, true = misstated(relief, tmp_path, 1.5)
    before = error_deg(open_stack(store).lights.direction, true)
    found = directions_found(store)
    assert found["used"]
    assert found["left_out_db"]["corrected"] > found["left_out_db"]["stated"] + 0.1
    assert error_deg(found["corrected"], true) < 0.6 * before


def test_directions_that_were_far_off_are_found_too(relief, tmp_path):
    store, true = misstated(relief, tmp_path, 5.0)
    before = error_deg(open_stack(store).lights.direction, true)
    found = directions_found(store)
    assert found["used"]
    assert error_deg(found["corrected"], true) < 0.6 * before


def test_lights_that_were_all_rotated_are_rotated_back(relief, tmp_path, monkeypatch):
    store, true = misstated(relief, tmp_path, 1.5)
    direction = zarr.open_array(store / "stack" / "light_direction", mode="r+")
    cosine, sine = np.cos(np.radians(2.0)), np.sin(np.radians(2.0))
    direction[...] = direction[...] @ [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]

    def left_deg(found):
        across = np.cross(true, found)[:, 2].sum() / np.square(true[:, :2]).sum()
        return np.degrees(across)

    assert abs(left_deg(directions_found(store)["corrected"])) < 0.6
    calibration = sys.modules["impasto.fit.self_calibration"]
    monkeypatch.setattr(calibration, "find_rotation", lambda *_: 0.0)
    assert left_deg(directions_found(store)["corrected"]) > 1.5


def test_far_turns_need_a_large_gain(relief, tmp_path, monkeypatch):
    def turned(pixels, lights):
        angle = np.radians(np.where(np.arange(len(lights)) % 2, 5.0, -5.0))
        x, y, z = lights.direction.T
        direction = np.stack(
            [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=1
        )
        return replace(lights, direction=direction)

    store, _ = misstated(relief, tmp_path, 0.0)
    calibration = sys.modules["impasto.fit.self_calibration"]
    monkeypatch.setattr(calibration, "correct_directions", turned)
    needed = []
    monkeypatch.setattr(
        calibration,
        "choose",
        lambda ways, error, worth_db: needed.append(worth_db) or Choice("stated", dict.fromkeys(ways, 0.0)),
    )
    far = directions_found(store)["turned_deg"]
    assert needed[0] > 0.25
    np.testing.assert_allclose(needed, 0.1 * np.square(far).mean() / 4.0, rtol=1e-3)


def test_directions_that_were_right_stay(relief, tmp_path):
    store, true = misstated(relief, tmp_path, 0.0)
    found = directions_found(store)
    assert not found["used"]
    assert error_deg(found["corrected"], true) < 0.7


def test_they_can_be_kept(relief, tmp_path):
    store, _ = misstated(relief, tmp_path, 1.5)
    assert directions_found(store, calibrate_directions=False) is None


def test_few_lights_do_not_tell_their_directions(relief, tmp_path):
    store, _ = misstated(relief, tmp_path, 1.5)
    names = open_stack(store).lights.names
    assert directions_found(store, exclude=names[20:]) is None
