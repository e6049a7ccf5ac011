"""Chunks and shards that impasto writes itself are what zarr would write, and what others read."""

import json

import numpy as np
import pytest
import zarr
from zarr.codecs import ZstdCodec

from impasto.store.chunks import encode_chunks
from impasto.store.hierarchy import open_array
from impasto.store.layout import UNIT, Map, fit_maps
from impasto.store.shards import write_metadata, write_shard

STATUS = Map("status", None, 1, "1", "how it ended", dtype="uint8")
DIFFUSE = Map("diffuse", "channel", 3, "1", "diffuse magnitude")
HEIGHT, WIDTH = 1100, 300


def written(tmp_path, map):
    """Write an array of two units and return what it should hold."""
    rng = np.random.default_rng(2)
    values = rng.integers(0, 6, map.shape(HEIGHT, WIDTH)).astype(map.dtype)
    write_metadata(tmp_path / map.name, map, HEIGHT, WIDTH)
    last = () if map.axis is None else ("0",)
    for number in (0, 1):
        shard = tmp_path.joinpath(map.name, "c", str(number), "0", *last)
        write_shard(shard, map, values[number * UNIT : (number + 1) * UNIT])
    return values


@pytest.mark.parametrize("map", [STATUS, DIFFUSE], ids=lambda map: map.name)
def test_metadata_are_those_of_zarr(tmp_path, map):
    write_metadata(tmp_path / map.name, map, HEIGHT, WIDTH)
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
    ours, zarrs = (json.loads((tmp_path / name / "zarr.json").read_text()) for name in (map.name, "zarr"))
    assert ours == zarrs


@pytest.mark.parametrize("map", [STATUS, DIFFUSE], ids=lambda map: map.name)
def test_zarr_and_zarrs_read_the_pixels(tmp_path, map):
    values = written(tmp_path, map)
    np.testing.assert_array_equal(zarr.open_array(tmp_path / map.name, mode="r")[...], values)
    np.testing.assert_array_equal(open_array(tmp_path, map.name)[...], values)
    np.testing.assert_array_equal(
        open_array(tmp_path, map.name)[1000:1050, 100:270], values[1000:1050, 100:270]
    )


@pytest.mark.parametrize("position", [100, -2, -30])
def test_a_flipped_byte_is_found(tmp_path, position):
    written(tmp_path, DIFFUSE)
    shard = tmp_path / "diffuse" / "c" / "1" / "0" / "0"
    data = bytearray(shard.read_bytes())
    data[position] ^= 4
    shard.write_bytes(bytes(data))
    with pytest.raises((OSError, RuntimeError, ValueError)):
        open_array(tmp_path, "diffuse")[...]


def test_only_chunks_with_pixels_are_in_a_shard(tmp_path):
    written(tmp_path, STATUS)
    index = np.frombuffer((tmp_path / "status" / "c" / "1" / "0").read_bytes()[-260:-4], "<u8").reshape(
        4, 4, 2
    )
    there = index[..., 0] != 2**64 - 1
    assert there.tolist() == [[True, True, False, False], *[[False] * 4] * 3]
    assert index[0, 0, 0] == 0
    assert index[0, 1, 0] == index[0, 0, 1]


def test_chunks_that_hold_the_fill_value_only_are_written():
    chunks = dict(encode_chunks(np.full((3, 5), 255, np.uint8), 4, 255))
    assert list(chunks) == [(0, 0), (0, 1)]
    assert chunks[0, 0] == chunks[0, 1] != b""


def test_every_map_of_a_fit_has_a_type_that_zarr_knows(tmp_path):
    for map in fit_maps(("c",), lobes=2, ambient=True, channels=1):
        write_metadata(tmp_path / map.name, map, 7, 9)
        array = zarr.open_array(tmp_path / map.name, mode="r")
        assert array.shape == map.shape(7, 9)
        assert np.array_equal(array[...], np.full(array.shape, map.fill_value, map.dtype), equal_nan=True)
