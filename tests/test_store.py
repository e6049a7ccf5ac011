"""The layout on disk: what is written is read, what is damaged is found, what is not ours is left alone."""

import json
import re
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from impasto import store as stores
from impasto.errors import StoreError
from impasto.geometry import Camera, Lights, dome_direction
from store_files import attributes, chunks_in, contents, fit_attributes, flip_byte, photograph

LAYOUT = Path(__file__).resolve().parents[1] / "docs" / "store.md"


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def make_stack(path, pixels, **changed):
    """Write `pixels` (light, y, x, channel) as a complete stack."""
    count, channels = pixels.shape[0], pixels.shape[3]
    lights = Lights(
        names=tuple(f"käse {number}" for number in range(count)),
        direction=dome_direction(np.linspace(0, 1, count), np.arange(count)),
        position_mm=np.where(np.arange(count)[:, None] % 2, np.nan, 1500.0 + np.arange(3)),
        intensity=1 + np.arange(count)[:, None] / 10,
        angular_size_deg=np.full(count, 0.5),
    )
    settings = {
        "scale": 1 / 65535,
        "offset": 0.0,
        "clip_level": (0.98,) * (channels - 1) + (None,),
        "noise": {"read": 1e-4, "photon": 2e-5, "relative": 5e-3},
    } | changed
    header = stores.StackHeader(
        shape=pixels.shape,
        dtype=pixels.dtype,
        lights=lights,
        camera=Camera(distance_mm=2000.0, mm_per_px=0.1),
        inputs=[
            {"name": name, "file": f"{name}.tif", "dtype": "uint16", "transfer": "linear"}
            for name in lights.names
        ],
        **settings,
    )
    writer = stores.StackWriter(path, header, fresh=False)
    for light, image in enumerate(pixels):
        rows = range(0, image.shape[0], stores.STACK_CHUNK)
        writer.write_light(light, ((row, image[row : row + stores.STACK_CHUNK]) for row in rows))
        writer.finish_light(light, f"{light:064d}", light)
    writer.finish({})
    return lights


MAPS = stores.fit_maps(("c",), lobes=1, ambient=True, channels=3)


def make_fit(path, rng, height=1100, width=1050, maps=MAPS, model="phong"):
    """Write random maps as a complete fit, and return them."""
    writer = stores.MapsWriter(path, f"fits/{model}", maps, height, width, fit_attributes(model))
    written = {map.name: rng.random(map.shape(height, width), np.float32) for map in maps[:-1]}
    written["status"] = rng.integers(0, 6, (height, width)).astype(np.uint8)
    for unit in stores.units(height, width):
        writer.write(unit, {name: values[unit.rows, unit.columns] for name, values in written.items()})
    writer.finish({})
    return written


@pytest.fixture
def painting(tmp_path, rng):
    """Return a store with a stack and a fit, and what was written."""
    path = tmp_path / "painting.zarr"
    pixels = rng.integers(0, 65535, (4, 600, 530, 3)).astype(np.uint16)
    make_stack(path, pixels)
    return path, pixels, make_fit(path, rng)


@pytest.fixture
def fitted(tmp_path, rng):
    """Return a store with a fit of several units, and its maps."""
    path = tmp_path / "painting.zarr"
    make_stack(path, np.ones((4, 1100, 1050, 3), np.uint16))
    return path, make_fit(path, rng)


def test_a_stack_is_read_as_written(painting):
    path, pixels, _ = painting
    stack = stores.open_stack(path)
    assert stack.shape == pixels.shape
    assert stack.dtype == np.uint16
    rows, columns = slice(490, 560), slice(500, 530)
    np.testing.assert_array_equal(stack.read(rows, columns), pixels[:, rows, columns])
    np.testing.assert_array_equal(stack.read(rows, columns, [3, 0, 1]), pixels[[3, 0, 1], rows, columns])
    assert stack.read(rows, columns).flags.c_contiguous
    radiance = stores.read_stack(path, rows, columns, [2])
    assert radiance.dtype == np.float32
    np.testing.assert_allclose(radiance, pixels[2:3, rows, columns] / 65535, rtol=1e-6)


