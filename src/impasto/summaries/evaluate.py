"""What `evaluate` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import Row

if TYPE_CHECKING:
    from impasto.evaluate import EvaluateSummary


def evaluate_tables(summary: EvaluateSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield for each model a heading, the columns' names, and a row per held-out light and for the mean."""
    header = ("held-out light", "zenith", "PSNR dB", "SSIM", "RMS / mean")
    for model in summary.models:
        rows: list[Row] = [
            (
                entry.name,
                f"{entry.zenith_deg:.1f}°",
                f"{entry.errors.psnr_db:.2f}",
                f"{entry.errors.ssim:.4f}",
                f"{entry.errors.rms_relative:#.4g}",
            )
            for entry in model.lights
        ]
        mean = model.mean
        rows.append(("mean", "", f"{mean.psnr_db:.2f}", f"{mean.ssim:.4f}", f"{mean.rms_relative:#.4g}"))
        how = "fitted again without them" if model.refitted else "the fit in the store has not seen them"
        yield f"{model.model} ({model.procedure}; {how})", header, rows
