"""Fit reflectance models to a stack and write the maps into the store."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from impasto import store as stores
from impasto.arm import find_arm
from impasto.errors import ImpastoError, OptionError, Problem, StoreError, raise_problems
from impasto.fit import ambient
from impasto.fit.joint import Joint
from impasto.fit.paper import Paper
from impasto.fit.procedure import Findings, FitOptions, Procedure
from impasto.fit.pyramid import Pyramid
from impasto.fit.streaming import fit_units
from impasto.fit.tile import fit_tile
from impasto.models import ModelSpec, parse_model
from impasto.progress import progress

__all__ = ["PROCEDURES", "FitOptions", "FitSummary", "ModelFit", "fit", "fit_tile"]

PROCEDURES: dict[str, Callable[[stores.Stack, ModelSpec, FitOptions], Procedure]] = {
    "joint": Joint,
    "paper": Paper,
}


@dataclass(frozen=True)
class ModelFit:
    """What `fit` did for one model.

    Parameters
    ----------
    model : str
    procedure : str
        How it was fitted, in words.
    pixels : dict of str to int
        Number of pixels per status, by its meaning; all of the image.
    already : bool
        Whether the fit was there before, so that nothing was done.
    continued : bool
        Whether an earlier run had done a part.
    seconds : float
    pixels_per_second : float
        Of those that this run fitted, with reading and writing; 0 if none.
    notes : tuple of str
        What the procedure cannot know, what it assumed instead, and what it found.
    """

    model: str
    procedure: str
    pixels: dict[str, int]
    already: bool
    continued: bool
    seconds: float
    pixels_per_second: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FitSummary:
    """What `fit` did.

    Parameters
    ----------
    store : Path
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
    procedure: str | None = None,
    options: FitOptions | None = None,
    choose_ambient: bool = False,
    overwrite: bool = False,
    show_progress: bool | None = None,
    say: Callable[[str], None] | None = None,
) -> FitSummary:
    """Fit models to every pixel of a stack.

    A run that was interrupted, however it ended, is continued by calling again with the same arguments; the
    store then holds the same bytes as after a run that was not. Memory is bounded to about 1 GB whatever the
    size and number of the photographs, and about 1.4 bytes per pixel more where reflectance is shared.

    Parameters
    ----------
    store : path
        A store with a complete stack.
    models : iterable of str, optional
        Names of the models.
    procedure : str, optional
        How to fit: a key of `PROCEDURES`. By default ``joint``, or, for lights in one plane, ``paper`` in its
        refined form where it is defined for the model.
    options : FitOptions, optional
    choose_ambient : bool, optional
        Whether each model is fitted with or without its ambient term, whichever its name says, as lights left
        out bear out; see `ambient.choose_ambient`.
    overwrite : bool, optional
        Whether to compute fits again that are complete.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.
    say : callable, optional
        Called with each note of the summary as soon as it is known, which for most is before the long work.

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
    say = say or (lambda note: None)
    stack, procedures, notes = _prepare(path, list(models), procedure, options or FitOptions())
    for note in notes:
        say(note)
    with stores.run(path, "fit") as log:
        found = {name: (made, Findings()) for name, made in procedures.items()}
        if choose_ambient:
            found = ambient.choose_ambient(stack, procedures, options or FitOptions(), show_progress)
        jobs = [_Job(path, stack, name, *chosen) for name, chosen in found.items()]
        raise_problems(StoreError, [problem for job in jobs for problem in job.problems(overwrite)])
        needed = sum(job.bytes_to_write(overwrite) for job in jobs)
        raise_problems(StoreError, stores.no_room(path, needed))
        for job in jobs:
            job.prepare(overwrite, show_progress)
        for note in dict.fromkeys(note for job in jobs for note in job.notes):
            say(f"{', '.join(job.model for job in jobs if note in job.notes)}: {note}")
        done = []
        for job in jobs:
            done.append(job.run(overwrite, show_progress, say))
            log.write("model", **vars(done[-1]))
    lights, height, width, channels = stack.shape
    return FitSummary(
        store=path,
        photographs=lights - len((options or FitOptions()).exclude),
        height=height,
        width=width,
        channels=channels,
        clipped_samples=stack.clipped_samples,
        models=tuple(done),
        notes=notes,
        seconds=time.perf_counter() - started,
    )


def _prepare(
    store: Path, models: list[str], procedure: str | None, options: FitOptions
) -> tuple[stores.Stack, dict[str, Procedure], tuple[str, ...]]:
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
    if procedure is not None and procedure not in PROCEDURES:
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
            make = _usual_procedure if procedure is None else PROCEDURES[procedure]
            procedures[name] = make(stack, spec, options)
        except ImpastoError as error:
            problems += error.problems
    # Lights and options are common to the models: their problems are told once.
    raise_problems(OptionError, dict.fromkeys(problems))
    notes = _notes(stack)
    if procedure is None and not options.refined:
        chosen = [name for name, made in procedures.items() if isinstance(made, Paper)]
        if chosen:
            notes += (
                f"the lights lie in one plane and no procedure was asked for: {' and '.join(chosen)} by the "
                "paper's, refined, because a joint fit cannot identify φn and As there",
            )
    return stack, procedures, notes


def _usual_procedure(stack: stores.Stack, spec: ModelSpec, options: FitOptions) -> Procedure:
    """Return the procedure for when none was asked for: joint where the lights allow it."""
    refined = replace(options, refined=True)
    if options.refined:
        return Paper(stack, spec, refined)
    used = [number for number, name in enumerate(stack.lights.names) if name not in options.exclude]
    joint_only = options.residual or options.calibrates or options.share_reflectance
    if joint_only or not find_arm(stack.lights.direction[used]).planar:
        return Joint(stack, spec, options)
    try:
        return Paper(stack, spec, refined)
    except OptionError:
        return Joint(stack, spec, options)


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
    if stack.shape[3] == 1:
        return ()
    colour = " ".join(f"{value:g}" for value in stack.light_rgb)
    return (
        f"the specular term has the colour of the light, {colour} in the stack ({stack.light_rgb_source})",
    )


class _Job:
    """One model to be fitted.

    Parameters
    ----------
    store : Path
    stack : Stack
    model : str
    procedure : Procedure
    chosen : Findings
        By what the model was chosen.
    """

    def __init__(
        self, store: Path, stack: stores.Stack, model: str, procedure: Procedure, chosen: Findings
    ) -> None:
        self.store = store
        self.stack = stack
        self.model = model
        self.procedure = procedure
        self.chosen = chosen
        self.size = stack.shape[1:3]
        settings = dict(procedure.attributes)
        self.attributes: dict[str, Any] = {
            **stores.provenance(),
            **settings,
            "status_meaning": {str(code): text for code, text in stores.STATUS_MEANING.items()},
            "settings_sha256": stores.digest(settings),
        }
        self.found = stores.read_group(store / stores.fit_group(model))
        self.notes: tuple[str, ...] = ()

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
        # Another version, or machine, may compute other numbers; one fit must not hold both.
        found = self.found
        return found is not None and not self._complete and found.items() >= self.attributes.items()

    def problems(self, overwrite: bool) -> list[Problem]:
        """Return what forbids the fit: one that is complete and is damaged or was made otherwise."""
        if overwrite or not self._complete:
            return []
        if damage := stores.fit_problems(self.store, self.model, self.found or {}):
            return damage
        if self._same_settings:
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

    def prepare(self, overwrite: bool, show_progress: bool | None) -> None:
        """Find out what holds for the whole sample; what is complete needs nothing."""
        if self._complete and not overwrite:
            self.notes = tuple((self.found or {}).get("notes", ()))
        else:
            self._add(self.chosen)
            self._add(self.procedure.prepare(show_progress))

    def _add(self, findings: Findings) -> None:
        self.notes += findings.notes
        self.attributes.update(findings.attributes, notes=list(self.notes))

    def run(self, overwrite: bool, show_progress: bool | None, say: Callable[[str], None]) -> ModelFit:
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

        def write(block: stores.Tile, values: stores.Maps) -> None:
            writer.write(block, values)
            pyramid.add(block, values)

        units = pyramid.in_order(writer.unfinished())
        fitted = sum(unit.pixels for unit in units)
        total = self.size[0] * self.size[1]
        with (
            closing(writer),
            closing(pyramid),
            progress(f"Fitting {self.model}", total, done=total - fitted, show=show_progress) as advance,
        ):
            fit_units(self.stack, self.procedure, units, write, advance)
        title = f"Coarser levels of {self.model}"
        with progress(title, pyramid.missing_pixels(), show=show_progress) as advance:
            pyramid.finish(advance)
        counts = writer.status_counts()
        pixels = {text: int(counts[code]) for code, text in stores.STATUS_MEANING.items() if counts[code]}
        result = {"pixels": pixels, "clipped_samples": self.stack.clipped_samples}
        conclusion = self.procedure.conclude(self._read)
        self._add(conclusion)
        for note in conclusion.notes:
            say(f"{self.model}: {note}")
        writer.finish({**result, **conclusion.attributes, "notes": list(self.notes)})
        return self._summary(result, started, already=False, continued=continued, fitted=fitted)

    def _read(self, *names: str) -> Iterator[stores.Maps]:
        """Yield maps of the fit, unit by unit."""
        fitted = stores.Fit(self.store, stores.fit_group(self.model), {})
        for unit in stores.units(*self.size):
            yield fitted.read(unit.rows, unit.columns, names)

    def _summary(
        self, result: dict[str, Any], started: float, *, already: bool, continued: bool, fitted: int
    ) -> ModelFit:
        seconds = time.perf_counter() - started
        return ModelFit(
            model=self.model,
            procedure=self._procedure,
            pixels=result["pixels"],
            already=already,
            continued=continued,
            seconds=seconds,
            pixels_per_second=fitted / seconds,
            notes=self.notes,
        )

    @property
    def _procedure(self) -> str:
        refined = self.attributes["options"].get("refined", False)
        return f"{self.attributes['procedure']}{', refined' * refined}"
