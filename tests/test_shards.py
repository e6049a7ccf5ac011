"""Chunks and shards that impasto writes itself are what zarr would write, and what others read."""

import json

import google_crc32c
import numpy as np
import pytest
import zarr
from zarr.codecs import ZstdCodec

from impasto import store as stores
from impasto.errors import StoreError
from impasto.stack import stack
from impasto.store.chunks import encode_chunks
from impasto.store.hierarchy import open_array
from impasto.store.layout import Map, fit_maps
from store_files import chunks_in, largest_file, noise_images, write_capture

STATUS = Map("status", None, 1, "1", "how it ended", dtype="uint8")
DIFFUSE = Map("diffuse", "channel", 3, "1", "diffuse magnitude")
GROUP = "fits/any"
HEIGHT, WIDTH = 1100, 300


def written(tmp_path):
    """Write arrays of two units, and return by name what they should hold."""
    rng = np.random.default_rng(2)
    maps = (DIFFUSE, STATUS)
    values = {map.name: rng.integers(0, 6, map.shape(HEIGHT, WIDTH)).astype(map.dtype) for map in maps}
    writer = stores.MapsWriter(tmp_path, GROUP, maps, HEIGHT, WIDTH, {})
    for unit in stores.units(HEIGHT, WIDTH):
        writer.write(unit, {name: whole[unit.rows, unit.columns] for name, whole in values.items()})
    return values


@pytest.mark.parametrize("map", [STATUS, DIFFUSE], ids=lambda map: map.name)
def test_metadata_of_maps_are_those_of_zarr(tmp_path, map):
    written(tmp_path)
    last = () if map.axis is None else (map.size,)
    zarr.create_array(
        tmp_path / "zarr",
        shape=map.shape(HEIGHT, WIDTH),
        dtype=map.dtype,
        dimension_names=map.dims,
        chunks=(256, 256, *last),
        shards=(1024, 1024, *last),
        fill_value=map.fill_value,
        attributes={"long_name": map.long_name, "units": map.units},
        compressors=[ZstdCodec(level=-1, checksum=True)],
        zarr_format=3,
    )
    assert document(tmp_path / GROUP / map.name) == document(tmp_path / "zarr")


def test_metadata_of_a_stack_are_those_of_zarr(tmp_path):
    stack(write_capture(tmp_path / "photos", noise_images(2, 600, 1030)), tmp_path / "s.zarr")
    zarr.create_array(
        tmp_path / "zarr",
        shape=(2, 600, 1030, 3),
        dtype=np.uint16,
        dimension_names=("light", "y", "x", "channel"),
        chunks=(1, 512, 512, 3),
        shards=(1, 1024, 1536, 3),
        fill_value=65535,
        attributes={"long_name": "relative radiance, as scale * value + offset", "units": "1"},
        compressors=[ZstdCodec(level=-200, checksum=True)],
        zarr_format=3,
    )
    zarr.create_array(
        tmp_path / "names",
        shape=(2,),
        dtype=str,
        dimension_names=("light",),
        chunks=(2,),
        fill_value="",
        attributes={"long_name": "name of the photograph"},
        compressors=[ZstdCodec(level=-1, checksum=True)],
        zarr_format=3,
    )
    assert document(tmp_path / "s.zarr" / "stack" / "radiance") == document(tmp_path / "zarr")
    assert document(tmp_path / "s.zarr" / "stack" / "light_name") == document(tmp_path / "names")


def document(array):
    return json.loads((array / "zarr.json").read_text())


@pytest.mark.parametrize("map", [STATUS, DIFFUSE], ids=lambda map: map.name)
def test_zarr_and_impasto_read_the_pixels(tmp_path, map):
    values = written(tmp_path)[map.name]
    path = f"{GROUP}/{map.name}"
    np.testing.assert_array_equal(zarr.open_array(tmp_path / path, mode="r")[...], values)
    np.testing.assert_array_equal(open_array(tmp_path, path).read(), values)
    np.testing.assert_array_equal(
        open_array(tmp_path, path).read(slice(1000, 1050), slice(100, 270)), values[1000:1050, 100:270]
    )


@pytest.mark.parametrize("position", [100, -2, -30])
def test_a_flipped_byte_is_found(tmp_path, position):
    written(tmp_path)
    shard = tmp_path / GROUP / "diffuse" / "c" / "1" / "0" / "0"
    data = bytearray(shard.read_bytes())
    data[position] ^= 4
    shard.write_bytes(bytes(data))
    with pytest.raises((OSError, RuntimeError, ValueError)):
        open_array(tmp_path, f"{GROUP}/diffuse").read()


def change_index(shard, entry):
    """Say another offset and size of the first chunk of 4 x 4, with a right checksum."""
    data = bytearray(shard.read_bytes())
    data[-260:-244] = np.array(entry, "<u8").tobytes()
    data[-4:] = google_crc32c.value(bytes(data[-260:-4])).to_bytes(4, "little")
    shard.write_bytes(bytes(data))