def test_lights_camera_and_attributes_are_read_as_written(painting):
    path, *_ = painting
    lights, stack = stores.lights(path), stores.open_stack(path)
    assert lights.names == ("käse 0", "käse 1", "käse 2", "käse 3")
    np.testing.assert_array_equal(lights.direction, dome_direction(np.linspace(0, 1, 4), np.arange(4)))
    assert np.isnan(lights.position_mm[1]).all()
    assert lights.position_mm[2, 2] == 1502
    np.testing.assert_allclose(lights.intensity, np.repeat(1 + np.arange(4)[:, None] / 10, 3, axis=1))
    assert (stores.camera(path).distance_mm, stores.camera(path).mm_per_px) == (2000.0, 0.1)
    np.testing.assert_array_equal(stack.clip_level, [0.98, 0.98, np.inf])
    assert stack.noise == (1e-4, 2e-5, 5e-3)
    assert stack.clipped_samples == 0 + 1 + 2 + 3
    assert stack.light_rgb.tolist() == [1.0, 1.0, 1.0]


def test_float_stacks_keep_missing_samples(tmp_path, rng):
    pixels = rng.random((2, 40, 30, 1)).astype(np.float32) * 100
    pixels[1, 3, 4] = np.nan
    make_stack(tmp_path / "s", pixels, scale=1.0, clip_level=(None,))
    np.testing.assert_array_equal(stores.read_stack(tmp_path / "s", slice(0, 40), slice(0, 30)), pixels)


def test_a_fit_is_read_as_written(fitted):
    path, maps = fitted
    rows, columns = slice(1000, 1100), slice(1000, 1050)
    tile = stores.read_fit(path, "phong", rows, columns)
    assert set(tile) == set(maps)
    for name, values in tile.items():
        np.testing.assert_array_equal(values, maps[name][rows, columns])
    assert stores.open_fit(path, "phong").shape == (1100, 1050)
    assert stores.fitted_models(path) == ["phong"]


