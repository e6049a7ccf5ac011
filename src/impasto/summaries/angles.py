"""What `angles` says when it is done."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from impasto.summaries.words import Row, count, seconds

if TYPE_CHECKING:
    from impasto.angles import AnglesSummary, ModelStudy
    from impasto.angles.identifiability import Identifiability
    from impasto.angles.plan import CheckSummary, PlanSummary
    from impasto.angles.study import Point

# Fits this many times worse than expected have found other minima.
_LOST = 2.0
_PLACED = {"optimal": "optimally", "even": "evenly", "informed": "by the highlights"}
_MEASURES = {
    "rms": "RMS over mean radiance, verified and expected",
    "psnr": "PSNR in dB, verified and expected",
    "ciede2000": "CIEDE2000 from the renderings of all photographs, 95th percentile",
}
_WAYS = {
    "optimal": "optimal",
    "even": "evenly spaced",
    "informed": "by the highlights",
    "exhaustive": "best of all sets",
}


def angles_lines(summary: AnglesSummary) -> Iterator[str]:
    """Yield what was chosen from, what judged, and what is recommended."""
    by = (
        f"judged by {count(len(summary.scored), 'photograph')} that the choice never saw"
        if summary.held_out
        else "judged by all of them, also those that were fitted"
    )
    yield f"{count(len(summary.candidates), 'photograph')} to choose from, {by}"
    if summary.in_plane:
        yield (
            "the lights lie in one plane: fits and renderings keep to it, as the normals' tilt out of it is "
            "not told"
        )
    for model in summary.models:
        whole = model.regions[0]
        best = whole.best
        yield (
            f"{model.model}: {best.size} of {len(summary.candidates)} photographs serve "
            f"({summary.tolerance}), placed {_PLACED[best.strategy]}: {', '.join(best.photographs)}"
        )
        low, middle, high = model.highlights.width_deg
        if not math.isnan(middle):
            yield (
                f"{model.model}: highlights {middle:.1f}° wide ({low:.1f} to {high:.1f}°), normals tilted "
                f"{model.highlights.theta_deg[0]:.1f} to {model.highlights.theta_deg[2]:.1f}° along and "
                f"{model.highlights.phi_deg[0]:.1f} to {model.highlights.phi_deg[2]:.1f}° across"
            )
    if summary.files:
        yield f"files: {', '.join(map(str, summary.files))}"
    yield f"({seconds(summary.seconds)})"


def angles_tables(summary: AnglesSummary) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield for each model its errors by the number of photographs, then how many serve each region."""
    for model in summary.models:
        yield _errors(model, summary.tolerance.measure)
        rows: list[Row] = []
        for region in model.regions:
            for strategy, point in region.recommended.items():
                rows.append(
                    (region.name, f"{region.pixels:,}", _WAYS[strategy], *_point(point, region.full.rms))
                )
        yield (
            f"{model.model}: fewest photographs, {summary.tolerance} of all {len(summary.candidates)}",
            ("", "pixels", "placed", "photographs", "RMS/mean", "of all", "expected", "PSNR dB", "CIEDE2000"),
            rows,
        )
        if model.image_rms:
            yield (
                f"{model.model}: over every pixel of the image",
                ("set", "RMS/mean"),
                [(name, f"{rms:.5f}") for name, rms in model.image_rms.items()],
            )


def _errors(model: ModelStudy, measure: str) -> tuple[str, Row, list[Row]]:
    strategies = list(dict.fromkeys(point.strategy for point in model.points))
    found = {(point.strategy, point.size): point for point in model.points}
    rows: list[Row] = []
    for random in model.random:
        row = [str(random.size)]
        for strategy in strategies:
            point = found[strategy, random.size]
            if measure == "ciede2000":
                row += [f"{point.errors.ciede2000:.2f}"]
            elif measure == "psnr":
                row += [f"{point.errors.psnr_db:.2f}", f"({point.expected:.2f})"]
            else:
                row += [f"{point.errors.rms:.5f}", f"({point.expected:.5f})"]
        if measure == "rms":
            row += [f"{random.median:.4f}", f"{random.low:.4f} – {random.high:.4f}"]
        rows.append(tuple(row))
    expected = [] if measure == "ciede2000" else ["(expected)"]
    columns = [cell for strategy in strategies for cell in (_WAYS[strategy], *expected)]
    if measure == "rms":
        columns += ["random", "5 to 95 %"]
    return f"{model.model}: {_MEASURES[measure]}", ("photographs", *columns), rows


def _point(point: Point, full: float) -> Row:
    errors = point.errors
    return (
        str(point.size),
        f"{errors.rms:.5f}",
        f"{errors.rms / full:.3f}",
        f"{point.expected:.4g}",
        f"{errors.psnr_db:.2f}",
        f"{errors.ciede2000:.2f}",
    )


def check_lines(summary: CheckSummary) -> Iterator[str]:
    """Yield what was checked, and what the lights do not tell."""
    yield f"{count(summary.lights, 'light')} for {summary.surface}"
    yield from _sentences(summary.identifiability)


def plan_lines(summary: PlanSummary) -> Iterator[str]:
    """Yield where the lights go, and what that is worth."""
    yield f"{count(len(summary.lights), 'light')} for {summary.surface}:"
    if summary.kind == "arm":
        angle = np.degrees(np.arctan2(summary.direction[:, 0], summary.direction[:, 2]))
        yield "  arm angles " + ", ".join(f"{each:.0f}°" for each in angle)
    yield (
        f"RMS of renderings over their mean: expected {100 * summary.expected_rms:.2f} %, in fits to "
        f"simulated photographs {100 * summary.simulated_rms:.2f} %; for lights spread evenly "
        f"{100 * summary.even_expected_rms:.2f} and {100 * summary.even_simulated_rms:.2f} %"
    )
    if summary.simulated_rms > _LOST * summary.expected_rms:
        yield "- from so few photographs some fits go astray: plan for more lights"
    yield from _sentences(summary.identifiability)
    yield f"files: {', '.join(map(str, summary.files))}"


def _sentences(found: Identifiability) -> Iterator[str]:
    for sentence in found.sentences or ("every parameter is told in most of this surface",):
        yield f"- {sentence}"


def check_tables(found: Identifiability) -> Iterator[tuple[str, Row, list[Row]]]:
    """Yield the expected uncertainties of each parameter, by the width of the highlight."""
    rows: list[Row] = []
    for name in [each.parameter for each in found.kinds[0].uncertainties] if found.kinds else []:
        row = [name]
        for kind in found.kinds:
            value = next(each for each in kind.uncertainties if each.parameter == name)
            unit = "°" if value.unit == "deg" else " %"
            row.append(f"{value.sd:.2g}{unit} ({value.sd_95:.2g})" if value.told >= 0.5 else "not told")
        rows.append(tuple(row))
    rows.append(("peak seen", *(f"{100 * kind.seen:.0f} %" for kind in found.kinds)))
    header = [
        f"{kind.name}, {kind.width_deg[0]:.0f} to {kind.width_deg[1]:.0f}°"
        if not math.isnan(kind.width_deg[0])
        else kind.name
        for kind in found.kinds
    ]
    yield (
        "expected standard deviation, median (95th percentile), by width of the highlight",
        ("", *header),
        rows,
    )
