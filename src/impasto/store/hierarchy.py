"""Groups and arrays of a store's Zarr v3 hierarchy.

Metadata are small JSON documents, written here directly and atomically, and so are small arrays; large ones
are written by `chunks` and `shards`. Arrays are read by `array_reader`.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from impasto.errors import Problem, StoreError
from impasto.store.array_reader import ArrayReader
from impasto.store.arrays import array_document
from impasto.store.codecs import strings_encode, zstd_encode
from impasto.store.files import is_partial, write_json, write_whole, writing
from impasto.store.layout import FITS, PYRAMIDS, SCHEMA, STACK, ZSTD

Attributes = dict[str, Any]


def provenance() -> Attributes:
    """Return the attributes that say which program wrote a group."""
    try:
        program_version = version("impasto")
    except PackageNotFoundError:  # run from its sources without being installed
        program_version = "unknown"
    return {"program": "impasto", "version": program_version}


def read_group(path: Path) -> Attributes | None:
    """Return the attributes of the group at `path`, or None where no group is.

    Raises
    ------
    StoreError
        If its metadata cannot be read.
    """
    document = path / "zarr.json"
    try:
        metadata = json.loads(document.read_text(encoding="utf-8"))
        if metadata["node_type"] != "group":
            return None
        attributes: Attributes = metadata.get("attributes", {})
        if not isinstance(attributes, dict):
            raise TypeError(f"its attributes are {attributes!r:.40}, expected an object")
        return attributes
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(
            Problem(
                where=str(document),
                what=f"is not readable as Zarr v3 metadata: {error}",
                do="Restore it from a copy, or make the store anew",
            )
        ) from error


def write_group(store: Path, path: str, attributes: Mapping[str, Any]) -> None:
    """Write the metadata of the group `path` ("" for the root), whole or not at all."""
    with writing(store, f"{path or 'the store'}/zarr.json".lstrip("/")):
        write_json(
            store / path / "zarr.json",
            {"zarr_format": 3, "node_type": "group", "attributes": dict(attributes)},
        )


def target_problems(store: Path) -> list[Problem]:
    """Return what forbids to make or change a store at `store`; nothing there or an empty folder is fine."""
    if not store.exists():
        return []
    if not store.is_dir():
        return [
            Problem(str(store), "is a file, and a store is a folder", "Choose another name for the store")
        ]
    if all(is_partial(path) for path in store.iterdir()):
        return []
    return source_problems(store)


def source_problems(store: Path) -> list[Problem]:
    """Return what is wrong with the store as a whole: missing, something else, or from a newer version."""
    try:
        attributes = read_group(store)
    except StoreError as error:
        return error.problems
    if not store.exists():
        return [Problem(str(store), "there is no such store", "Make it with: impasto stack PHOTOS STORE")]
    schema = None if attributes is None else attributes.get("impasto_schema")
    if not isinstance(schema, int) or isinstance(schema, bool) or schema < 1:
        return [
            Problem(
                where=str(store),
                what="is not an impasto store (its zarr.json is missing or has no impasto_schema)",
                do="Give the folder that impasto stack made; nothing was changed here",
            )
        ]
    if schema > SCHEMA:
        return [
            Problem(
                where=str(store),
                what=f"has schema {schema}, and this version of impasto knows schemas up to {SCHEMA}",
                do="Use the version of impasto that made it, or a newer one; nothing was changed here",
            )
        ]
    return []


def remove(store: Path, *paths: str) -> None:
    """Remove groups of an impasto store, their metadata first, so that none of them looks whole meanwhile.

    Raises
    ------
    StoreError
        If `store` is not an impasto store of a schema that this version knows, or the disk refuses.
    """
    problems = source_problems(store)
    if problems:
        raise StoreError(problems)
    for path in paths:
        with writing(store, f"{path}/zarr.json"):
            (store / path / "zarr.json").unlink(missing_ok=True)
    for path in paths:
        if (store / path).exists():
            with writing(store, path):
                shutil.rmtree(store / path)


def write_array_metadata(store: Path, path: str, document: Mapping[str, Any]) -> None:
    """Write the metadata of an array, as `array_document` makes it, whole or not at all."""
    with writing(store, f"{path}/zarr.json"):
        write_json(store / path / "zarr.json", document)


def read_array_metadata(store: Path, path: str) -> Attributes | None:
    """Return the metadata of an array as they stand, or None where they cannot be read."""
    try:
        found: Attributes = json.loads((store / path / "zarr.json").read_text(encoding="utf-8"))
        return found
    except (OSError, ValueError):
        return None


def write_table(
    store: Path,
    path: str,
    values: NDArray[np.number] | Sequence[str],
    dims: tuple[str, ...],
    attributes: Attributes,
    *,
    rows: int | None = None,
) -> None:
    """Write an array as a whole, in chunks of `rows` along its first axis, by default in one.

    Strings are those of variable length; `rows` divides the length of numbers.
    """
    names = not isinstance(values, np.ndarray)
    data = np.array(values, object) if names else np.ascontiguousarray(values)
    rows = rows or len(data)
    document = array_document(
        data.shape,
        (rows, *data.shape[1:]),
        dims,
        str if names else data.dtype,
        fill_value="" if names else float("nan"),
        compressor=("zstd", ZSTD),
        attributes=attributes,
    )
    write_array_metadata(store, path, document)
    ending = "/0" * (data.ndim - 1)
    with writing(store, path):
        for number in range(0, len(data), rows):
            part = data[number : number + rows]
            if names:
                chunk = np.frombuffer(strings_encode(part.tolist()), np.uint8)
            else:
                chunk = part.astype(part.dtype.newbyteorder("<"), copy=False)
            write_whole(store / path / f"c/{number // rows}{ending}", zstd_encode(chunk, ZSTD["level"]))


def open_array(store: Path, path: str) -> ArrayReader:
    """Open an array of a store to read it.

    Raises
    ------
    StoreError
        If it is not there or its metadata cannot be read.
    """
    try:
        document = json.loads((store / path / "zarr.json").read_text(encoding="utf-8"))
        return ArrayReader(store / path, document)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise StoreError(
            Problem(
                where=f"{store}: {path}",
                what=f"is missing or its metadata are damaged: {error}",
                do="Restore it from a copy, or run the command that made it again with --overwrite",
            )
        ) from error


def array_problems(
    store: Path, path: str, array: ArrayReader, shape: Sequence[int], dtype: DTypeLike, do: str
) -> list[Problem]:
    """Return what is wrong with an array that has another shape or type than it has to have."""
    found, expected = (array.shape, array.dtype), (tuple(shape), np.dtype(dtype))
    if found == expected:
        return []
    words = [f"{'strings' if kind.hasobject else kind} of shape {size}" for size, kind in (found, expected)]
    return [Problem(f"{store}: {path}", f"is {words[0]}, expected {words[1]}", do)]


def thinned_shape(store: Path, step: int) -> tuple[int, ...] | None:
    """Return height, width and channels of photographs at every `step`-th pixel, None without photographs."""
    path = f"{STACK}/radiance"
    shape = open_array(store, path).shape if has_array(store, path) else ()
    if len(shape) != 4:
        return None
    return *(-(-length // step) for length in shape[1:3]), shape[3]


def has_array(store: Path, path: str) -> bool:
    """Return whether the metadata of the array at `path` are there."""
    return (store / path / "zarr.json").is_file()


def coarser_group(model: str, level: int) -> str:
    """Return the path of a coarser level of a fit; level 1 has half the size."""
    return f"{PYRAMIDS}/{model}/{level}"


def fit_group(model: str) -> str:
    """Return the path of a fit."""
    return f"{FITS}/{model}"