@pytest.mark.parametrize("outside", [(2**63, 10), (2**64 - 2, 10), (0, 2**40), (0, 2**64 - 2), (10**9, 10)])
def test_an_index_that_points_outside_of_its_file_is_found(tmp_path, outside):
    written(tmp_path)
    change_index(tmp_path / GROUP / "diffuse" / "c" / "1" / "0" / "0", outside)
    with pytest.raises(ValueError, match="the file has"):
        open_array(tmp_path, f"{GROUP}/diffuse").read()


@pytest.mark.parametrize(("map", "last"), [("diffuse", "/0"), ("status", "")])
def test_a_chunk_that_a_shard_lacks_is_found_where_it_is_asked_for(tmp_path, map, last):
    values = written(tmp_path)[map]
    change_index(tmp_path / GROUP / f"{map}/c/1/0{last}", (2**64 - 1, 2**64 - 1))
    fit = stores.Fit(tmp_path, GROUP, {})
    beside = slice(1024, 1100), slice(256, 300)
    np.testing.assert_array_equal(fit.read(*beside, [map])[map], values[beside])
    with pytest.raises(
        StoreError, match=f"{GROUP}/{map}: is damaged: a shard lacks its chunk 0, 0.*--overwrite"
    ):
        fit.read(slice(1000, 1050), slice(0, 10), [map])


def test_a_unit_whose_status_lacks_a_chunk_is_not_whole(tmp_path):
    written(tmp_path)
    change_index(tmp_path / GROUP / "status/c/1/0", (2**64 - 1, 2**64 - 1))
    writer = stores.MapsWriter(tmp_path, GROUP, (DIFFUSE, STATUS), HEIGHT, WIDTH, {})
    assert [unit.row for unit in writer.unfinished()] == [1]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('"shape"', '"shbpe"'),
        ('"data_type"', '"eata_type"'),
        ('"float32"', '"floa332"'),
        ('"float32"', '"M8[s]"'),
        ('"chunk_grid"', '"chunk_grie"'),
        ('"configuration"', '"cpnfiguration"'),
        ('"chunk_shape"', '"chunk_shap"'),
        ('"fill_value"', '"fill"'),
        ('"attributes"', '"attribute"'),
        ("256", "0"),
        ("256", "255"),
        ("256", "2.56"),
        ("1024", '"1024"'),
        ("1100", "-1100"),
        ('"codecs": [', '"codecs": [], "rest": ['),
    ],
)
def test_damaged_metadata_are_found_when_an_array_is_opened(tmp_path, right, wrong):
    written(tmp_path)
    path = tmp_path / GROUP / "diffuse" / "zarr.json"
    assert right in path.read_text()
    path.write_text(path.read_text().replace(right, wrong))
    with pytest.raises(StoreError, match="metadata are damaged"):
        open_array(tmp_path, f"{GROUP}/diffuse")


def test_a_full_disk_is_told_as_one_where_another_map_waits_to_be_written(tmp_path):
    # The first map fails at once; the second, of a few bytes, when its file is closed.
    writer = stores.MapsWriter(tmp_path, GROUP, (DIFFUSE, STATUS), 300, 300, {})
    noise = np.random.default_rng(1).random((300, 300, 3), np.float32)
    (unit,) = stores.units(300, 300)
    with largest_file(0), pytest.raises(StoreError, match="diffuse: there is no room"):
        writer.write(unit, {"diffuse": noise, "status": np.zeros((300, 300), np.uint8)})
    assert not list(tmp_path.rglob("*.partial"))
    assert writer.unfinished() == [unit]


def test_only_chunks_with_pixels_are_in_a_shard(tmp_path):
    written(tmp_path)
    index = np.reshape(chunks_in(tmp_path / GROUP / "status" / "c" / "1" / "0", 16), (4, 4, 2))
    there = index[..., 0] != 2**64 - 1
    assert there.tolist() == [[True, True, False, False], *[[False] * 4] * 3]
    assert index[0, 0, 0] == 0
    assert index[0, 1, 0] == index[0, 0, 1]


def test_chunks_that_hold_the_fill_value_only_are_written():
    chunks = dict(encode_chunks(np.full((3, 5), 255, np.uint8), 4, 255))
    assert list(chunks) == [(0, 0), (0, 1)]
    assert chunks[0, 0] == chunks[0, 1] != b""


def test_every_map_of_a_fit_has_a_type_that_zarr_knows(tmp_path):
    maps = fit_maps(("c",), lobes=2, ambient=True, channels=1)
    stores.MapsWriter(tmp_path, GROUP, maps, 7, 9, {})
    for map in maps:
        array = zarr.open_array(tmp_path / GROUP / map.name, mode="r")
        assert array.shape == map.shape(7, 9)
        assert np.array_equal(array[...], np.full(array.shape, map.fill_value, map.dtype), equal_nan=True)
