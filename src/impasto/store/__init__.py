"""The store of a painting: one Zarr v3 hierarchy that holds the stack of photographs and the fits.

This package alone knows Zarr. docs/store.md specifies the layout for other programs.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.errors import StoreError
from impasto.geometry import Camera, Lights
from impasto.store.evaluations import Evaluation, read_evaluation, write_evaluation
from impasto.store.files import RunLog, digest, log_path, no_room, run, size_on_disk
from impasto.store.fits import (
    Fit,
    Maps,
    MapsWriter,
    fit_attributes,
    fit_problems,
    fitted_models,
    open_fit,
    remove_fit,
)
from impasto.store.hierarchy import (
    coarser_group,
    fit_group,
    provenance,
    read_group,
    source_problems,
    target_problems,
)
from impasto.store.layout import (
    ASSUMED_WHITE,
    BLOCK,
    PYRAMIDS,
    RESIDUAL,
    SCHEMA,
    SHADOWED,
    STACK,
    STACK_CHUNK,
    STATUS_MEANING,
    STATUS_SEVERITY,
    UNIT,
    Map,
    Tile,
    Unit,
    fit_maps,
    level_sizes,
    residual_map,
    shadowed_map,
    unit_at,
    units,
)
from impasto.store.published import PublishedStack, is_published, open_published
from impasto.store.stack_writer import StackHeader, StackWriter, noted_digest
from impasto.store.stacks import Stack, open_stack, stack_problems

if TYPE_CHECKING:
    from xarray import DataTree

__all__ = [
    "ASSUMED_WHITE",
    "BLOCK",
    "PYRAMIDS",
    "RESIDUAL",
    "SCHEMA",
    "SHADOWED",
    "STACK",
    "STACK_CHUNK",
    "STATUS_MEANING",
    "STATUS_SEVERITY",
    "UNIT",
    "Evaluation",
    "Fit",
    "Map",
    "Maps",
    "MapsWriter",
    "PublishedStack",
    "RunLog",
    "Stack",
    "StackHeader",
    "StackWriter",
    "Tile",
    "Unit",
    "camera",
    "coarser_group",
    "digest",
    "fit_attributes",
    "fit_group",
    "fit_maps",
    "fit_problems",
    "fitted_models",
    "is_published",
    "level_sizes",
    "lights",
    "log_path",
    "no_room",
    "noted_digest",
    "open",
    "open_fit",
    "open_published",
    "open_stack",
    "provenance",
    "read_evaluation",
    "read_fit",
    "read_group",
    "read_stack",
    "remove_fit",
    "residual_map",
    "run",
    "shadowed_map",
    "size_on_disk",
    "source_problems",
    "stack_problems",
    "target_problems",
    "unit_at",
    "units",
    "write_evaluation",
]


def open(store: str | Path) -> DataTree:
    """Open a store as an xarray DataTree; arrays are read when used.

    Parameters
    ----------
    store : path
        The folder that `stack` made.

    Returns
    -------
    DataTree
        ``stack`` with dimensions (light, y, x, channel) and the lights as coordinates, ``fits/<model>``,
        ``pyramids/<model>/<level>``, ``evaluations/<model>``. A part whose attribute ``complete``
        is false is still being written.

    Raises
    ------
    StoreError
        If there is no store, or it is from a newer version.
    """
    problems = source_problems(Path(store))
    if problems:
        raise StoreError(problems)
    import xarray

    # Consolidated metadata is no part of Zarr v3, and a copy of `complete` would go stale.
    return xarray.open_datatree(Path(store), engine="zarr", consolidated=False)


def lights(store: str | Path) -> Lights:
    """Return the lights of a store's stack; raises StoreError as `open_stack`."""
    return open_stack(store).lights


def camera(store: str | Path) -> Camera:
    """Return the camera of a store's stack; raises StoreError as `open_stack`."""
    return open_stack(store).camera


def read_stack(
    store: str | Path, rows: slice, columns: slice, lights: ArrayLike | None = None
) -> NDArray[np.float32]:
    """Return relative radiance of a tile of the stack, shape (L, rows, columns, C); see `Stack.radiance`."""
    return open_stack(store).radiance(rows, columns, lights)


def read_fit(store: str | Path, model: str, rows: slice, columns: slice) -> Maps:
    """Return the maps of a tile of a fit by name, each of shape (rows, columns[, k]); see `Fit.read`."""
    return open_fit(store, model).read(rows, columns)
