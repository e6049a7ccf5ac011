"""Streaming a stack through a fit: every pixel once, interruptions at any moment, and what is refused."""

import multiprocessing
import shutil
import sys
import time
from itertools import count

import numpy as np
import pytest

from impasto import store as stores
from impasto.errors import ImpastoError, OptionError, StoreError
from impasto.fit import FitOptions, fit, streaming
from impasto.geometry import dome_direction
from impasto.stack import stack
from impasto.store import fits
from store_files import (
    attributes,
    chunks_in,
    contents,
    flip_byte,
    largest_file,
    photograph,
    write_capture,
)

HEIGHT, WIDTH = 1100, 1040


def bumpy_images(count, height, width, channels):
    """Return what a rough, matte relief looks like under the lights of `write_capture`, with noise."""
    rng = np.random.default_rng(6)
    y, x = np.mgrid[0:height, 0:width]
    normal = np.stack([0.2 * np.sin(x / 11), 0.2 * np.cos(y / 9), np.ones((height, width))], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    images = []
    for number in range(count):
        light = dome_direction(0.2 + 0.8 * number / max(count - 1, 1), 2.4 * number)
        shading = np.clip(normal @ light, 0, 1)[..., None] * np.linspace(0.3, 0.7, channels)
        image = shading * 65535 * (1 + 0.005 * rng.standard_normal(shading.shape))
        images.append(np.clip(image, 0, 60000).astype(np.uint16))
    return images


@pytest.fixture(scope="module")
def stacked(tmp_path_factory):
    """Return a folder with a store of a grey relief under six lights, several units large."""
    folder = tmp_path_factory.mktemp("stacked")
    stack(write_capture(folder / "photos", bumpy_images(6, HEIGHT, WIDTH, 1)), folder / "s.zarr")
    return folder / "s.zarr"


@pytest.fixture(scope="module")
def expected(stacked, tmp_path_factory):
    """Return what the store of `stacked` holds after a fit of `first_samples` that was not interrupted."""
    path = copy(stacked, tmp_path_factory.mktemp("expected") / "s.zarr")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules["impasto.fit.joint"], "fit_tile", tell_first_samples)
        fit(path, models=["lambert"])
    return contents(path)


@pytest.fixture
def small(tmp_path):
    """Return a store with a small colour relief under seven lights."""
    stack(write_capture(tmp_path / "photos", bumpy_images(7, 90, 70, 3)), tmp_path / "s.zarr")
    return tmp_path / "s.zarr"


def tell_first_samples(model, radiance, *, lights, **_):
    """Stand in for the core: return maps that tell which samples of the stack they were computed from."""
    count, pixels, channels = radiance.shape
    first, last = radiance[0, :, 0].astype(np.float32), radiance[-1, :, -1].astype(np.float32)
    specs = stores.fit_maps(model.shape_names, lobes=model.lobes, ambient=model.ambient, channels=channels)
    maps = {}
    for map in specs:
        values = np.repeat((first + count * last)[:, None], map.size, axis=1)
        maps[map.name] = values if map.axis else values[:, 0]
    maps["normal"] = np.stack([first, last, np.full(pixels, 1e4, np.float32)], axis=-1)
    maps["normal"] /= np.linalg.norm(maps["normal"], axis=-1, keepdims=True)
    maps["status"] = (radiance[0, :, 0] % 6).astype(np.uint8)
    return maps


@pytest.fixture
def first_samples(monkeypatch):
    """Replace the core by `tell_first_samples`."""
    monkeypatch.setattr(sys.modules["impasto.fit.joint"], "fit_tile", tell_first_samples)


def whole(path):
    _, height, width, _ = stores.open_stack(path).shape
    return slice(0, height), slice(0, width)


