"""The metadata of arrays, as Zarr's version 3 specifies them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

_LITTLE_ENDIAN = {"name": "bytes", "configuration": {"endian": "little"}}


def array_document(
    shape: Sequence[int],
    chunk: Sequence[int],
    dims: Sequence[str],
    dtype: DTypeLike,
    *,
    fill_value: float | str,
    compressor: tuple[str, Mapping[str, Any]],
    shard: Sequence[int] | None = None,
    attributes: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the metadata of an array.

    Parameters
    ----------
    shape, chunk : sequence of int
    dims : sequence of str
        Names of the axes.
    dtype : dtype
        ``str`` for strings of variable length.
    fill_value : float or str
    compressor : tuple
        Name and configuration of the codec that compresses a chunk.
    shard : sequence of int, optional
        Shape of the shards that chunks lie in, whole chunks; by default each chunk is a file.
    attributes : mapping, optional
    """
    strings = dtype is str
    kind = np.dtype(np.uint8 if strings else dtype)
    if strings:
        serialiser: dict[str, Any] = {"name": "vlen-utf8", "configuration": {}}
    else:
        serialiser = {"name": "bytes"} if kind.itemsize == 1 else _LITTLE_ENDIAN
    name, configuration = compressor
    codecs = [serialiser, {"name": name, "configuration": dict(configuration)}]
    if shard:
        sharding = {
            "chunk_shape": list(chunk),
            "codecs": codecs,
            "index_codecs": [_LITTLE_ENDIAN, {"name": "crc32c"}],
            "index_location": "end",
        }
        codecs = [{"name": "sharding_indexed", "configuration": sharding}]
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(shape),
        "data_type": "string" if strings else kind.name,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(shard or chunk)}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": "NaN" if isinstance(fill_value, float) and np.isnan(fill_value) else fill_value,
        "codecs": codecs,
        "attributes": dict(attributes or {}),
        "dimension_names": list(dims),
        "storage_transformers": [],
    }
