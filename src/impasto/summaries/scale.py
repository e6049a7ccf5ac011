"""What `scale` says when it is done."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from impasto.summaries.words import Row, count

if TYPE_CHECKING:
    from impasto.psychophysics.scaling.groups import FitTest, ScaledGroup
    from impasto.psychophysics.scaling.observers import ObserverReport
    from impasto.psychophysics.scaling.scale import ScaleSummary

Table = tuple[str, Row, list[Row], Sequence[str]]


def scale_tables(summary: ScaleSummary) -> Iterator[Table]:
    """Yield for each group, then for the observers, a heading, the columns' names, rows, and notes."""
    yield from (_group_table(group, summary) for group in summary.groups)
    yield _observer_table(summary)
    if summary.physical:
        rows: list[Row] = [
            (
                error.name,
                f"{100 * error.predicted:.1f} %",
                f"{100 * error.low:.1f} – {100 * error.high:.1f} %",
                _number(error.correlation, 2),
            )
            for error in summary.physical
        ]
        header = ("measured difference", "chosen is the smaller", "95 % limits", "correlation with the scale")
        yield "Does a measured difference predict the choice? Chance is 50 %.", header, rows, ()


def _group_table(group: ScaledGroup, summary: ScaleSummary) -> Table:
    header = ("", summary.unit, "low", "high", "standard error", "not told from")
    rows: list[Row] = []
    for number, name in enumerate(group.conditions):
        alike = [
            other
            for index, other in enumerate(group.conditions)
            if index != number
            and group.difference_low[number, index] <= 0 <= group.difference_high[number, index]
        ]
        told = (_number(values[number]) for values in (group.scale, group.low, group.high))
        error = group.standard_error[number]
        rows.append((name, *told, "none" if math.isnan(error) else f"{error:.3f}", ", ".join(alike)))
    heading = f"{group.name}: {count(group.answers, 'answer')}, {count(group.observers, 'observer')}"
    return heading, header, rows, [*_tests(group), *group.notes]


def _tests(group: ScaledGroup) -> Iterator[str]:
    """Yield what the tests of a group say, where they were possible."""
    if not math.isnan(group.p_value):
        yield f"exact binomial test of no difference: p = {_p(group.p_value)}"
    fits = (("G²", group.deviance), ("Mosteller's χ²", group.mosteller))
    told = [_test(name, test) for name, test in fits if not math.isnan(test.p_value)]
    if told:
        yield "fit of the model: " + "; ".join(told)
    if group.agreement is not None and len(group.conditions) > 2:
        yield f"Kendall's u = {group.agreement.u:.3f}, p = {_p(group.agreement.p_value)} against chance"
    if not math.isnan(group.threshold):
        yield f"{count(group.ties, 'tie')}; an answer is a tie within ±{group.threshold:.3f} of indifference"
    if not math.isnan(group.position):
        yield f"advantage of the left: {_number(group.position)} (standard error {group.position_error:.3f})"


def _test(name: str, test: FitTest) -> str:
    verdict = ": the model does not describe these answers" if test.p_value < 0.05 else ""
    return f"{name} = {test.statistic:.2f} with {test.degrees_of_freedom} df, p = {_p(test.p_value)}{verdict}"


def _observer_table(summary: ScaleSummary) -> Table:
    header = ("observers", "answers", "log10 likelihood", "ζ", "same again", "catch trials", "left", "")
    rows: list[Row] = []
    for report in summary.observers:
        again = f"{report.same_again} of {report.asked_again}" if report.asked_again else ""
        left = "" if math.isnan(report.chose_left) else f"{100 * report.chose_left:.0f} %"
        rows.append(
            (
                report.observer,
                str(report.answers),
                _number(report.log10_likelihood),
                "" if math.isnan(report.consistency) else f"{report.consistency:.2f}",
                again,
                f"{report.caught} of {report.catches}" if report.catches else "",
                left,
                ", ".join(_remarks(report, summary.excluded)),
            )
        )
    notes = [
        f"{report.observer} answers the opposite of the others (likelihood ratio e^{report.log_reversed:.1f})"
        for report in summary.observers
        if report.reversed
    ]
    return "Each observer beside the scale of all others", header, rows, notes


def _remarks(report: ObserverReport, excluded: Sequence[str]) -> Iterator[str]:
    if report.simulated:
        yield "simulated"
    if report.reversed:
        yield "REVERSED"
    elif report.outlying:
        yield f"unlike the others ({report.distance:.1f})"
    if report.observer in excluded:
        yield "left out"


def scale_lines(summary: ScaleSummary) -> Iterator[str]:
    """Yield how the values are meant, and where the figures lie."""
    from impasto.psychophysics.scaling.groups import MODELS, UNITS
    from impasto.psychophysics.scaling.limits import METHODS

    if summary.simulated:
        yield f"SIMULATED: {count(summary.simulated, 'observer')} of these are a program, not people"
    yield f"model: {MODELS[summary.options.model]}; mean 0; unit {UNITS[summary.unit]}"
    for method in dict.fromkeys(group.limits for group in summary.groups):
        if method in METHODS:
            yield f"limits at {100 * summary.options.level:g} % by {method}: {METHODS[method]}"
    yield "not told from: conditions whose difference has limits on both sides of 0, each pair by itself"
    if summary.excluded:
        yield f"left out on request: {', '.join(summary.excluded)}"
    flagged = [report.observer for report in summary.observers if report.outlying or report.reversed]
    if flagged:
        yield f"to be looked at: {', '.join(flagged)}; nobody is left out unasked (--exclude does it)"
    if summary.files:
        yield f"{count(len(summary.files), 'file')} in {summary.files[0].parent}"


def _number(value: float, digits: int = 3) -> str:
    if math.isnan(value):
        return "none"
    return "unbounded" if math.isinf(value) else f"{value:+.{digits}f}".replace("-", "−")


def _p(value: float) -> str:
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1e}"
