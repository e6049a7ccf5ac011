"""Maps on disk: the metadata and the shards of their arrays, by Zarr's codec ``sharding_indexed``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.store.chunks import encode_chunks
from impasto.store.files import write_json, write_whole
from impasto.store.layout import INNER_CHUNK, UNIT, ZSTD, Map

# What the index of a shard says, as offset and as size, about a chunk that is not there.
_NONE = 2**64 - 1


def write_metadata(folder: Path, map: Map, height: int, width: int) -> None:
    """Write the metadata of the array of a map in `folder`, for an image of `height` x `width` pixels."""
    last = () if map.axis is None else (map.size,)
    little_endian = {"name": "bytes", "configuration": {"endian": "little"}}
    sharding = {
        "chunk_shape": [INNER_CHUNK, INNER_CHUNK, *last],
        "codecs": [
            {"name": "bytes"} if np.dtype(map.dtype).itemsize == 1 else little_endian,
            {"name": "zstd", "configuration": ZSTD},
        ],
        "index_codecs": [little_endian, {"name": "crc32c"}],
        "index_location": "end",
    }
    document = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": map.shape(height, width),
        "data_type": map.dtype,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [UNIT, UNIT, *last]}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": "NaN" if np.isnan(map.fill_value) else map.fill_value,
        "codecs": [{"name": "sharding_indexed", "configuration": sharding}],
        "attributes": {"long_name": map.long_name, "units": map.units},
        "dimension_names": map.dims,
        "storage_transformers": [],
    }
    write_json(folder / "zarr.json", document)


def write_shard(path: Path, map: Map, values: NDArray[Any]) -> None:
    """Write one shard of a map, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    map : Map
    values : ndarray of shape (rows, columns[, k])
        The unit's pixels; fewer than a whole unit where the image ends.

    Raises
    ------
    OSError
        If the disk is full or refuses.
    """
    import google_crc32c

    across = UNIT // INNER_CHUNK
    index = np.full((across, across, 2), _NONE, "<u8")
    chunks: list[bytes] = []
    end = 0
    for place, chunk in encode_chunks(np.asarray(values, map.dtype), INNER_CHUNK, map.fill_value):
        index[place] = end, len(chunk)
        end += len(chunk)
        chunks.append(chunk)
    checksum = google_crc32c.value(index.tobytes()).to_bytes(4, "little")
    write_whole(path, *chunks, index.tobytes(), checksum)
