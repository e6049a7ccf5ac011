"""The paper's tables, with its printed values beside those of the re-enactment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from scipy.stats import spearmanr

from impasto.reproduce.printed import PRINTED
from impasto.reproduce.sample import MODELS, PROCEDURES, FittedSample, VirtualSample
from impasto.summaries.words import Row

Table = tuple[str, Row, list[Row]]
_UNKNOWN = "not identified"


def tables(samples: Mapping[str, VirtualSample]) -> Iterator[Table]:
    """Yield for each table what it shows, the columns' names, and the rows."""
    yield from _ratio_tables(samples)
    yield _gloss_table(samples)
    yield _error_table(samples)
    yield _band_table(samples)


def _ratio_tables(samples: Mapping[str, VirtualSample]) -> Iterator[Table]:
    """Yield Table II, a table per model."""
    for model in MODELS:
        rows: list[Row] = []
        for name, sample in samples.items():
            printed = PRINTED[name]
            was = printed.ratio_torrance_sparrow if model == MODELS[0] else printed.ratio_phong
            cells = (_ratio(sample.fitted[procedure], model) for procedure in PROCEDURES)
            rows.append((name, printed.gloss_level, sample.material, f"{was:g}", *cells))
        header = ("sample", "gloss", "material of ours", "printed", *PROCEDURES)
        yield f"As/Ad of {model}, mean of the pixels, Ad in luminance (Table II)", header, rows


def _gloss_table(samples: Mapping[str, VirtualSample]) -> Table:
    """Return Table I."""
    rows: list[Row] = []
    for name, sample in samples.items():
        for angle, truth in sample.gloss.items():
            printed = PRINTED[name].gloss.get(angle)
            cells = (_number(sample.fitted[procedure].gloss.get(angle, math.nan)) for procedure in PROCEDURES)
            was = "not printed" if printed is None else f"{printed:g}"
            rows.append((f"{name}, {angle:.0f}°", was, _number(truth), *cells))
    header = ("sample and angle", "printed", "our true material", *(f"fitted, {p}" for p in PROCEDURES))
    return (
        "Glossmeter readings, gloss units (Table I); fitted: Torrance-Sparrow, pixels laid flat",
        header,
        rows,
    )


def _error_table(samples: Mapping[str, VirtualSample]) -> Table:
    rows: list[Row] = []
    for name, sample in samples.items():
        for model in MODELS:
            cells = []
            for procedure in PROCEDURES:
                found = sample.fitted[procedure].models.get(model)
                cells.append(
                    f"{found.rms:.3g} ({_error(found.rms_highlight)}, {_error(found.rms_elsewhere)})"
                    if found
                    else _UNKNOWN
                )
            rows.append((f"{name}, {model}", *cells))
    return "RMS / mean over all lights (at highlights, elsewhere)", ("sample and model", *PROCEDURES), rows


def _band_table(samples: Mapping[str, VirtualSample]) -> Table:
    """Return the errors of the curves, as the ellipses of Figs. 7 and 8 point them out."""
    rows: list[Row] = []
    for name, sample in samples.items():
        curve = sample.fitted["paper"].curve
        for model in MODELS if curve else ():
            assert curve is not None
            errors = curve.models[model].signed_error.values()
            rows.append((f"{name}, {model}", *("no light" if e is None else f"{e:+.1%}" for e in errors)))
    header = ("sample and model", "peak", "shoulder", "rest")
    return "Model minus measurement of the curves below, paper's procedure (Figs. 6 to 8)", header, rows


def findings(samples: Mapping[str, VirtualSample]) -> Iterator[str]:
    """Yield what agrees with the paper and what does not, from the numbers."""
    for procedure in PROCEDURES:
        for model in MODELS:
            pairs = []
            for name, sample in samples.items():
                found = sample.fitted[procedure].models.get(model)
                printed = PRINTED[name]
                if found and found.ratio:
                    was = printed.ratio_torrance_sparrow if model == MODELS[0] else printed.ratio_phong
                    pairs.append((was, found.ratio.mean))
            if len(pairs) > 2:
                order = float(spearmanr(*zip(*pairs, strict=True)).statistic)
                yield (
                    f"As/Ad of {model} by the {procedure} procedure: rank correlation {order:.2f} with the "
                    f"printed order of {len(pairs)} samples"
                )
        errors = {
            name: [model.rms for model in sample.fitted[procedure].models.values()]
            for name, sample in samples.items()
            if sample.fitted[procedure].models
        }
        better = [name for name, (first, second) in errors.items() if first < second]
        yield (
            f"{procedure} procedure: Torrance-Sparrow has the smaller error in {len(better)} of "
            f"{len(errors)} samples ({', '.join(better) or 'none'})"
        )


def _ratio(fitted: FittedSample, model: str) -> str:
    found = fitted.models.get(model)
    ratio = found.ratio if found else None
    return _UNKNOWN if ratio is None else f"{ratio.mean:.4g} ({ratio.low:.3g} – {ratio.high:.3g})"


def _error(value: float) -> str:
    return "no light" if math.isnan(value) else f"{value:.3g}"


def _number(value: float) -> str:
    return _UNKNOWN if math.isnan(value) else f"{value:.3g}"