def test_xarray_opens_all_of_it_without_a_warning(painting):
    path, pixels, maps = painting
    make_level(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tree = stores.open(path)
        stack, fit, level = tree["stack"], tree["fits/phong"], tree["pyramids/phong/1"]
        assert stack["radiance"].dims == ("light", "y", "x", "channel")
        assert set(stack.coords) >= {"light_name", "light_direction", "light_intensity"}
        assert list(stack["light_name"].values) == [f"käse {number}" for number in range(4)]
        np.testing.assert_array_equal(stack["radiance"][1, 5:9, 7].values, pixels[1, 5:9, 7])
        assert stack["radiance"].dtype == np.uint16
        assert fit["normal"].dims == ("y", "x", "xyz")
        assert fit["status"].dtype == np.uint8
        np.testing.assert_array_equal(fit["diffuse"].values, maps["diffuse"])
        assert level["c"].sizes == {"y": 550, "x": 525}
        assert fit.attrs["complete"] is True


def make_level(path):
    writer = stores.MapsWriter(path, "pyramids/phong/1", MAPS, 550, 525, {"level": 1})
    for unit in stores.units(550, 525):
        writer.write(unit, {map.name: np.zeros(map.shape(unit.height, unit.width)) for map in MAPS})
    writer.finish({})


def test_metadata_are_strict_json(painting):
    def refuse(constant):
        raise AssertionError(constant)

    path, *_ = painting
    for document in path.rglob("zarr.json"):
        json.loads(document.read_text(encoding="utf-8"), parse_constant=refuse)


def test_no_flipped_byte_of_the_stack_goes_unseen(painting, rng):
    path, pixels, _ = painting
    shard = photograph(path, 1)
    whole = shard.read_bytes()
    first, size = chunks_in(shard, 4)[2]
    stack = stores.open_stack(path)
    damaged = 0
    within = [*range(8), *rng.integers(8, size, 30), size - 1]
    for position in [*(first + np.array(within)), *range(len(whole) - 68, len(whole), 7)]:
        flip_byte(shard, position)
        try:  # a part of a chunk is the harder case: some codecs then skip the checksum
            tile = stack.read(slice(520, 530), slice(3, 40))
        except StoreError as error:
            assert "käse 1 is damaged" in str(error)  # noqa: PT017
            damaged += 1
        else:
            np.testing.assert_array_equal(tile, pixels[:, 520:530, 3:40])
        shard.write_bytes(whole)
    assert damaged >= 42


def test_all_damaged_photographs_are_named_at_once(painting):
    path, *_ = painting
    for light in (1, 3):
        flip_byte(photograph(path, light), chunks_in(photograph(path, light), 4)[2][0] + 5000)
    with pytest.raises(StoreError) as caught:
        stores.read_stack(path, slice(0, 600), slice(0, 530))
    named = [re.search("käse .", problem.what).group() for problem in caught.value.problems]
    assert named == ["käse 1", "käse 3"]
    assert stores.read_stack(path, slice(0, 500), slice(0, 530)).shape == (4, 500, 530, 3)


@pytest.mark.parametrize("position", [20, -3])
def test_a_flipped_byte_of_a_map_is_found(fitted, position):
    path, _ = fitted
    flip_byte(path / "fits" / "phong" / "diffuse" / "c" / "1" / "0" / "0", position)
    for rows in (slice(0, 1100), slice(1030, 1040)):
        with pytest.raises(StoreError, match=r"fits/phong/diffuse.*damaged"):
            stores.read_fit(path, "phong", rows, slice(0, 250))


def test_a_lost_photograph_is_told_and_overexposed_to_other_programs(painting):
    path, *_ = painting
    for light in (0, 2):
        photograph(path, light).unlink()
    stack = stores.open_stack(path)
    with pytest.raises(StoreError) as caught:
        stack.read(slice(0, 10), slice(0, 10))
    assert [problem.what for problem in caught.value.problems] == [
        "käse 0 has lost pixels",
        "käse 2 has lost pixels",
    ]
    assert len(stack.read(slice(0, 10), slice(0, 10), lights=[1, 3])) == 2
    assert (stores.open(path)["stack/radiance"][0, :512, :512] == 65535).all()


@pytest.mark.parametrize("name", ["light_name", "light_direction", "light_intensity"])
def test_lights_that_are_lost_are_told(painting, name):
    path, *_ = painting
    shutil.rmtree(path / "stack" / name / "c")
    with pytest.raises(StoreError, match=f"stack/{name}: has lost its values"):
        stores.lights(path)


@pytest.mark.parametrize("left", [0, 3, 100, -1])
def test_a_photograph_cut_off_is_damage(painting, left):
    path, *_ = painting
    shard = photograph(path, 1)
    shard.write_bytes(shard.read_bytes()[:left])
    with pytest.raises(StoreError, match="käse 1 is damaged"):
        stores.read_stack(path, slice(0, 512), slice(0, 512))


@pytest.mark.parametrize("lost", ["c/1/0/0", "zarr.json"])
def test_a_map_of_which_a_part_is_lost_is_told(painting, lost):
    path, *_ = painting
    (path / "fits" / "phong" / "diffuse" / lost).unlink()
    with pytest.raises(StoreError, match="fits/phong/diffuse"):
        stores.read_fit(path, "phong", slice(1030, 1040), slice(0, 250))


def test_a_stack_without_its_attributes_or_array_says_how_to_mend_it(painting):
    path, *_ = painting
    document = path / "stack" / "zarr.json"
    metadata = json.loads(document.read_text())
    del metadata["attributes"]["scale"], metadata["attributes"]["noise"]
    document.write_text(json.dumps(metadata))
    with pytest.raises(StoreError, match=r"lacks the attributes scale, noise.*--overwrite"):
        stores.open_stack(path)
    (path / "stack" / "radiance" / "zarr.json").unlink()
    with pytest.raises(StoreError, match="lacks the attributes"):
        stores.open_stack(path)


def test_a_unit_is_whole_only_with_all_of_its_status(tmp_path, rng):
    stores_root(tmp_path)
    make_fit(tmp_path, rng)
    writer = stores.MapsWriter(tmp_path, "fits/phong", MAPS, 1100, 1050, {})
    assert writer.unfinished() == []
    shard = tmp_path / "fits" / "phong" / "status" / "c" / "1" / "0"
    data = shard.read_bytes()
    for cut in (0, 5, len(data) // 2, len(data) - 1):
        shard.write_bytes(data[:cut])
        assert [(unit.row, unit.column) for unit in writer.unfinished()] == [(1, 0)]


def test_a_unit_cut_short_is_written_anew(tmp_path, rng):
    stores_root(tmp_path)
    make_fit(tmp_path, rng)
    before = contents(tmp_path)
    unit = stores.units(1100, 1050)[3]
    maps = stores.read_fit(tmp_path, "phong", unit.rows, unit.columns)
    for shard in ("diffuse/c/1/1/0", "chi2_reduced/c/1/1", "status/c/1/1"):
        path = tmp_path / "fits" / "phong" / shard
        path.write_bytes(path.read_bytes()[:50])
    writer = stores.MapsWriter(tmp_path, "fits/phong", MAPS, 1100, 1050, {})
    writer.write(unit, maps)
    assert contents(tmp_path) == before


def stores_root(path):
    """Make the root of a store."""
    path.mkdir(exist_ok=True)
    (path / "zarr.json").write_text(
        '{"zarr_format": 3, "node_type": "group", "attributes": {"impasto_schema": 1}}'
    )


def test_a_newer_schema_is_refused_and_untouched(painting):
    path, *_ = painting
    document = path / "zarr.json"
    document.write_text(document.read_text().replace('"impasto_schema": 1', '"impasto_schema": 2'))
    before = contents(path)
    for use in (
        lambda: stores.open_stack(path),
        lambda: stores.open_fit(path, "phong"),
        lambda: stores.open(path),
        lambda: stores.remove_fit(path, "phong"),
    ):
        with pytest.raises(StoreError, match=r"schema 2.*up to 1"):
            use()
    assert contents(path) == before


@pytest.mark.parametrize("content", ["{", '{"node_type": "group"}', "[]", '{"zarr_format": 3}'])
def test_a_folder_that_is_no_store_is_refused(tmp_path, content):
    (tmp_path / "zarr.json").write_text(content)
    with pytest.raises(StoreError):
        stores.open_stack(tmp_path)
    assert stores.target_problems(tmp_path)


def test_what_may_become_a_store(tmp_path):
    assert stores.target_problems(tmp_path / "new" / "deep.zarr") == []
    assert stores.target_problems(tmp_path) == []
    (tmp_path / "zarr.json.4711.partial").touch()
    assert stores.target_problems(tmp_path) == []
    (tmp_path / "film.partial").touch()
    assert "not an impasto store" in stores.target_problems(tmp_path)[0].what
    assert "is a file" in stores.target_problems(tmp_path / "film.partial")[0].what


def test_only_leftovers_of_a_kill_are_swept(tmp_path):
    stores_root(tmp_path / "s")
    ours = ["zarr.json.4711.partial", "zarr.0123456789abcdef0123456789abcdef.partial"]
    for name in [*ours, "film.partial", "notes.txt"]:
        (tmp_path / "s" / name).touch()
    with stores.run(tmp_path / "s", "test"):
        left = {path.name for path in (tmp_path / "s").iterdir()}
    assert left == {"zarr.json", "film.partial", "notes.txt"}


def test_two_runs_do_not_write_at_once(tmp_path):
    code = """
import pathlib, sys
from impasto.store import run
with run(pathlib.Path(sys.argv[1]), "fit"):
    print("in", flush=True)
    sys.stdin.read()
"""
    command = [sys.executable, "-c", code, str(tmp_path / "s")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "in\n"
        with pytest.raises(StoreError, match="another run"), stores.run(tmp_path / "s", "stack"):
            pass
        other.stdin.close()
    with stores.run(tmp_path / "s", "stack"):
        pass


def test_the_log_tells_how_runs_ended(tmp_path):
    for error in (None, KeyboardInterrupt, ValueError):
        try:
            with stores.run(tmp_path / "s.zarr", "fit") as log:
                log.write("model", pixels=5)
                if error:
                    raise error
        except (KeyboardInterrupt, ValueError):
            pass
    lines = [json.loads(line) for line in (tmp_path / "s.zarr.log.jsonl").read_text().splitlines()]
    assert [line["event"] for line in lines] == [
        *("start", "model", "end"),
        *("start", "model", "interrupted"),
        *("start", "model", "failed"),
    ]
    assert lines[1]["pixels"] == 5


def test_a_disk_without_room_is_seen_before_work(tmp_path):
    (problem,) = stores.no_room(tmp_path / "not" / "yet.zarr", 10**18)
    assert "1000000000.00 GB" in problem.what
    assert stores.no_room(tmp_path, 1) == []


def test_unfinished_parts_are_not_taken_for_whole(tmp_path, rng):
    pixels = rng.integers(0, 65535, (3, 40, 30, 3)).astype(np.uint16)
    make_stack(tmp_path, pixels)
    for group, use in (
        ("stack", lambda: stores.open_stack(tmp_path)),
        ("fits/phong", lambda: stores.open_fit(tmp_path, "phong")),
    ):
        if group != "stack":
            make_fit(tmp_path, rng, 40, 30)
        document = tmp_path / group / "zarr.json"
        document.write_text(document.read_text().replace('"complete": true', '"complete": false'))
        with pytest.raises(StoreError, match="not finished"):
            use()
    assert stores.fitted_models(tmp_path) == []
    with pytest.raises(StoreError, match="no such fit"):
        stores.open_fit(tmp_path, "lambert")
    with pytest.raises(StoreError, match="no such store"):
        stores.open_stack(tmp_path / "elsewhere")


def test_zarr_is_not_imported_for_nothing():
    code = "import sys, impasto.store; print({'zarr', 'xarray', 'rich'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "set()\n"


def test_the_specification_names_all_that_is_written(painting):
    path, *_ = painting
    text = LAYOUT.read_text(encoding="utf-8")
    for document in path.rglob("zarr.json"):
        metadata = json.loads(document.read_text())
        names = set(metadata["attributes"])
        if metadata["node_type"] == "array" and document.parent.name != "c":
            names.add(document.parent.name.removesuffix("_sd"))
        missing = {name for name in names if f"`{name}`" not in text}
        assert not missing, f"docs/store.md does not mention {missing}"


def test_units_cover_an_image_once():
    covered = np.zeros((2100, 1025), int)
    for unit in stores.units(2100, 1025):
        covered[unit.rows, unit.columns] += 1
        inside = np.zeros_like(covered)
        for tile in unit.tiles(128, 512):
            inside[tile.rows, tile.columns] += 1
        assert (inside[unit.rows, unit.columns] == 1).all()
        assert inside.sum() == unit.pixels
    assert (covered == 1).all()


def test_levels_end_below_512():
    assert stores.level_sizes(511, 300) == []
    assert stores.level_sizes(512, 300) == [(256, 150)]
    assert stores.level_sizes(1501, 1200) == [(751, 600), (376, 300)]


def test_a_matte_model_has_no_specular_maps():
    names = [map.name for map in stores.fit_maps((), lobes=0, ambient=False, channels=1)]
    assert names == ["normal", "diffuse", "normal_sd", "diffuse_sd", "chi2_reduced", "residual_rms", "status"]
    lobes = {map.name: map.dims for map in stores.fit_maps(("c", "c_2"), lobes=2, ambient=False, channels=3)}
    assert lobes["specular"] == lobes["specular_sd"] == ("y", "x", "lobe")


def test_attributes_of_the_root(painting):
    path, *_ = painting
    assert attributes(path)["impasto_schema"] == stores.SCHEMA
