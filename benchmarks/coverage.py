"""How often limits of scale values cover the truth: python -m benchmarks.coverage.

Simulated experiments whose scale is known, by the code that makes the limits. Prints tables and writes them
to coverage.md and coverage.json beside this file; --quick takes a twentieth of the experiments and writes
nothing.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from scipy.special import ndtr
from scipy.stats import binom

from impasto.psychophysics.scaling.closed_form import fit_closed_form
from impasto.psychophysics.scaling.comparisons import Comparisons
from impasto.psychophysics.scaling.likelihood import pair_design
from impasto.psychophysics.scaling.limits import half_width, limits, montag_notes, montag_sigma
from impasto.psychophysics.scaling.resampling import resample_experiments

LEVEL = 0.95
CONDITIONS = (3, 5, 7)
OBSERVERS = (18, 54)
DIFFERENCES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
TIES_DIFFERENCES = (0.0, 0.5, 1.0, 1.5)
TIES_THRESHOLDS = (0.2, 0.6)
MONTAG_DIFFERENCES = (0.0, 0.5, 1.0, 1.5, 2.0)
EXPERIMENTS = 2000
DRAWS = 200


@dataclass(frozen=True)
class Coverage:
    """How often limits cover, in one situation.

    Parameters
    ----------
    values, differences : float
        Mean over the scale values, and over all differences.
    least : float
        The least of any scale value or difference.
    """

    values: float
    differences: float
    least: float


def equally_spaced(conditions: int, difference: float, *, ends: bool) -> np.ndarray:
    """Return a scale whose neighbours, or whose ends, are `difference` apart; shape (C,)."""
    step = difference / (conditions - 1) if ends else difference
    return step * np.arange(conditions)


def contrasts(conditions: int) -> np.ndarray:
    """Return the weights of the values of mean 0, then of the differences; shape (K, C)."""
    design, _, _ = pair_design(conditions)
    return np.vstack([np.eye(conditions) - 1 / conditions, design])


def simulate(
    scale: np.ndarray, observers: int, experiments: int, seed: int, *, answers: int = 1, variety: float = 0.0
) -> np.ndarray:
    """Return how often each observer chose the first condition of each pair; shape (M, O, K)."""
    random = np.random.default_rng(seed)
    design, _, _ = pair_design(len(scale))
    seen = scale + variety * random.normal(size=(experiments, observers, len(scale)))
    return random.binomial(answers, ndtr(seen @ design.T)).astype(np.float64)


def cover(
    scale: np.ndarray,
    observers: int,
    experiments: int,
    seed: int,
    *,
    answers: int = 1,
    variety: float = 0.0,
    draws: int = DRAWS,
) -> dict[str, Coverage]:
    """Return the coverage by the method "observers" and by either of its two halves alone.

    With variety between observers, the scale that an experiment finds is that of all people's answers, in
    units of the observers' noise and variety together.
    """
    chosen = simulate(scale, observers, experiments, seed, answers=answers, variety=variety)
    estimate, independent, drawn = resample_experiments(
        chosen, answers - chosen, conditions=len(scale), draws=draws, random=np.random.default_rng(seed + 1)
    )
    weights = contrasts(len(scale))
    truth = weights @ scale / np.sqrt(1 + 2 * variety**2)
    off = np.abs(estimate @ weights.T - truth)
    first, second = (np.einsum("ki,mij,kj->mk", weights, each, weights) for each in (independent, drawn))
    pooled = observers if answers > 1 else None
    nothing = np.zeros_like(first)
    return {
        "observers": _summary(off <= half_width(first, second, LEVEL, pooled), len(scale)),
        "independent": _summary(off <= half_width(first, nothing, LEVEL, pooled), len(scale)),
        "bootstrap alone": _summary(off <= half_width(nothing, second, LEVEL, pooled), len(scale)),
    }


def cover_ties(
    scale: np.ndarray, observers: int, experiments: int, seed: int, *, threshold: float, draws: int = DRAWS
) -> tuple[Coverage, float]:
    """Return the coverage by the method "observers" where answers may be ties, and the share of ties."""
    random = np.random.default_rng(seed)
    conditions = len(scale)
    design, first, second = pair_design(conditions)
    truth = design @ scale
    values, nothing = scale - scale.mean(), np.zeros((conditions, conditions))
    names = tuple(map(str, range(conditions))), tuple(map(str, range(observers)))
    inside, tied = np.empty((experiments, conditions + len(truth)), dtype=bool), 0.0
    for number in range(experiments):
        seen = truth + random.normal(size=(observers, len(truth)))
        wins, ties = np.zeros((2, observers, conditions, conditions))
        wins[:, first, second], wins[:, second, first] = seen > threshold, seen < -threshold
        ties[:, first, second] = ties[:, second, first] = np.abs(seen) <= threshold
        found = limits(
            Comparisons(*names, wins, ties, nothing, nothing), level=LEVEL, draws=draws, seed=number
        )
        low = np.r_[found.low, found.difference_low[first, second]]
        high = np.r_[found.high, found.difference_high[first, second]]
        inside[number] = (low <= np.r_[values, truth]) & (np.r_[values, truth] <= high)
        tied += float(np.mean(np.abs(seen) <= threshold))
    return _summary(inside, conditions), tied / experiments


def cover_montag(scale: np.ndarray, observers: int, experiments: int, seed: int) -> tuple[Coverage, float]:
    """Return the coverage of Montag's formula, and the share of experiments that object to it."""
    chosen = simulate(scale, observers, experiments, seed).sum(axis=1)
    conditions = len(scale)
    _, first, second = pair_design(conditions)
    sigma = montag_sigma(conditions, observers)
    bounds = (
        1.959964
        * sigma
        * np.r_[np.ones(conditions), np.full(len(first), np.sqrt(2 * conditions / (conditions - 1)))]
    )
    weights = contrasts(conditions)
    inside, noted = np.empty((experiments, len(weights)), dtype=bool), 0
    for number, wins in enumerate(chosen):
        counts = np.zeros((conditions, conditions))
        counts[first, second], counts[second, first] = wins, observers - wins
        found = fit_closed_form(counts).scale
        inside[number] = np.abs(weights @ (found - scale)) <= bounds
        noted += bool(montag_notes(conditions, observers, found))
    return _summary(inside, conditions), noted / experiments


