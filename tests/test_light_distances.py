"""Distances of lights, found from photographs of a painting of which the truth is known."""

import json
import shutil
import sys
from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest
import zarr

import impasto
from impasto.capture.simulate.lamps import dome_lights
from impasto.colour import encode_srgb
from impasto.evaluate.held_out import spread_lights
from impasto.evaluate.shares import Photographed, error_shares
from impasto.fit import FitOptions
from impasto.fit.self_calibration import found_lights, self_calibrate
from impasto.geometry import Camera, Lights
from impasto.light_distance import place_lights, without_distance
from impasto.models import parse_model
from impasto.publish.publication import Publication
from impasto.render import render_bands
from impasto.store import open_fit, open_published, open_stack

MODEL = "torrance-sparrow"
SIZE = (128, 96)
EXTENT_MM = 100 * 128 / 96
HELD = 5


def stacked(folder, lights):
    """Return a store with simulated photographs under lights, whose positions it does not state."""
    impasto.simulate(folder / "photos", lights=lights, size=SIZE)
    impasto.stack(folder / "photos", folder / "painting.zarr")
    store = folder / "painting.zarr"
    position = zarr.open_array(store / "stack" / "light_position_mm", mode="r+")
    position[...] = np.full(position.shape, np.nan)
    return store


def at(distance):
    """Return 60 lights at distances over the painting's longer side."""
    lights = dome_lights(60)
    return replace(lights, position_mm=lights.direction * np.reshape(distance, (-1, 1)) * EXTENT_MM)


@pytest.fixture(scope="module")
def near(tmp_path_factory):
    """Return a store of lights at 1.5 times the painting's longer side, stated as distant."""
    return stacked(tmp_path_factory.mktemp("near"), at(1.5))


@pytest.fixture(scope="module")
def near_fit(near, tmp_path_factory):
    return fitted(near, tmp_path_factory.mktemp("near-fit"))


@pytest.fixture(scope="module")
def far(tmp_path_factory):
    """Return a store of distant lights."""
    return stacked(tmp_path_factory.mktemp("far"), dome_lights(60))


def fitted(store, tmp_path, **options):
    """Return the fit of a copy of a store, without the lights that are held out."""
    copy = tmp_path / "copy.zarr"
    shutil.copytree(store, copy, dirs_exist_ok=True)
    options = {"residual": True, "exclude": held_out(store), "calibrate_directions": False, **options}
    impasto.fit(copy, models=[MODEL], options=FitOptions(**options), overwrite=True)
    return open_fit(copy, MODEL)


def held_out(store):
    lights = open_stack(store).lights
    return tuple(lights.names[index] for index in spread_lights(lights, HELD))


def distances(fit):
    return fit.attributes["self_calibration"].get("distances")


def bowl_deg(fit, photos):
    """Return by how many degrees normals turn from one side of the painting to the other that should not."""
    truth = oiio.ImageInput.open(str(photos / "truth" / "normal.exr")).read_image("float")
    normal = fit.read(slice(0, SIZE[1]), slice(0, SIZE[0]), ["normal"])["normal"]
    error = np.degrees(np.nanmean((normal - truth)[..., 0], axis=0))
    return np.polyfit(np.linspace(-0.5, 0.5, SIZE[0]), error, 1)[0]


def psnr_db(fit):
    """Return how close the photographs that are held out are met, in the mean."""
    stack = open_stack(fit.store)
    index = spread_lights(stack.lights, HELD)
    (band,) = render_bands(fit, stack.lights.select(index), stack.camera)
    photographs = stack.radiance(slice(0, SIZE[1]), slice(0, SIZE[0]), index)
    error = encode_srgb(band.radiance) - encode_srgb(photographs)
    return -10 * np.log10(np.square(error).mean(axis=(1, 2, 3))).mean()


