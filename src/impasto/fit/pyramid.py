"""Coarser levels of a fit, for whoever shows it or reads it from afar."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores

# Each thread holds a window of four blocks of one map; more threads would only wait for the disk.
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
    values = _even(values, constant_values=np.nan)
    # Whole rows first, which lie together; then channel by channel, because numpy is slow along short axes.
    rows = values[0::2] + values[1::2]
    mean = np.empty((rows.shape[0], rows.shape[1] // 2, *rows.shape[2:]), rows.dtype)
    for channel in np.ndindex(rows.shape[2:]):
        np.add(rows[:, 0::2, *channel], rows[:, 1::2, *channel], out=mean[:, :, *channel])
    mean *= values.dtype.type(0.25)
    gaps = np.isnan(mean)
    if gaps.any():
        block = np.stack([corner[gaps] for corner in _corners(values)])
        known = ~np.isnan(block)
        count = known.sum(axis=0)
        known_total = np.where(known, block, 0).sum(axis=0, dtype=values.dtype)
        mean[gaps] = np.where(count > 0, known_total / np.maximum(count, 1), np.nan)
    return mean


def halve_normal(normal: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the mean direction of each 2 x 2 block of unit normals, shape (H, W, 3); see `halve`."""
    mean = halve(normal)
    length = np.sqrt(np.einsum("yxk,yxk->yx", mean, mean))
    mean /= np.where(length > 0, length, np.nan)[..., np.newaxis]
    return mean