def test_every_pixel_is_fitted_once_and_lies_where_it_should(stacked, tmp_path, first_samples):
    path = copy(stacked, tmp_path / "s.zarr")
    summary = fit(path, models=["phong"])
    values = stores.open_stack(path).read(*whole(path)).astype(np.float32)
    maps = stores.read_fit(path, "phong", *whole(path))
    expected = values[0, ..., 0] + 6 * values[-1, ..., -1]
    np.testing.assert_array_equal(maps["shininess"], expected)
    np.testing.assert_array_equal(maps["diffuse_sd"][..., 0], expected)
    np.testing.assert_array_equal(maps["status"], values[0, ..., 0] % 6)
    (done,) = summary.models
    assert sum(done.pixels.values()) == HEIGHT * WIDTH
    assert done.pixels["converged"] == np.count_nonzero(maps["status"] == 0)
    assert attributes(path / "fits" / "phong")["pixels"] == done.pixels
    assert (done.already, done.continued) == (False, False)
    assert done.pixels_per_second > 0


def copy(store, target):
    shutil.copytree(store, target)
    return target


def test_coarser_levels_average_the_finer(stacked, tmp_path, first_samples):
    path = copy(stacked, tmp_path / "s.zarr")
    fit(path, models=["lambert"])
    fine = stores.read_fit(path, "lambert", *whole(path))["residual_rms"]
    half = stores.open_fit(path, "lambert", level=1)
    quarter = stores.open_fit(path, "lambert", level=2)
    assert (half.shape, quarter.shape) == ((550, 520), (275, 260))
    mean = fine.reshape(550, 2, 520, 2).mean(axis=(1, 3))
    coarse = half.read(slice(0, 550), slice(0, 520), ["residual_rms"])["residual_rms"]
    np.testing.assert_allclose(coarse, mean, rtol=1e-5)
    np.testing.assert_allclose(
        quarter.read(slice(0, 275), slice(0, 260), ["residual_rms"])["residual_rms"],
        mean.reshape(275, 2, 260, 2).mean(axis=(1, 3)),
        rtol=1e-5,
    )
    assert not (path / "pyramids" / "lambert" / "3").exists()


def test_tiles_are_lower_where_lights_are_many(small, monkeypatch, first_samples):
    fit(small, models=["lambert"])
    before = contents(small)
    read, heights = stores.Stack.read, []

    def note(self, rows, *place):
        heights.append(rows.stop - rows.start)
        return read(self, rows, *place)

    monkeypatch.setattr(stores.Stack, "read", note)
    monkeypatch.setattr(streaming, "_TILE_BYTES", 7 * 512 * 3 * 2 * 70)
    fit(small, models=["lambert"], overwrite=True)
    assert heights == [64, 64, 26, 26]  # two readers share each
    assert contents(small) == before


def test_photographs_left_out_are_not_read(small, first_samples):
    fit(small, models=["lambert"], options=FitOptions(exclude=("light00", "light06")))
    values = stores.open_stack(small).read(*whole(small)).astype(np.float32)
    maps = stores.read_fit(small, "lambert", *whole(small))
    np.testing.assert_array_equal(maps["residual_rms"], values[1, ..., 0] + 5 * values[5, ..., -1])
    assert attributes(small / "fits" / "lambert")["options"]["exclude"] == ["light00", "light06"]


