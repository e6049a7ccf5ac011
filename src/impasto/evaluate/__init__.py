"""Judge renderings by photographs that the fit has not seen."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.colour import encode_srgb
from impasto.errors import OptionError, Problem, StoreError
from impasto.evaluate.baselines import BaselineErrors, baseline_errors
from impasto.evaluate.errors import ErrorAccumulator, ImageErrors, mean_errors
from impasto.evaluate.held_out import fold_lights, listed_lights, named_lights, spread_lights
from impasto.evaluate.results import LightErrors, ModelErrors, join_baselines, join_models
from impasto.evaluate.shares import ErrorShares, Photographed, error_shares
from impasto.fit import FitOptions, fit
from impasto.geometry import Lights, zenith_azimuth
from impasto.light_strength import scale_lights
from impasto.models import ModelSpec, parse_models
from impasto.progress import progress
from impasto.render import render_bands
from impasto.store import (
    Fit,
    Stack,
    fit_attributes,
    fitted_models,
    open_fit,
    open_stack,
    write_evaluation,
)
from impasto.store.borrow import borrowed_stack

__all__ = [
    "BaselineErrors",
    "ErrorShares",
    "EvaluateSummary",
    "ImageErrors",
    "LightErrors",
    "ModelErrors",
    "evaluate",
]

_DEFAULT_MODELS = ("torrance-sparrow", "phong")
_DEFAULT_HELD_OUT = 5
# The renderings that are kept for a report are thinned out to this many pixels along their longer side.
_KEPT_PX = 640


@dataclass(frozen=True)
class EvaluateSummary:
    """What `evaluate` found.

    Parameters
    ----------
    store : Path
        The store.
    held_out : tuple of str
        Photographs that no fit has seen.
    fitted : int
        Photographs that the fits have seen.
    models : tuple of ModelErrors
        One entry per model.
    baselines : tuple of BaselineErrors
        One entry per relighting method without a model, fitted to the same photographs.
    not_recorded : str
        Why the store could not keep the result for `report`; empty where it could.
    seconds : float
    """

    store: Path
    held_out: tuple[str, ...]
    fitted: int
    models: tuple[ModelErrors, ...]
    baselines: tuple[BaselineErrors, ...]
    not_recorded: str
    seconds: float


def evaluate(
    store: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    held_out: int | None = None,
    held_out_lights: str | PathLike[str] | Sequence[str] | None = None,
    folds: int | None = None,
    baselines: bool = True,
    show_progress: bool | None = None,
) -> EvaluateSummary:
    """Render photographs that were kept out of the fit, and compare.

    Each model is fitted again without these photographs, with the options of its fit in the store, into a
    temporary store; the fits in the store stay as they are. Where the fit in the store was made without them,
    it is judged itself. The errors, and the renderings at a size to look at, are kept in the store, where
    `report` finds them.

    Parameters
    ----------
    store : path
        Store with a stack.
    models : sequence of str, optional
        Models to judge; by default those fitted in the store, or Torrance-Sparrow and Phong.
    held_out : int, optional
        How many photographs to hold out, spread in elevation; 5 by default, fewer where there are few.
    held_out_lights : path or sequence of str, optional
        Which photographs to hold out instead: a file that names them, or their names.
    folds : int, optional
        Hold out every photograph once instead, in so many rounds of fits, each spread in elevation and
        azimuth. The store keeps nothing of it, because no one fit stands for the result.
    baselines : bool, optional
        Whether to judge the relighting methods in use too, fitted to the same photographs.
    show_progress : bool, optional
        Whether to show progress bars; by default, if standard error is a terminal.

    Returns
    -------
    EvaluateSummary

    Raises
    ------
    OptionError
        If more than one way to choose photographs is used, a name is unknown, or no photographs are left to
        fit.
    StoreError
        If the stack is missing, unfinished or damaged.
    """
    started = time.perf_counter()
    path = Path(store)
    specs = parse_models(models or fitted_models(path) or _DEFAULT_MODELS)
    stack = open_stack(path)
    rounds = _rounds(stack.lights, held_out, held_out_lights, folds)
    judged = [_judge(stack, specs, held, baselines, folds is None, show_progress) for held in rounds]
    held = [index for fold in rounds for index in fold]
    return EvaluateSummary(
        store=path,
        held_out=tuple(stack.lights.names[index] for index in held),
        fitted=len(stack.lights) - max(len(fold) for fold in rounds),
        models=tuple(join_models([found.models[place] for found in judged]) for place in range(len(specs))),
        baselines=join_baselines([found.baselines for found in judged]),
        not_recorded=judged[0].not_recorded,
        seconds=time.perf_counter() - started,
    )


def _rounds(
    lights: Lights,
    count: int | None,
    chosen: str | PathLike[str] | Sequence[str] | None,
    folds: int | None,
) -> list[list[int]]:
    """Return which photographs are held out in each round of fits."""
    if folds is None:
        return [_held_out(lights, count, chosen)]
    if count is not None or chosen is not None:
        raise OptionError(
            Problem(
                where="--folds",
                what="holds out every photograph once, and others were chosen too",
                do="Leave out --held-out and --held-out-lights",
            )
        )
    return fold_lights(lights, folds)


@dataclass(frozen=True)
class _Judged:
    """What one round found."""

    models: tuple[ModelErrors, ...]
    baselines: tuple[BaselineErrors, ...]
    not_recorded: str


def _judge(
    stack: Stack,
    specs: Sequence[ModelSpec],
    held: Sequence[int],
    baselines: bool,
    record: bool,
    show_progress: bool | None,
) -> _Judged:
    """Fit without photographs where that was not done, and compare renderings with them."""
    path = stack.store
    names = tuple(stack.lights.names[index] for index in held)
    results = []
    not_recorded = ""
    with ExitStack() as keep:
        borrowed: Path | None = None
        for spec in specs:
            procedure, options = _settings(path, spec.name)
            unseen = spec.name in fitted_models(path) and set(names) <= set(options.exclude)
            source = path
            if not unseen:
                borrowed = borrowed or keep.enter_context(borrowed_stack(path))
                source = borrowed
                blind = replace(options, exclude=tuple(sorted({*options.exclude, *names})))
                fit(
                    source,
                    models=[spec.name],
                    procedure=procedure,
                    options=blind,
                    show_progress=show_progress,
                )
            fitted = open_fit(source, spec.name)
            lights = stack.lights.select(np.asarray(held))
            errors, kept = _compare(fitted, stack, held, lights, show_progress)
            alone = followed = None
            if fitted.attributes.get("residual"):
                alone = _mean(_compare(fitted, stack, held, lights, show_progress, residual=False)[0])
            if (scaled := scale_lights(fitted.attributes, lights)) is not lights:
                followed = _mean(_compare(fitted, stack, held, scaled, show_progress)[0])
            result = ModelErrors(
                model=spec.name,
                procedure=str(fitted.attributes["procedure"]),
                refitted=not unseen,
                lights=errors,
                mean=_mean(errors),
                without_residual=alone,
                as_photographed=followed,
                shares=_shares(fitted, stack, spec, options, held),
            )
            results.append(result)
            if not record:  # of several rounds no one fit stands for the result
                continue
            try:
                write_evaluation(path, spec.name, _record(result, fitted, stack, kept), kept)
            except StoreError as error:  # a store that may only be read can be judged all the same
                not_recorded = str(error)
    seen = [number for number in range(len(stack.lights)) if number not in held]
    without_model = baseline_errors(stack, seen, held, show_progress) if baselines else ()
    return _Judged(tuple(results), without_model, not_recorded)


def _shares(
    fitted: Fit, stack: Stack, spec: ModelSpec, options: FitOptions, held: Sequence[int]
) -> ErrorShares | None:
    """Return whose the error is on the photographs held out; None by the paper's procedure."""
    if fitted.attributes["procedure"] != "joint":
        return None
    return error_shares(spec, Photographed.of(fitted, stack, held), options.settled(fitted.attributes))


