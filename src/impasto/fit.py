"""Fit reflectance models to a stack and write the maps into the store."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from impasto import store as stores
from impasto.errors import ImpastoError, OptionError, Problem, StoreError, raise_problems
from impasto.joint import Joint, fit_tile
from impasto.models import ModelSpec, parse_model
from impasto.procedure import FitOptions, Procedure
from impasto.progress import progress
from impasto.pyramid import Pyramid
from impasto.streaming import fit_units

__all__ = ["PROCEDURES", "FitOptions", "FitSummary", "ModelFit", "fit", "fit_tile"]

PROCEDURES: dict[str, Callable[[stores.Stack, ModelSpec, FitOptions], Procedure]] = {"joint": Joint}


@dataclass(frozen=True)
class ModelFit:
    """What `fit` did for one model.

    Parameters
    ----------
    model : str
    pixels : dict of str to int
        Number of pixels per status, by its meaning; all of the image.
    already : bool
        Whether the fit was there before, so that nothing was done.
    continued : bool
        Whether an earlier run had done a part.
    seconds : float
    pixels_per_second : float
        Of those that this run fitted, with reading and writing; 0 if none.
    """

    model: str
    pixels: dict[str, int]
    already: bool
    continued: bool
    seconds: float
    pixels_per_second: float


@dataclass(frozen=True)
class FitSummary:
    """What `fit` did.

    Parameters
    ----------
    store : Path
    procedure : str
    photographs : int
        Those that the fits used.
    height, width, channels : int
    clipped_samples : int
        In the whole stack; they were left out.
    models : tuple of ModelFit
    notes : tuple of str
        What was assumed.
    seconds : float
    """

    store: Path
    procedure: str
    photographs: int
    height: int
    width: int
    channels: int
    clipped_samples: int
    models: tuple[ModelFit, ...]
    notes: tuple[str, ...]
    seconds: float


def fit(
    store: str | os.PathLike[str],
    *,
    models: Iterable[str] = ("torrance-sparrow", "phong"),
    procedure: str = "joint",
    options: FitOptions | None = None,
    overwrite: bool = False,
    show_progress: bool | None = None,
) -> FitSummary:
    """Fit models to every pixel of a stack.

    A run that was interrupted, however it ended, is continued by calling again with the same arguments; the
    store then holds the same bytes as after a run that was not. Memory is bounded to about 1 GB whatever the
    size and number of the photographs.

    Parameters
    ----------
    store : path
        A store with a complete stack.
    models : iterable of str, optional
        Names of the models.
    procedure : str, optional
        How to fit: a key of `PROCEDURES`.
    options : FitOptions, optional
    overwrite : bool, optional
        Whether to compute fits again that are complete.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    FitSummary

    Raises
    ------
    OptionError
        If a model, the procedure or an option does not exist or does not suit the stack.
    StoreError
        If the stack is missing, unfinished, damaged or from a newer version, a fit is there that was made
        with other options, or the disk is full.
    """
    started = time.perf_counter()
    path = Path(store)
    stack, procedures = _prepare(path, list(models), procedure, options or FitOptions())
    with stores.run(path, "fit") as log:
        jobs = [_Job(path, stack, name, chosen) for name, chosen in procedures.items()]
        raise_problems(StoreError, [problem for job in jobs for problem in job.problems(overwrite)])
        needed = sum(job.bytes_to_write(overwrite) for job in jobs)
        raise_problems(StoreError, stores.no_room(path, needed))
        done = []
        for job in jobs:
            done.append(job.run(overwrite, show_progress))
            log.write("model", **vars(done[-1]))
    lights, height, width, channels = stack.shape
    return FitSummary(
        store=path,
        procedure=procedure,
        photographs=lights - len((options or FitOptions()).exclude),
        height=height,
        width=width,
        channels=channels,
        clipped_samples=stack.clipped_samples,
        models=tuple(done),
        notes=_notes(stack),
        seconds=time.perf_counter() - started,
    )


def _prepare(
    store: Path, models: list[str], procedure: str, options: FitOptions
) -> tuple[stores.Stack, dict[str, Procedure]]:
    """Open the stack and make the procedures; raise everything that is wrong with either together."""
    problems = options.problems()
    specs: dict[str, ModelSpec] = {}
    for name in models:
        try:
            spec = parse_model(name)
            specs[spec.name] = spec
        except OptionError as error:
            problems += error.problems
    if not models:
        problems.append(Problem("--model", "no model is named", "Name one, such as torrance-sparrow"))
    if procedure not in PROCEDURES:
        choices = ", ".join(PROCEDURES)
        problems.append(Problem("--procedure", f"there is no {procedure!r}", f"Choose from {choices}"))
    try:
        stack = stores.open_stack(store)
    except StoreError as error:
        raise StoreError([*problems, *error.problems]) from error
    problems += _unknown_names(stack, options)
    raise_problems(OptionError, problems)
    procedures = {}
    for name, spec in specs.items():
        try:
            procedures[name] = PROCEDURES[procedure](stack, spec, options)
        except ImpastoError as error:
            problems += error.problems
    raise_problems(OptionError, problems)
    return stack, procedures


def _unknown_names(stack: stores.Stack, options: FitOptions) -> list[Problem]:
    names = stack.lights.names
    return [
        Problem(
            f"--exclude {name}", "the stack has no photograph of this name", f"Use names such as {names[0]}"
        )
        for name in options.exclude
        if name not in names
    ]


def _notes(stack: stores.Stack) -> tuple[str, ...]:
    if stack.light_rgb is None:
        return ("the light's colour is not known: the specular term is taken to be neutral in the stack",)
    return ()


class _Job:
    """One model to be fitted.

    Parameters
    ----------
    store : Path
    stack : Stack
    model : str
    procedure : Procedure
    """

    def __init__(self, store: Path, stack: stores.Stack, model: str, procedure: Procedure) -> None:
        self.store = store
        self.stack = stack
        self.model = model
        self.procedure = procedure
        self.size = stack.shape[1:3]
        settings = dict(procedure.attributes)
        self.attributes: dict[str, Any] = {
            **stores.provenance(),
            **settings,
            "status_meaning": {str(code): text for code, text in stores.STATUS_MEANING.items()},
            "settings_sha256": stores.digest(settings),
        }
        self.found = stores.fit_attributes(store, model)

    @property
    def _same_settings(self) -> bool:
        return (
            self.found is not None and self.found.get("settings_sha256") == self.attributes["settings_sha256"]
        )

    @property
    def _complete(self) -> bool:
        return self.found is not None and bool(self.found.get("complete"))

    @property
    def _continues(self) -> bool:
        # Another version may compute other numbers; one fit must not hold both.
        return (
            self.found is not None
            and not self._complete
            and self._same_settings
            and self.found.get("version") == self.attributes["version"]
        )

    def problems(self, overwrite: bool) -> list[Problem]:
        """Return what forbids the fit: one that is complete and was made otherwise."""
        if overwrite or not self._complete or self._same_settings:
            return []
        return [
            Problem(
                where=f"{self.store}: {stores.fit_group(self.model)}",
                what="holds a fit that was made with other options",
                do="Keep it, or replace it with --overwrite",
            )
        ]

    def bytes_to_write(self, overwrite: bool) -> int:
        """Return about how many bytes the fit still adds to the disk, with its coarser levels."""
        if self._complete and not overwrite:
            return 0
        per_pixel = sum(map.size * np.dtype(map.dtype).itemsize for map in self.procedure.maps)
        groups = (stores.fit_group(self.model), f"{stores.PYRAMIDS}/{self.model}")
        there = sum(stores.size_on_disk(self.store / group) for group in groups)
        # A third more for the coarser levels; nothing less for compression, because the last bits are noise.
        return self.size[0] * self.size[1] * per_pixel * 4 // 3 - there

    def run(self, overwrite: bool, show_progress: bool | None) -> ModelFit:
        """Fit what is missing, then write the coarser levels, then declare the fit complete."""
        started = time.perf_counter()
        if self._complete and not overwrite:
            return self._summary(self.found or {}, started, already=True, continued=False, fitted=0)
        continued = self._continues
        if not continued:
            stores.remove_fit(self.store, self.model)
        maps = self.procedure.maps
        group = stores.fit_group(self.model)
        writer = stores.MapsWriter(self.store, group, maps, *self.size, self.attributes)
        shared = {key: self.attributes[key] for key in ("program", "version", "model", "settings_sha256")}
        pyramid = Pyramid(self.store, self.model, maps, self.size, shared)

        def write(unit: stores.Unit, values: stores.Maps) -> None:
            writer.write(unit, values)
            pyramid.add(unit, values)

        units = pyramid.in_order(writer.unfinished())
        fitted = sum(unit.pixels for unit in units)
        total = self.size[0] * self.size[1]
        with progress(f"Fitting {self.model}", total, done=total - fitted, show=show_progress) as advance:
            fit_units(self.stack, self.procedure, units, write, advance)
        title = f"Coarser levels of {self.model}"
        with progress(title, pyramid.missing_pixels(), show=show_progress) as advance:
            pyramid.finish(advance)
        counts = writer.status_counts()
        pixels = {text: int(counts[code]) for code, text in stores.STATUS_MEANING.items() if counts[code]}
        result = {"pixels": pixels, "clipped_samples": self.stack.clipped_samples}
        writer.finish(result)
        return self._summary(result, started, already=False, continued=continued, fitted=fitted)

    def _summary(
        self, result: dict[str, Any], started: float, *, already: bool, continued: bool, fitted: int
    ) -> ModelFit:
        seconds = time.perf_counter() - started
        return ModelFit(
            model=self.model,
            pixels=result["pixels"],
            already=already,
            continued=continued,
            seconds=seconds,
            pixels_per_second=fitted / seconds,
        )