def test_the_core_recovers_the_relief(small):
    pytest.importorskip("impasto._core")
    summary = fit(small, models=["lambert"])
    assert summary.models[0].pixels == {"converged": 90 * 70}
    maps = stores.read_fit(small, "lambert", *whole(small))
    y, x = np.mgrid[0:90, 0:70]
    normal = np.stack([0.2 * np.sin(x / 11), 0.2 * np.cos(y / 9), np.ones((90, 70))], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    cosine = np.clip((maps["normal"] * normal).sum(axis=-1), -1, 1)
    assert np.degrees(np.median(np.arccos(cosine))) < 0.5
    np.testing.assert_allclose(np.median(maps["diffuse"], axis=(0, 1)), [0.3, 0.5, 0.7], rtol=0.02)


def test_a_fit_that_is_there_is_not_computed_again(small, first_samples, monkeypatch):
    fit(small, models=["phong"])
    before = contents(small)
    monkeypatch.setattr(sys.modules["impasto.fit.joint"], "fit_tile", None)
    (again,) = fit(small, models=["phong"]).models
    assert again.already
    assert sum(again.pixels.values()) == 90 * 70
    assert contents(small) == before


def test_a_fit_made_otherwise_is_replaced_only_on_request(small, first_samples):
    fit(small, models=["phong", "lambert"])
    before = contents(small)
    with pytest.raises(StoreError) as caught:
        fit(small, models=["phong", "lambert"], options=FitOptions(index=1.6))
    assert ["fits/phong" in str(problem) for problem in caught.value.problems] == [True, False]
    assert contents(small) == before
    fit(small, models=["phong"], options=FitOptions(index=1.6), overwrite=True)
    assert attributes(small / "fits" / "phong")["index_of_refraction"] == 1.6
    fit(small, models=["phong"], overwrite=True)
    assert contents(small) == before


def stop_at_map(monkeypatch, number, error=KeyboardInterrupt):
    """Have the fit fail when it writes the map of that number, of all blocks and levels."""
    encode, begun = fits.encode_chunks, count(1)

    def encode_some(*arguments):
        if next(begun) == number:
            raise error
        return encode(*arguments)

    monkeypatch.setattr(fits, "encode_chunks", encode_some)


# A block has 7 maps; there are 9 of the fit, in 4 units, and 4 and 1 of its levels.
@pytest.mark.parametrize(("map", "whole"), [(3, 0), (20, 0), (40, 1), (80, 3), (96, 4)])
def test_an_interrupted_fit_is_continued_to_the_same_bytes(
    stacked, expected, tmp_path, first_samples, monkeypatch, map, whole
):
    path = copy(stacked, tmp_path / "s.zarr")
    with monkeypatch.context() as patch:
        stop_at_map(patch, map)
        with pytest.raises(KeyboardInterrupt):
            fit(path, models=["lambert"])
    with pytest.raises(StoreError, match="not finished"):
        stores.open_fit(path, "lambert")
    assert not list(path.rglob("*.partial"))
    written = []
    write = stores.MapsWriter.write

    def note(self, tile, values):
        if self.group.startswith("fits"):
            written.append((tile.rows.start // 1024, tile.columns.start // 1024))
        write(self, tile, values)

    monkeypatch.setattr(stores.MapsWriter, "write", note)
    (done,) = fit(path, models=["lambert"]).models
    assert done.continued
    assert len(set(written)) == 4 - whole
    assert contents(path) == expected


def test_an_interrupted_fit_is_not_continued_with_other_options(
    stacked, expected, tmp_path, first_samples, monkeypatch
):
    path = copy(stacked, tmp_path / "s.zarr")
    with monkeypatch.context() as patch:
        stop_at_map(patch, 52)
        with pytest.raises(KeyboardInterrupt):
            fit(path, models=["lambert"], options=FitOptions(max_steps=7))
    (done,) = fit(path, models=["lambert"]).models
    assert not done.continued
    assert contents(path) == expected


def test_an_error_of_the_core_stops_the_fit(stacked, tmp_path, monkeypatch):
    path = copy(stacked, tmp_path / "s.zarr")
    monkeypatch.setattr(sys.modules["impasto.fit.joint"], "fit_tile", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        fit(path, models=["lambert"])
    assert stores.fitted_models(path) == []


def test_a_full_disk_is_an_error_that_can_be_continued(stacked, expected, tmp_path, first_samples):
    path = copy(stacked, tmp_path / "s.zarr")
    with largest_file(1_000_000), pytest.raises(StoreError, match=r"fits/lambert.*no room left"):
        fit(path, models=["lambert"])
    (done,) = fit(path, models=["lambert"]).models
    assert done.continued
    assert contents(path) == expected


def test_room_is_checked_before_anything_is_fitted(small, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda path: type("Usage", (), {"free": 1000}))
    monkeypatch.setattr(sys.modules["impasto.fit.joint"], "fit_tile", lambda *_, **__: pytest.fail("fitted"))
    with pytest.raises(StoreError, match="MB free"):
        fit(small)


def test_damage_of_the_stack_names_the_photograph(stacked, tmp_path, first_samples):
    path = copy(stacked, tmp_path / "s.zarr")
    shard = photograph(path, 4)
    flip_byte(shard, chunks_in(shard, 9)[2 * 3 + 1][0] + 500)
    with pytest.raises(StoreError, match=r"light04 is damaged at rows 1024 to 1099, columns 512 to 1023"):
        fit(path, models=["lambert"])


def test_every_lost_photograph_is_named(small, first_samples):
    photograph(small, 0).unlink()
    photograph(small, 6).unlink()
    with pytest.raises(StoreError) as caught:
        fit(small, models=["lambert"])
    assert [problem.what for problem in caught.value.problems] == [
        "light00 has lost pixels",
        "light06 has lost pixels",
    ]


def test_everything_wrong_with_the_options_is_said_at_once(small):
    options = FitOptions(fresnel="facett", loss="squared", exclude=("light99",), index=0.5, max_steps=0)
    with pytest.raises(ImpastoError) as caught:
        fit(small, models=["phong", "fong"], procedure="prayer", options=options)
    text = str(caught.value)
    for word in ("fong", "prayer", "facett", "squared", "light99", "--index", "--max-steps"):
        assert word in text
    assert not (small / "fits").exists()


def test_fewer_lights_than_unknowns_are_refused(small):
    names = [f"light{number:02d}" for number in range(3)]
    with pytest.raises(OptionError, match="5 unknowns per channel, and there are 4 lights"):
        fit(small, models=["torrance-sparrow"], options=FitOptions(exclude=tuple(names)))


def test_a_stack_that_is_missing_or_unfinished_is_refused(small, tmp_path):
    with pytest.raises(StoreError, match="no such store"):
        fit(tmp_path / "nothing.zarr")
    document = small / "stack" / "zarr.json"
    document.write_text(document.read_text().replace('"complete": true', '"complete": false'))
    with pytest.raises(StoreError, match="impasto stack command again"):
        fit(small)


def fit_in_a_process(path, models):
    """Start a fit in a process that has everything imported; return it."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["impasto.fit"])
    process = context.Process(target=fit, args=(path,), kwargs={"models": models})
    process.start()
    return process


@pytest.mark.parametrize(
    ("size", "models", "kills"),
    [((HEIGHT, WIDTH), ["lambert"], 25), ((2100, 30), ["torrance-sparrow"], 25)],
)
def test_a_kill_at_any_moment_can_be_continued_to_the_same_bytes(tmp_path, stacked, size, models, kills):
    pytest.importorskip("impasto._core")
    path = tmp_path / "s.zarr"
    if size == (HEIGHT, WIDTH):
        copy(stacked, path)
    else:
        stack(write_capture(tmp_path / "photos", bumpy_images(6, *size, 1)), path)
    fit_in_a_process(path, models).join()
    expected = contents(path)
    for model in models:
        stores.remove_fit(path, model)
    started = time.perf_counter()
    fit_in_a_process(path, models).join()
    seconds = time.perf_counter() - started
    assert contents(path) == expected
    # Each run goes on where the last was killed, so that short lives reach every moment of a whole one.
    rng = np.random.default_rng(9)
    killed = 0
    while killed < kills:
        if stores.fitted_models(path) == sorted(models):
            assert contents(path) == expected
            for model in models:
                stores.remove_fit(path, model)
        process = fit_in_a_process(path, models)
        time.sleep(rng.uniform(0, 0.4 * seconds))
        process.kill()
        process.join()
        killed += process.exitcode != 0
    fit_in_a_process(path, models).join()
    assert contents(path) == expected
    assert not [name for name in contents(path) if name.endswith(".partial")]
