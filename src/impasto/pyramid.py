"""Coarser levels of a fit, for whoever shows it or reads it from afar."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores

# Each thread holds a window of four units of one map; more threads would only wait for the disk.
_THREADS = 2


def halve(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the mean of each 2 x 2 block, over the pixels that have a value.

    Parameters
    ----------
    values : ndarray of shape (H, W) or (H, W, K), float
        NaN where a pixel has no value.

    Returns
    -------
    ndarray of shape (ceil(H / 2), ceil(W / 2)[, K])
        NaN where no pixel of a block has a value. A block at an odd edge has fewer pixels.
    """
    odd = [(0, values.shape[0] % 2), (0, values.shape[1] % 2)] + [(0, 0)] * (values.ndim - 2)
    if any(after for _, after in odd):
        values = np.pad(values, odd, constant_values=np.nan)
    corners = _corners(values)
    total = (corners[0] + corners[1]) + (corners[2] + corners[3])
    mean: NDArray[np.floating] = total * values.dtype.type(0.25)
    gaps = np.isnan(mean)
    if gaps.any():
        block = np.stack([corner[gaps] for corner in corners])
        known = ~np.isnan(block)
        count = known.sum(axis=0)
        known_total = np.where(known, block, 0).sum(axis=0, dtype=values.dtype)
        mean[gaps] = np.where(count > 0, known_total / np.maximum(count, 1), np.nan)
    return mean


def halve_normal(normal: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the mean direction of each 2 x 2 block of unit normals, shape (H, W, 3); see `halve`."""
    mean = halve(normal)
    length = np.sqrt((mean * mean).sum(axis=-1, keepdims=True))
    direction: NDArray[np.floating] = mean / np.where(length > 0, length, np.nan)
    return direction


def halve_status(status: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the worst status of each 2 x 2 block, in the order of `store.STATUS_SEVERITY`."""
    severity = np.array(stores.STATUS_SEVERITY, np.uint8)
    # A code that this version does not know counts as the worst.
    rank = np.full(256, len(severity) - 1, np.uint8)
    rank[severity] = np.arange(len(severity))
    padded = np.pad(status, [(0, size % 2) for size in status.shape], mode="edge")
    return severity[np.maximum.reduce(_corners(rank[padded]))]


def _corners(values: NDArray[Any]) -> list[NDArray[Any]]:
    return [values[row::2, column::2] for row in (0, 1) for column in (0, 1)]


_HALVE: dict[str, Callable[[NDArray[Any]], NDArray[Any]]] = {"normal": halve_normal, "status": halve_status}


def build_pyramid(
    store: Path,
    model: str,
    maps: tuple[stores.Map, ...],
    size: tuple[int, int],
    attributes: Mapping[str, Any],
    advance: Callable[[int], None],
) -> None:
    """Write the coarser levels of a fit of which every unit is there; levels that are there are kept.

    Parameters
    ----------
    store : Path
    model : str
    maps : tuple of Map
        The maps of the fit.
    size : tuple of int
        Height and width of the fit.
    attributes : mapping
        Attributes that each level shares with the fit.
    advance : callable
        Called with the number of pixels just written.

    Raises
    ------
    StoreError
        If the disk is full, or a map of the finer level is damaged.
    """
    finer = stores.Fit(store, stores.fit_group(model), {})
    with ThreadPoolExecutor(_THREADS, thread_name_prefix="pyramid") as pool:
        for level, (height, width) in enumerate(stores.level_sizes(*size), start=1):
            group = stores.coarser_group(model, level)
            shared = {**attributes, "level": level, "px_per_px": 2**level}
            writer = stores.MapsWriter(store, group, maps, height, width, shared)
            for unit in writer.unfinished():
                _halve_unit(finer, writer, unit, pool)
                advance(unit.pixels)
            writer.finish({})
            finer = stores.Fit(store, group, {})


def _halve_unit(
    finer: stores.Fit, writer: stores.MapsWriter, unit: stores.Unit, pool: ThreadPoolExecutor
) -> None:
    rows = slice(2 * unit.rows.start, min(2 * unit.rows.stop, finer.shape[0]))
    columns = slice(2 * unit.columns.start, min(2 * unit.columns.stop, finer.shape[1]))

    def halve_map(map: stores.Map) -> None:
        values = finer.read(rows, columns, [map.name])[map.name]
        halve_values: Callable[[NDArray[Any]], NDArray[Any]] = _HALVE.get(map.name, halve)
        writer.write_map(unit, map, halve_values(values))

    writer.begin(unit)
    *others, status = writer.maps
    list(pool.map(halve_map, others))
    halve_map(status)
