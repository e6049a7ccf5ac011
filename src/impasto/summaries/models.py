"""What `models` says of a model."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from impasto.models import ModelSpec


def model_lines(spec: ModelSpec) -> Iterator[str]:
    """Yield a model's name, what it is, its shape parameters and its sources."""
    yield spec.name
    yield f"    {spec.title} [{', '.join(spec.citations)}]"
    for parameter in spec.shape:
        yield f"    {parameter.name}: {parameter.meaning}, {parameter.lower:g} to {parameter.upper:g}"
