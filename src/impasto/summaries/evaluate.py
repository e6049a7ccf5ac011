"""What `evaluate` says when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from impasto.summaries.words import Row, percent

if TYPE_CHECKING:
    from impasto.evaluate import EvaluateSummary, ImageErrors

_ERRORS = ("PSNR dB", "SSIM", "RMS / mean", "ΔE00")


def evaluate_tables(summary: EvaluateSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield a heading, the columns' names and the rows for each model, by light, and for the baselines."""
    header = ("held-out light", "zenith", *_ERRORS)
    for model in summary.models:
        rows: list[Row] = [
            (
                entry.name,
                f"{entry.zenith_deg:.1f}°",
                *_errors(entry.errors),
            )
            for entry in model.lights
        ]
        rows.append(("mean", "", *_errors(model.mean)))
        if model.without_residual is not None:
            rows.append(("mean, model alone", "", *_errors(model.without_residual)))
        if model.as_photographed is not None:
            rows.append(("mean, as photographed", "", *_errors(model.as_photographed)))
        how = "fitted again without them" if model.refitted else "the fit in the store has not seen them"
        yield f"{model.model} ({model.procedure}; {how})", header, rows
    shared = [(model.model, model.shares) for model in summary.models if model.shares is not None]
    if shared:
        yield (
            "Whose the squared error on the held-out photographs is, of the model alone",
            ("model", "the model's", "the lights'", "shadows'", "noise's", "too few photographs"),
            [
                (name, *map(percent, (found.model, found.lights, found.shadows, found.noise, found.sampling)))
                for name, found in shared
            ],
        )
    if summary.baselines:
        yield (
            "Methods without a model, fitted to the same photographs (mean)",
            ("method", "coefficients", *_ERRORS),
            [
                (f"{found.method}, in {found.scale} values", str(found.coefficients), *_errors(found.mean))
                for found in summary.baselines
            ],
        )


def _errors(errors: ImageErrors) -> Row:
    return (
        f"{errors.psnr_db:.2f}",
        f"{errors.ssim:.4f}",
        f"{errors.rms_relative:#.4g}",
        f"{errors.ciede2000:.2f}",
    )