def test_one_distance_of_all_lights_is_found(near, near_fit, tmp_path):
    found = distances(near_fit)
    assert found["used"] == "common"
    assert found["common"] == pytest.approx(1.5, rel=0.02)
    assert found["left_out_db"]["common"] > found["left_out_db"]["stated"] + 3.0
    as_stated = fitted(near, tmp_path, calibrate_distances=False)
    assert bowl_deg(as_stated, near.parent / "photos") > 20.0
    assert abs(bowl_deg(near_fit, near.parent / "photos")) < 0.5
    assert psnr_db(near_fit) > psnr_db(as_stated) + 3.0


def test_a_distance_of_each_light_is_found(tmp_path):
    rng = np.random.default_rng(6)
    true = 2.0 * np.exp(0.2 * rng.standard_normal(60))
    store = stacked(tmp_path, at(true))
    fit = fitted(store, tmp_path, exclude=())
    found = distances(fit)
    assert found["used"] == "own"
    off = np.log(np.array(found["own"]) / true)
    assert np.sqrt(np.square(off).mean()) < 0.06
    assert abs(bowl_deg(fit, tmp_path / "photos")) < 1.0


def test_a_fit_says_where_and_how_strong_it_took_its_lights_to_be(tmp_path, monkeypatch):
    rng = np.random.default_rng(6)
    store = stacked(tmp_path, at(1.5 * np.exp(0.2 * rng.standard_normal(60))))
    direction = zarr.open_array(store / "stack" / "light_direction", mode="r+")
    turned = direction[...] + np.radians(2.0) * rng.standard_normal(direction.shape)
    direction[...] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    made = []

    def kept(*arguments, **options):
        made.append(self_calibrate(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(sys.modules["impasto.fit.joint"], "self_calibrate", kept)
    fit = fitted(store, tmp_path, exclude=(), calibrate_directions=True)
    calibration = fit.attributes["self_calibration"]
    assert calibration["distances"]["used"] == "own"
    assert calibration["directions"]["used"]
    found = found_lights(fit.attributes, open_stack(store).lights, EXTENT_MM)
    np.testing.assert_allclose(found.direction, made[-1].lights.direction, atol=1e-6)
    np.testing.assert_allclose(found.position_mm, made[-1].lights.position_mm, rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(found.intensity, made[-1].lights.intensity, rtol=1e-4)


def test_distances_smooth_over_direction_are_told_to_other_lights(tmp_path):
    # A dome around a place beside the painting.
    position = (2.0 * dome_lights(60).direction + [0.5, 0.3, 0.0]) * EXTENT_MM
    direction = position / np.linalg.norm(position, axis=1, keepdims=True)
    store = stacked(tmp_path, replace(dome_lights(60), direction=direction, position_mm=position))
    fit = fitted(store, tmp_path)
    index = spread_lights(open_stack(store).lights, HELD)
    placed, _ = place_lights(fit.attributes, SIZE, open_stack(store).lights.select(index), Camera())
    off = np.log(np.linalg.norm(placed.position_mm, axis=1) / SIZE[0])
    off -= np.log(np.linalg.norm(position[index], axis=1) / EXTENT_MM)
    one = np.log(distances(fit)["common"] * EXTENT_MM / np.linalg.norm(position[index], axis=1))
    assert np.sqrt(np.square(off).mean()) < 0.6 * np.sqrt(np.square(one).mean())


def test_distant_lights_are_left_alone(far, tmp_path):
    found, kept = fitted(far, tmp_path / "found"), fitted(far, tmp_path / "kept", calibrate_distances=False)
    assert distances(found) == {"used": "stated"}
    assert distances(kept) is None
    everything = (slice(0, SIZE[1]), slice(0, SIZE[0]))
    for name in found.names:
        np.testing.assert_array_equal(found.read(*everything)[name], kept.read(*everything)[name])


def test_the_scale_of_the_picture_changes_nothing(near, near_fit, tmp_path):
    plain = tmp_path / "plain.zarr"
    shutil.copytree(near, plain)
    path = plain / "stack" / "zarr.json"
    document = json.loads(path.read_text())
    assert document["attributes"]["camera"]["mm_per_px"] is not None
    document["attributes"]["camera"]["mm_per_px"] = None
    path.write_text(json.dumps(document))
    without = fitted(plain, tmp_path)
    assert distances(without)["common"] == pytest.approx(distances(near_fit)["common"], rel=1e-3)
    assert psnr_db(without) == pytest.approx(psnr_db(near_fit), abs=0.01)


def test_few_lights_do_not_tell_their_distances(near, tmp_path):
    assert distances(fitted(near, tmp_path, exclude=open_stack(near).lights.names[20:])) is None


def test_positions_that_are_stated_stay(near, tmp_path):
    store = tmp_path / "stated.zarr"
    shutil.copytree(near, store)
    position = zarr.open_array(store / "stack" / "light_position_mm", mode="r+")
    position[...] = at(1.5).position_mm
    assert distances(fitted(store, tmp_path)) is None


def test_distant_light_comes_from_as_far_as_stated(near_fit, tmp_path):
    impasto.render(near_fit.store, model=MODEL, light=[(60, 0)], out=tmp_path / "near", raw=True)
    impasto.render(
        near_fit.store, model=MODEL, light=[(60, 0)], out=tmp_path / "far", raw=True, distant_light=True
    )
    left, right = (
        oiio.ImageInput.open(str(next((tmp_path / name).glob("*.exr")))).read_image("float").mean(axis=(0, 2))
        for name in ("near", "far")
    )
    ratio = left / right
    # From the right: |p|² / |p − x|² at the painting's sides, and the cosine, which falls like |p| / |p − x|.
    place = np.array([-0.5, 0.5])[:, None] * [1.0, 0.0, 0.0]
    lamp = 1.5 * np.array([np.sin(np.radians(60)), 0.0, np.cos(np.radians(60))])
    expected = (1.5 / np.linalg.norm(lamp - place, axis=1)) ** 3
    np.testing.assert_allclose(ratio[[2, -3]], expected, rtol=0.1)


def test_lights_of_published_photographs_are_left_to_each_model(near_fit):
    attributes = Publication(near_fit.store).attributes
    assert all(light["position_mm"] is None for light in attributes["photographs"]["lights"])
    (model,) = attributes["models"]
    assert model["self_calibration"]["distances"]["told"] == distances(near_fit)["told"]


def test_a_published_store_puts_other_lights_there_too(near_fit, tmp_path):
    impasto.publish(near_fit.store, tmp_path / "site")
    lights = Lights(("other",), [[0.6, 0.0, 0.8]])
    (band,), (published,) = (
        render_bands(fit, lights, stack.camera, residual=False)
        for fit, stack in (
            (near_fit, open_stack(near_fit.store)),
            open_published(tmp_path / "site" / "painting.zarr", MODEL),
        )
    )
    np.testing.assert_allclose(published.radiance, band.radiance, rtol=0.02, atol=1e-3)


def test_the_shares_of_the_error_know_the_distances(near_fit):
    stack = open_stack(near_fit.store)

    def shares(fit):
        seen = Photographed.of(fit, stack, spread_lights(stack.lights, HELD))
        return error_shares(parse_model(MODEL), seen, FitOptions())

    found = shares(near_fit)
    distant = shares(replace(near_fit, attributes=without_distance(near_fit.attributes)))
    assert found.rms < 0.5 * distant.rms
    assert found.lights < 0.1


def test_lights_with_a_position_keep_it():
    told = {"self_calibration": {"distances": {"told": {"distance": 2.0}}}}
    direction = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    lights = Lights(("far", "near"), direction, position_mm=[[np.nan] * 3, [6.0, 0.0, 8.0]])
    placed, camera = place_lights(told, (50, 100), lights, Camera(mm_per_px=0.1))
    np.testing.assert_allclose(placed.position_mm, [[0.0, 0.0, 20.0], [6.0, 0.0, 8.0]])
    assert camera.mm_per_px == 0.1
    _, camera = place_lights(told, (50, 100), lights, Camera())
    assert camera.mm_per_px == 1.0
    assert place_lights(without_distance(told), (50, 100), lights, Camera())[0] is lights
    assert place_lights({}, (50, 100), lights, Camera())[0] is lights