def halve_status(status: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the worst status of each 2 x 2 block of (H, W), in the order of `store.STATUS_SEVERITY`."""
    severity = np.array(stores.STATUS_SEVERITY, np.uint8)
    # A code that this version does not know counts as the worst.
    rank = np.full(256, len(severity) - 1, np.uint8)
    rank[severity] = np.arange(len(severity))
    return severity[np.maximum.reduce(_corners(rank[_even(status, mode="edge")]))]


def halve_codes(codes: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the mean of each 2 x 2 block of codes (H, W, K), rounded; linear in what they stand for."""
    first, *others = _corners(_even(codes, mode="edge"))
    total = first + np.uint32(2)
    for corner in others:
        total += corner
    total >>= 2
    return total.astype(np.uint16)


def _even(values: NDArray[Any], **padding: Any) -> NDArray[Any]:
    """Return values (H, W[, K]) with a row and a column more where their number is odd."""
    odd = [(0, size % 2) for size in values.shape[:2]] + [(0, 0)] * (values.ndim - 2)
    return np.pad(values, odd, **padding) if np.any(odd) else values


def _corners(values: NDArray[Any]) -> list[NDArray[Any]]:
    return [values[row::2, column::2] for row in (0, 1) for column in (0, 1)]


def halving(name: str) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return the function that halves the map `name`."""
    special: dict[str, Callable[[NDArray[Any]], NDArray[Any]]] = {
        "normal": halve_normal,
        "residual": halve_codes,
        "status": halve_status,
    }
    return special.get(name, halve)


@dataclass
class _Partial:
    """A block of a coarser level of which a part has been computed."""

    block: stores.Tile
    maps: stores.Maps
    pixels_missing: int


class Pyramid:
    """The coarser levels of a fit.

    Blocks of each level are made of blocks of the finer one while those are in memory; `finish` makes from
    the disk what is missing then.

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
    """

    def __init__(
        self,
        store: Path,
        model: str,
        maps: tuple[stores.Map, ...],
        size: tuple[int, int],
        attributes: Mapping[str, Any],
    ) -> None:
        self._finest = stores.Fit(store, stores.fit_group(model), {})
        sizes = stores.level_sizes(*size)
        self._finer_sizes = [size, *sizes]
        self._levels = [
            stores.MapsWriter(
                store,
                stores.coarser_group(model, level),
                maps,
                *level_size,
                {**attributes, "level": level, "px_per_px": 2**level},
            )
            for level, level_size in enumerate(sizes, start=1)
        ]
        self._partial: dict[int, _Partial] = {}

    @staticmethod
    def in_order(units: Sequence[stores.Unit]) -> list[stores.Unit]:
        """Return units of the fit in the order that `add` needs: those of one coarser block together."""
        return sorted(units, key=lambda unit: _interleaved(unit.row, unit.column))

    def add(self, block: stores.Tile, maps: stores.Maps) -> None:
        """Take the maps of a block of the fit that was just written.

        Raises
        ------
        StoreError
            If the disk is full.
        """
        self._add(0, block, maps)

    def _add(self, number: int, block: stores.Tile, maps: stores.Maps) -> None:
        """Take the maps of a block of the level below `self._levels[number]`."""
        if number == len(self._levels):
            return
        level = self._levels[number]
        parent = _block_at(block.rows.start // 2, block.columns.start // 2, level)
        partial = self._partial.get(number)
        if partial is None or partial.block != parent:
            rows, columns = _below(parent, self._finer_sizes[number])
            partial = self._partial[number] = _Partial(
                parent,
                {map.name: np.empty(map.shape(parent.height, parent.width), map.dtype) for map in level.maps},
                (rows.stop - rows.start) * (columns.stop - columns.start),
            )
        row, column = (
            block.rows.start // 2 - parent.rows.start,
            block.columns.start // 2 - parent.columns.start,
        )

        def halve_map(name: str) -> None:
            half = halving(name)(maps[name])
            partial.maps[name][row : row + half.shape[0], column : column + half.shape[1]] = half

        with ThreadPoolExecutor(_THREADS, thread_name_prefix="pyramid") as pool:
            list(pool.map(halve_map, maps))
        partial.pixels_missing -= block.pixels
        if partial.pixels_missing == 0:
            del self._partial[number]
            level.write(parent, partial.maps)
            self._add(number + 1, parent, partial.maps)

    def close(self) -> None:
        """Drop what was not written to its end; `finish` makes it anew."""
        self._partial.clear()
        for level in self._levels:
            level.close()

    def finish(self, advance: Callable[[int], None]) -> None:
        """Write what is missing of the levels; every unit of the fit must be there.

        Parameters
        ----------
        advance : callable
            Called with the number of pixels just written.

        Raises
        ------
        StoreError
            If the disk is full, or a map of the finer level is damaged.
        """
        finer = self._finest
        with ThreadPoolExecutor(_THREADS, thread_name_prefix="pyramid") as pool:
            for level in self._levels:
                for unit in level.unfinished():
                    _halve_unit(finer, level, unit, pool)
                    advance(unit.pixels)
                level.finish({})
                finer = stores.Fit(level.store, level.group, {})

    def missing_pixels(self) -> int:
        """Return how many pixels `finish` has to write."""
        return sum(unit.pixels for level in self._levels for unit in level.unfinished())


def _interleaved(row: int, column: int) -> int:
    """Return a unit's number on a Z-shaped curve, along which the units of a coarser one lie together."""
    return sum(((row >> bit & 1) << 2 * bit + 1) | ((column >> bit & 1) << 2 * bit) for bit in range(32))


def _block_at(row: int, column: int, level: stores.MapsWriter) -> stores.Tile:
    """Return the block of a level that holds a pixel."""
    top, left = row - row % stores.BLOCK, column - column % stores.BLOCK
    return stores.Tile(
        slice(top, min(top + stores.BLOCK, level.height)), slice(left, min(left + stores.BLOCK, level.width))
    )


def _below(block: stores.Tile, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns of the finer level, of `size`, that a block is made of."""
    return (
        slice(2 * block.rows.start, min(2 * block.rows.stop, size[0])),
        slice(2 * block.columns.start, min(2 * block.columns.stop, size[1])),
    )


def _halve_unit(
    finer: stores.Fit, level: stores.MapsWriter, unit: stores.Unit, pool: ThreadPoolExecutor
) -> None:
    with closing(level):
        for block in unit.blocks():
            rows, columns = _below(block, finer.shape)

            def halve_map(map: stores.Map, rows: slice = rows, columns: slice = columns) -> NDArray[Any]:
                return halving(map.name)(finer.read(rows, columns, [map.name])[map.name])

            halves = pool.map(halve_map, level.maps)
            level.write(block, {map.name: half for map, half in zip(level.maps, halves, strict=True)})
