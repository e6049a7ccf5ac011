"""Renderings of photographs that the fit had not seen, and how far they are from them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from impasto.fit import FitOptions
from impasto.maps.pictures import draw_difference
from impasto.page import Picture, Section
from impasto.pixels import luminance
from impasto.report.subject import Subject, drawn
from impasto.store import Evaluation, Fit, read_evaluation

_SHOWN_LIGHTS = 3
_AS_PHOTOGRAPHED = "mean, as photographed"


def section(subject: Subject) -> Section:
    """Return the errors that `evaluate` kept, with signed difference images, or how to get them."""
    page = Section("Photographs kept out of the fit")
    found = {model: read_evaluation(subject.store, model) for model in subject.models}
    current = {model: each for model, each in found.items() if each and is_current(each, subject, model)}
    old = [model for model, each in found.items() if each and model not in current]
    if old:
        page.notes(
            "Out of date",
            [f"{model}: evaluated before the photographs or the options of its fit changed" for model in old],
        )
    if not current:
        page.text(
            "No photographs were kept out, so nothing here says how good renderings under other lights are. "
            "This measures it and keeps the result for the next report:"
        )
        page.commands([f"impasto evaluate {subject.store.name}"])
        return page
    page.text(
        "These photographs judge the renderings, because the fits behind them had not seen them. RMS / mean "
        "compares relative radiance where samples are not clipped; PSNR and SSIM compare pictures in sRGB."
    )
    if any(each.attributes.get("as_photographed") for each in current.values()):
        page.text(
            "Renderings are under lights as strong as stated, so by how much the lamp of a photograph was "
            f"stronger or weaker counts as error. “{_AS_PHOTOGRAPHED}” is the mean where renderings follow "
            "the strengths that the other photographs tell."
        )
    for model, each in current.items():
        page.table(
            ("photograph", "light from the normal", "RMS / mean", "PSNR, dB", "SSIM"),
            _rows(each),
            caption=f"{model}, fitted to the other {each.attributes['photographs']} photographs",
            total=True,
        )
    _add_pictures(page, subject, current)
    return page


def is_current(evaluation: Evaluation, subject: Subject, model: str) -> bool:
    """Return whether an evaluation is about the stack and the fit that are in the store now."""
    same_stack = evaluation.attributes["stack_sha256"] == subject.stack.sha256
    return same_stack and _settings(evaluation) == _settings(subject.fits[model])


def _settings(made: Evaluation | Fit) -> tuple[object, ...]:
    """Return what decides a fit but for the photographs left out, which an evaluation adds to."""
    options = {**made.attributes["options"], "exclude": []}
    return made.attributes["procedure"], FitOptions.of({**made.attributes, "options": options})


def _rows(evaluation: Evaluation) -> list[tuple[str, ...]]:
    def cells(errors: Mapping[str, float | None]) -> tuple[str, ...]:
        formats = {"rms_relative": ".4f", "psnr_db": ".2f", "ssim": ".4f"}
        return tuple(
            "unknown" if errors[name] is None else format(errors[name], how) for name, how in formats.items()
        )

    found = evaluation.attributes
    lights = found["lights"]
    rows = [(entry["name"], f"{entry['zenith_deg']:.1f}°", *cells(entry["errors"])) for entry in lights]
    if found.get("as_photographed"):
        rows.append((_AS_PHOTOGRAPHED, "", *cells(found["as_photographed"])))
    return [*rows, ("mean", "", *cells(found["mean"]))]


def _add_pictures(page: Section, subject: Subject, current: Mapping[str, Evaluation]) -> None:
    """Add photograph, renderings and differences for a few lights, those that all models were judged by."""
    lights = next(iter(current.values())).attributes["lights"]
    judged = [{entry["name"] for entry in each.attributes["lights"]} for each in current.values()]
    shown = [entry for entry in lights if entry["name"] in set.intersection(*judged)]
    shown.sort(key=lambda entry: entry["zenith_deg"])
    if not shown:
        return
    shown = [
        shown[i] for i in dict.fromkeys(np.linspace(0, len(shown) - 1, _SHOWN_LIGHTS).round().astype(int))
    ]
    renderings = {model: _by_name(each) for model, each in current.items()}
    differences = {}
    for entry in shown:
        light = subject.stack.lights.names.index(entry["name"])
        photograph = subject.photograph(light)
        known = (photograph < subject.stack.clip_level).all(axis=-1)
        for model in current:
            difference = luminance(renderings[model][entry["name"]]) - luminance(photograph)
            differences[entry["name"], model] = np.where(known, difference, np.nan)
    finite = np.concatenate([np.abs(each[np.isfinite(each)]) for each in differences.values()])
    limit = float(np.percentile(finite, 99)) if finite.size else 1.0
    mm_per_px = subject.stack.camera.mm_per_px
    for entry in shown:
        name, where = entry["name"], f"light {entry['zenith_deg']:.0f}° from the normal"
        page.heading(f"{name}, {where}")
        light = subject.stack.lights.names.index(name)
        alt = f"The painting as photographed, {where}."
        pictures = [subject.shown(subject.photograph(light), "Photograph", alt, light)]
        for model in current:
            alt = f"The painting as {model} renders it, {where}."
            pictures.append(subject.shown(renderings[model][name], f"Rendering, {model}", alt, light))
        page.pictures(pictures)
        page.pictures(
            [
                _difference(differences[name, model], model, where, limit, mm_per_px, subject.step)
                for model in current
            ],
            columns=2,
        )


def _by_name(evaluation: Evaluation) -> dict[str, NDArray[np.float32]]:
    names = [entry["name"] for entry in evaluation.attributes["lights"]]
    return dict(zip(names, evaluation.renderings(), strict=True))


def _difference(
    difference: NDArray[np.floating], model: str, where: str, limit: float, mm_per_px: float | None, step: int
) -> Picture:
    data = drawn(
        draw_difference,
        difference,
        title=f"Rendering − photograph · {model}",
        limit=limit,
        mm_per_px=mm_per_px * step if mm_per_px else None,
        px_per_px=step,
    )
    finite = difference[np.isfinite(difference)]
    bias = float(finite.mean()) if finite.size else float("nan")
    alt = (
        f"Signed difference in luminance under a {where}: mean {bias:+.3g}, 99 % of all within ±{limit:.3g} "
        "relative radiance; clipped pixels are grey."
    )
    return Picture(data, f"Rendering − photograph, {model}", alt=alt)