def _held_out(
    lights: Lights, count: int | None, chosen: str | PathLike[str] | Sequence[str] | None
) -> list[int]:
    if count is not None and chosen is not None:
        raise OptionError(
            Problem(
                where="--held-out and --held-out-lights",
                what="both choose photographs, and one of them is expected",
                do="Leave one of them out",
            )
        )
    if chosen is None:
        usual = min(_DEFAULT_HELD_OUT, max(1, len(lights) // 4))
        return spread_lights(lights, usual if count is None else count)
    if isinstance(chosen, str | PathLike):
        return named_lights(chosen, lights.names)
    return listed_lights([(f"held-out photograph {name}", name) for name in chosen], lights.names)


def _settings(store: Path, model: str) -> tuple[str | None, FitOptions]:
    """Return the procedure and the options of the fit in the store, or the default ones."""
    found = fit_attributes(store, model)
    if not found:
        return None, FitOptions()
    return found["procedure"], FitOptions.of(found)


def _compare(
    fitted: Fit,
    stack: Stack,
    held: Sequence[int],
    lights: Lights,
    show_progress: bool | None,
    *,
    residual: bool = True,
) -> tuple[tuple[LightErrors, ...], NDArray[np.float32]]:
    """Return the errors of renderings of the held-out photographs under lights, and these thinned out."""
    _, height, width, channels = stack.shape
    gathered = [ErrorAccumulator(height, width, channels) for _ in held]
    step = _step(stack)
    kept = np.empty((len(held), -(-height // step), -(-width // step), channels), np.float32)
    with progress(f"Comparing {fitted.attributes['model']}", height, show=show_progress) as advance:
        for band in render_bands(fitted, lights, stack.camera, residual=residual):
            photographs = stack.radiance(band.rows, slice(0, width), held)
            for photograph, rendering, sums in zip(photographs, band.radiance, gathered, strict=True):
                sums.add(
                    photograph,
                    rendering,
                    encode_srgb(photograph),
                    encode_srgb(rendering),
                    photograph >= stack.clip_level,
                )
            first = -(-band.rows.start // step)
            shown = band.radiance[:, first * step - band.rows.start :: step, ::step]
            kept[:, first : first + shown.shape[1]] = shown
            advance(band.rows.stop - band.rows.start)
    zenith, azimuth = np.degrees(zenith_azimuth(lights.direction))
    errors = tuple(
        LightErrors(name, float(zenith[index]), float(azimuth[index]), gathered[index].result())
        for index, name in enumerate(lights.names)
    )
    return errors, kept


def _mean(errors: Sequence[LightErrors]) -> ImageErrors:
    return mean_errors([entry.errors for entry in errors])


def _step(stack: Stack) -> int:
    return -(-max(stack.shape[1:3]) // _KEPT_PX)


def _record(result: ModelErrors, fitted: Fit, stack: Stack, kept: NDArray[np.float32]) -> dict[str, Any]:
    """Return what the store keeps of a result, and which fit of which stack it is about."""
    return {
        **asdict(result),
        **{
            name: fitted.attributes[name]
            for name in ("index_of_refraction", "fresnel", "options", "photographs")
        },
        "stack_sha256": stack.sha256,
        "px_per_px": _step(stack),
    }