def cover_exact(observers: int, differences: np.ndarray) -> np.ndarray:
    """Return the coverage of the exact limits for two conditions at each difference, without simulation."""
    covered = np.zeros(len(differences))
    for chosen in range(observers + 1):
        counts = np.array([[0, chosen], [observers - chosen, 0]])
        found = limits(Comparisons.of_counts(counts), method="exact", level=LEVEL)
        inside = (found.difference_low[0, 1] <= differences) & (differences <= found.difference_high[0, 1])
        covered += inside * binom.pmf(chosen, observers, ndtr(differences))
    return covered


def _summary(inside: np.ndarray, conditions: int) -> Coverage:
    share = inside.mean(axis=0)
    return Coverage(float(share[:conditions].mean()), float(share[conditions:].mean()), float(share.min()))


def study(design: str, experiments: int) -> list[dict]:
    """Return all situations of a part of the study, with the coverage in each."""
    found = []
    for conditions, observers in product(CONDITIONS, OBSERVERS):
        for number, difference in enumerate(DIFFERENCES):
            scale = equally_spaced(conditions, difference, ends=design == "ends")
            methods = cover(scale, observers, experiments, 100 * conditions + number)
            found.append({"n": conditions, "N": observers, "z": difference, **_data(methods)})
    return found


def study_ties(experiments: int) -> list[dict]:
    """Return the coverage where answers may be ties."""
    found = []
    for conditions, observers, threshold in product((3, 5), OBSERVERS, TIES_THRESHOLDS):
        for difference in TIES_DIFFERENCES:
            scale = equally_spaced(conditions, difference, ends=False)
            ties, share = cover_ties(scale, observers, experiments // 2, 11, threshold=threshold)
            row = {"n": conditions, "N": observers, "threshold": threshold, "z": difference, "share": share}
            found.append(row | _data({"observers": ties}))
    return found


def study_montag(experiments: int) -> list[dict]:
    """Return the coverage of Montag's formula."""
    found = []
    for conditions, observers, difference in product((2, 3, 4, 5, 7), OBSERVERS, MONTAG_DIFFERENCES):
        scale = equally_spaced(conditions, difference, ends=False)
        montag, noted = cover_montag(scale, observers, max(experiments // 4, 100), 7)
        row = {"n": conditions, "N": observers, "z": difference, "noted": noted}
        found.append(row | _data({"montag": montag}))
    return found


def study_pooled(experiments: int) -> list[dict]:
    """Return the coverage where each observer answers seven times."""
    found = []
    for conditions, observers, variety in product((2, 3), OBSERVERS, (0.0, 0.3, 0.6)):
        for difference in (0.0, 0.75, 1.5):
            scale = equally_spaced(conditions, difference, ends=False)
            methods = cover(scale, observers, experiments // 2, 9, answers=7, variety=variety)
            row = {"n": conditions, "N": observers, "variety": variety, "z": difference}
            found.append(row | _data(methods))
    return found


def study_exact() -> list[dict]:
    """Return the coverage of the exact limits."""
    found = []
    for observers in OBSERVERS:
        covered = cover_exact(observers, np.arange(0, 1.501, 0.01))
        found.append({"N": observers, "least": covered.min(), "mean": covered.mean(), "most": covered.max()})
    return found


PARTS: dict[str, Callable[[int], list[dict]]] = {
    "neighbours": lambda experiments: study("neighbours", experiments),
    "ends": lambda experiments: study("ends", experiments),
    "ties": study_ties,
    "montag": study_montag,
    "pooled": study_pooled,
    "exact": lambda _: study_exact(),
}


def _data(methods: dict[str, Coverage]) -> dict[str, dict[str, float]]:
    return {method: asdict(coverage) for method, coverage in methods.items()}


def tables(found: dict[str, list[dict]], experiments: int) -> str:
    """Return the results as Markdown."""
    error = 100 * np.sqrt(LEVEL * (1 - LEVEL) / experiments)
    lines = [
        "# Coverage of the limits",
        "",
        "Measured by `python -m benchmarks.coverage`: how often limits at "
        f"95 % cover the truth, in per cent. {experiments} simulated experiments for each column of the "
        f"first tables, {DRAWS} draws of the observers in each; the coverage of one value is known to "
        f"±{error:.1f} (standard error), means are known better. n: stimuli, equally spaced; N: observers, "
        "one answer each to every pair. *Values* is the mean over the scale values, *differences* over those "
        "of all pairs, *least* the least of all of them.",
    ]
    for design, where in (("neighbours", "neighbours"), ("ends", "the first and the last stimulus")):
        lines += ["", f"## Default method, {where} at a distance of", ""]
        lines += _wide_table(found[design], "observers")
    lines += ["", "## The bootstrap's variance alone, neighbours at a distance of", ""]
    lines += _wide_table(found["neighbours"], "bootstrap alone")
    lines += ["", "## Seven answers of each observer to each pair, pooled", ""]
    lines += ["Differences; *variety* is the standard deviation between observers of each scale value.", ""]
    lines += ["| n | N | variety | distance | default | as if independent |", "|---|---|---|---|---|---|"]
    lines += [
        f"| {row['n']} | {row['N']} | {row['variety']:g} | {row['z']:g} z | "
        f"{_percent(row['observers']['differences'])} | {_percent(row['independent']['differences'])} |"
        for row in found["pooled"]
    ]
    lines += ["", "## Answers that may be ties, neighbours at a distance of", ""]
    lines += [
        "Differences, and in brackets the least of any value or difference; half as many experiments. "
        "*threshold* is Glenn and David's, *ties* the share of the answers that are ties, at the least and "
        "the largest distance.",
        "",
    ]
    header = " | ".join(f"{difference:g} z" for difference in TIES_DIFFERENCES)
    lines += [f"| n | N | threshold | ties | {header} |", "|" + "---|" * (len(TIES_DIFFERENCES) + 4)]
    for start in range(0, len(found["ties"]), len(TIES_DIFFERENCES)):
        rows = found["ties"][start : start + len(TIES_DIFFERENCES)]
        cells = [
            f"{_percent(row['observers']['differences'])} ({_percent(row['observers']['least'])})"
            for row in rows
        ]
        lines.append(
            f"| {rows[0]['n']} | {rows[0]['N']} | {rows[0]['threshold']:g} z | "
            f"{100 * rows[0]['share']:.0f} – {100 * rows[-1]['share']:.0f} % | {' | '.join(cells)} |"
        )
    lines += ["", "## Montag's formula, neighbours at a distance of", ""]
    lines += [
        "Scale values; in brackets the share of experiments in which the output objects to the formula.",
        "",
    ]
    header = " | ".join(f"{difference:g} z" for difference in MONTAG_DIFFERENCES)
    lines += [f"| n | N | {header} |", "|" + "---|" * (len(MONTAG_DIFFERENCES) + 2)]
    for (conditions, observers), rows in _grouped(found["montag"]):
        cells = [f"{_percent(row['montag']['values'])} ({100 * row['noted']:.0f})" for row in rows]
        lines.append(f"| {conditions} | {observers} | {' | '.join(cells)} |")
    lines += ["", "## Exact limits for two stimuli", ""]
    lines += ["Computed, not simulated, for distances from 0 to 1.5 z in steps of 0.01.", ""]
    lines += ["| N | least | mean | most |", "|---|---|---|---|"]
    lines += [
        f"| {row['N']} | {_percent(row['least'])} | {_percent(row['mean'])} | {_percent(row['most'])} |"
        for row in found["exact"]
    ]
    return "\n".join(lines) + "\n"


def _grouped(rows: list[dict]) -> list[tuple[tuple[int, int], list[dict]]]:
    keys = dict.fromkeys((row["n"], row["N"]) for row in rows)
    return [(key, [row for row in rows if (row["n"], row["N"]) == key]) for key in keys]


def _wide_table(rows: list[dict], method: str) -> list[str]:
    header = " | ".join(f"{difference:g} z" for difference in DIFFERENCES)
    lines = [f"| n | N | of | {header} | mean |", "|" + "---|" * (len(DIFFERENCES) + 4)]
    for (conditions, observers), group in _grouped(rows):
        for what in ("values", "differences", "least"):
            shares = [row[method][what] for row in group]
            cells = [_percent(share) for share in shares]
            cells.append("" if what == "least" else _percent(float(np.mean(shares))))
            lines.append(f"| {conditions} | {observers} | {what} | {' | '.join(cells)} |")
    return lines


def _percent(share: float) -> str:
    return f"{100 * share:.1f}"


def missed(found: dict[str, list[dict]]) -> list[str]:
    """Return the figures that miss their bar: 93 % everywhere, 93 to 97 % on average."""
    bad = []
    for part in ("neighbours", "ends", "ties"):
        for (conditions, observers), rows in _grouped(found[part]):
            for what in ("values", "differences"):
                shares = [row["observers"][what] for row in rows]
                if min(shares) < 0.93 or not 0.93 <= np.mean(shares) <= 0.97:
                    bad.append(f"{part} n={conditions} N={observers} {what}: {np.round(shares, 3)}")
    return bad


def main() -> int:
    """Run the study and return how many figures miss their bar."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coverage", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a twentieth of the experiments; writes nothing")
    parser.add_argument("--part", action="append", choices=PARTS, help="keep what was found for the others")
    arguments = parser.parse_args()
    file = Path(__file__).with_name("coverage.json")
    experiments = EXPERIMENTS // 20 if arguments.quick else EXPERIMENTS
    found = json.loads(file.read_text(encoding="utf-8")) if arguments.part else {}
    found |= {part: PARTS[part](experiments) for part in arguments.part or PARTS}
    text = tables(found, experiments)
    print(text)
    bad = missed(found)
    print("\n".join(bad) or "all bars are met")
    if not arguments.quick:
        file.with_suffix(".md").write_text(text, encoding="utf-8")
        file.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return len(bad)


if __name__ == "__main__":
    raise SystemExit(1 if main() else 0)
