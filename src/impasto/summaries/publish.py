"""What `publish` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import count

if TYPE_CHECKING:
    from impasto.publish import PublishSummary


def publish_lines(summary: PublishSummary) -> Iterator[str]:
    """Yield what `publish` wrote, and how exact it is."""
    width, height = summary.size
    models = ", ".join(summary.models)
    yield f"{models} at {width} x {height} pixels and {count(summary.levels - 1, 'coarser size')}"
    yield f"{summary.out}: {count(summary.files, 'file')}, {summary.bytes / 1e6:.1f} MB"
    if summary.photographs:
        yield f"{count(summary.photographs, 'photograph')} to compare with"
    yield (
        f"packed into 16 bits: parameters to {100 * summary.parameter_error:.3f} % of their value, normals "
        f"to {summary.normal_error:.1e} in x and y"
    )
    if summary.with_residual:
        yield (
            f"with the residual term of {', '.join(summary.with_residual)}, packed into 8 bits: to "
            f"{summary.residual_error:.1e} (rms) of the square root of radiance where it is small"
        )
    yield f"Look at it with: python3 -m http.server --directory {summary.out}"
