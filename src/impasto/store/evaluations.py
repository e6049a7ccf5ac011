"""What was found when a model was judged by photographs that its fit had not seen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import StoreError, raise_problems
from impasto.store.attributes import EVALUATION, attribute_problems
from impasto.store.files import reading
from impasto.store.hierarchy import (
    Attributes,
    array_problems,
    open_array,
    provenance,
    read_group,
    remove,
    thinned_shape,
    write_group,
    write_table,
)
from impasto.store.layout import EVALUATIONS

_ARRAY = "radiance"
_AGAIN = "Run impasto evaluate again"


@dataclass(frozen=True)
class Evaluation:
    """A recorded evaluation of one model.

    Parameters
    ----------
    store : Path
    attributes : dict
        The attributes of the group, as docs/store.md lists them.
    """

    store: Path
    attributes: Attributes = field(repr=False)

    def renderings(self) -> NDArray[np.float32]:
        """Return the renderings of the held-out lights, every `px_per_px`-th pixel, shape (L, H, W, C).

        Raises
        ------
        StoreError
            If they are damaged, or not one of each held-out light at the size of the photographs.
        """
        path = f"{EVALUATIONS}/{self.attributes['model']}/{_ARRAY}"
        array = open_array(self.store, path)
        picture = thinned_shape(self.store, self.attributes["px_per_px"]) or array.shape[1:]
        shape = (len(self.attributes["lights"]), *picture)
        raise_problems(StoreError, array_problems(self.store, path, array, shape, "float32", _AGAIN))
        with reading(self.store, path, _AGAIN):
            if array.lost():
                raise ValueError("a part of the renderings is lost")
            return array.read()


def write_evaluation(
    store: Path, model: str, attributes: Mapping[str, Any], radiance: NDArray[np.float32]
) -> None:
    """Record an evaluation in the place of an earlier one of the model.

    Parameters
    ----------
    store : Path
    model : str
    attributes : mapping
        As docs/store.md lists them; numbers that are not finite become null.
    radiance : ndarray of shape (L, H, W, C)
        The renderings, thinned out.

    Raises
    ------
    StoreError
        If the disk is full or refuses.
    """
    group = f"{EVALUATIONS}/{model}"
    remove(store, group)
    if read_group(store / EVALUATIONS) is None:
        write_group(store, EVALUATIONS, {})
    dims = ("light", "y", "x", "channel")
    said = {"long_name": "relative radiance as rendered", "units": "1"}
    write_table(store, f"{group}/{_ARRAY}", radiance, dims, said, rows=1)
    write_group(store, group, {**provenance(), "model": model, **_strict(attributes), "complete": True})


def read_evaluation(store: Path, model: str) -> Evaluation | None:
    """Return the recorded evaluation of a model, or None where there is none.

    Raises
    ------
    StoreError
        If its attributes are damaged.
    """
    group = f"{EVALUATIONS}/{model}"
    attributes = read_group(store / group)
    if not attributes or not attributes.get("complete"):
        return None
    raise_problems(StoreError, attribute_problems(store, group, attributes, EVALUATION, _AGAIN))
    return Evaluation(store, attributes)


def _strict(value: Any) -> Any:
    """Return `value` with null for numbers that JSON has no word for."""
    if isinstance(value, Mapping):
        return {key: _strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
