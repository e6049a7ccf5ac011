"""Find how few photographs would have served, and which ones."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.angles.curve import draw_curve
from impasto.angles.files import write_lists, write_table
from impasto.angles.groups import choose_test_lights, write_groups
from impasto.angles.highlights import Highlights, describe_highlights
from impasto.angles.image import image_rms
from impasto.angles.photographed import sample_stack
from impasto.angles.placement import arm_angles_deg
from impasto.angles.recommendation import Tolerance, recommend, tolerance
from impasto.angles.refit import Errors, Refit
from impasto.angles.study import STRATEGIES, Point, Random, Study, least_lights, usual_sizes
from impasto.errors import OptionError, Problem, raise_problems
from impasto.evaluate.held_out import listed_lights, named_lights, spread_lights
from impasto.evaluate.regions import WHOLE, read_regions
from impasto.fit import FitOptions
from impasto.models import parse_model
from impasto.output import prepare_folder
from impasto.progress import progress
from impasto.store import Stack, fit_attributes, open_stack

__all__ = ["AnglesSummary", "ModelStudy", "RegionStudy", "angles"]

_DRAWS = 40


@dataclass(frozen=True)
class RegionStudy:
    """How many photographs serve a region, or the whole painting.

    Parameters
    ----------
    name : str
    pixels : int
        How many were fitted again.
    full : Errors
        Of the fit to all photographs.
    recommended : dict of str to Point
        The smallest set that serves, per strategy.
    best : Point
        The smallest of these.
    """

    name: str
    pixels: int
    full: Errors
    recommended: dict[str, Point]
    best: Point


@dataclass(frozen=True)
class ModelStudy:
    """What `angles` found for a model.

    Parameters
    ----------
    model : str
    highlights : Highlights
        What an informed placement goes by.
    discrepancy : float
        Share of the radiance by which the model misses the photographs beyond their noise.
    full_expected : float
        What the criterion expects of the fit to all photographs.
    points : tuple of Point
        One per strategy and size.
    random : tuple of Random
        One per size.
    image_rms : dict of str to float
        RMS over every pixel of the image, per ``<strategy> <size>``; empty unless it was asked for.
    regions : tuple of RegionStudy
        The whole painting first.
    """

    model: str
    highlights: Highlights
    discrepancy: float
    full_expected: float
    points: tuple[Point, ...]
    random: tuple[Random, ...]
    image_rms: dict[str, float]
    regions: tuple[RegionStudy, ...]


@dataclass(frozen=True)
class AnglesSummary:
    """What `angles` found.

    Parameters
    ----------
    store : Path
    candidates : tuple of str
        Photographs that sets were chosen from.
    scored : tuple of str
        Photographs that renderings were compared with.
    held_out : bool
        Whether those are others than the candidates.
    in_plane : bool
        Whether the lights lie in one plane, so that fits and renderings keep to it.
    tolerance : Tolerance
    models : tuple of ModelStudy
    files : tuple of Path
    seconds : float
    """

    store: Path
    candidates: tuple[str, ...]
    scored: tuple[str, ...]
    held_out: bool
    in_plane: bool
    tolerance: Tolerance
    models: tuple[ModelStudy, ...]
    files: tuple[Path, ...]
    seconds: float


def angles(
    store: str | PathLike[str],
    *,
    models: Sequence[str] = ("torrance-sparrow",),
    held_out: int | None = None,
    held_out_lights: str | PathLike[str] | Sequence[str] | None = None,
    measure: str = "rms",
    limit: float | None = None,
    sizes: Sequence[int] = (),
    pixels: int = 20_000,
    draws: int = _DRAWS,
    regions: str | PathLike[str] | None = None,
    image: bool = False,
    groups: str | PathLike[str] | None = None,
    out: str | PathLike[str] | None = None,
    show_progress: bool | None = None,
) -> AnglesSummary:
    """Find which photographs of a capture could have been left out, and what it would have cost.

    Sampled pixels are fitted again from sets of photographs of rising size, by the joint procedure with the
    options of the store's fit, and their renderings compared with photographs: with all of them as the paper
    does [Chen2007]_, Fig. 12, or with those held out. Sets are chosen for the least expected error, evenly,
    by where the highlights fall, and at random.

    Parameters
    ----------
    store : path
        Store with a stack; a fit is not needed.
    models : sequence of str, optional
    held_out : int, optional
        How many photographs to keep from the choice and compare renderings with; by default none, so that
        all photographs judge.
    held_out_lights : path or sequence of str, optional
        Which photographs to keep from it instead: a file that names them, or their names.
    measure : str, optional
        What a recommended set is judged by: ``rms``, ``ciede2000`` or ``psnr``.
    limit : float, optional
        How much worse than all photographs it may be; see `Tolerance`.
    sizes : sequence of int, optional
        Numbers of photographs; about ten by default.
    pixels : int, optional
        How many to sample.
    draws : int, optional
        How many random sets of each size.
    regions : path, optional
        Image of the painting's size with a colour per region.
    image : bool, optional
        Whether to fit every pixel of the image again too.
    groups : path, optional
        File to write: five groups of photographs and seven test lights for a test with observers. Those
        seven are held out, unless others are.
    out : path, optional
        Folder for plots, tables and the names of the recommended photographs.
    show_progress : bool, optional
        Whether to show progress bars; by default, if standard error is a terminal.

    Returns
    -------
    AnglesSummary

    Raises
    ------
    OptionError
        If an option cannot be used, or the photographs are too few.
    StoreError
        If the stack is missing, unfinished or damaged.
    OutputError
        If the files cannot be written.
    """
    started = time.perf_counter()
    path = Path(store)
    specs = {spec.name: spec for spec in map(parse_model, models)}
    allowed = tolerance(measure, limit)
    stack = open_stack(path)
    refits = {name: Refit(spec, _options(path, name)) for name, spec in specs.items()}
    excluded = {name for refit in refits.values() for name in refit.options.exclude}
    held = _held(stack, held_out, held_out_lights, groups is not None)
    names = stack.lights.names
    candidates = [light for light, name in enumerate(names) if light not in held and name not in excluded]
    scored = held or candidates
    raise_problems(
        OptionError,
        [*_too_few(refits, len(candidates)), *_bad_numbers(sizes, pixels, draws, len(candidates))],
    )
    drawn = read_regions(Path(regions), *stack.shape[1:3]) if regions else None
    folder = prepare_folder(out) if out is not None else None
    sampled = sample_stack(stack, pixels, drawn, show=show_progress)
    found = []
    files: list[Path] = []
    for name, refit in refits.items():
        least = least_lights(refit.model)
        examined = sorted({*sizes, len(candidates)}) if sizes else usual_sizes(least, len(candidates))
        examined = [size for size in examined if size >= least]
        study = Study(sampled[0], refit, candidates, scored, displayed=allowed.displayed)
        work = len(examined) * (len(study.strategies) + 1)
        with progress(f"Refitting {name}", work, show=show_progress) as advance:
            points = []
            for size in examined:
                for strategy in study.strategies:
                    points.append(study.point(strategy, size))
                    advance(1)
            random = []
            for size in examined:
                random.append(study.random(size, draws))
                advance(1)
        parts = [_region(WHOLE, study, examined, allowed)]
        if drawn is not None:
            parts += [
                _region(region, study.of(part), examined, allowed)
                for region, part in zip(drawn.names, sampled[1:], strict=True)
                if len(part)
            ]
        chosen = parts[0].best
        in_image = image_rms(study, scored, [*points, chosen], show_progress) if image else {}
        found.append(
            ModelStudy(
                model=name,
                highlights=describe_highlights(study),
                discrepancy=study.expected.discrepancy,
                full_expected=study.expect(tuple(range(len(candidates)))),
                points=tuple(points),
                random=tuple(random),
                image_rms=in_image,
                regions=tuple(parts),
            )
        )
        if folder is not None:
            files += [
                draw_curve(folder, found[-1], stack.lights, candidates, allowed, held_out=bool(held)),
                write_table(folder, found[-1]),
                *write_lists(folder, found[-1], stack.lights),
            ]
        if groups is not None and len(found) == 1:
            files.append(write_groups(Path(groups), study, chosen, [names[light] for light in scored], sizes))
    return AnglesSummary(
        store=path,
        candidates=tuple(names[light] for light in candidates),
        scored=tuple(names[light] for light in scored),
        held_out=bool(held),
        in_plane=arm_angles_deg(stack.lights.direction) is not None,
        tolerance=allowed,
        models=tuple(found),
        files=tuple(files),
        seconds=time.perf_counter() - started,
    )


def _region(name: str, study: Study, sizes: Sequence[int], allowed: Tolerance) -> RegionStudy:
    recommended = {strategy: recommend(study, strategy, sizes, allowed) for strategy in STRATEGIES}
    best = min(recommended.values(), key=lambda point: point.size)
    return RegionStudy(name, len(study.pixels), study.full, recommended, best)


def _options(store: Path, model: str) -> FitOptions:
    """Return the options of the fit in the store, or the default ones."""
    found = fit_attributes(store, model)
    return FitOptions.of(found).settled(found) if found else FitOptions()


def _held(
    stack: Stack, count: int | None, chosen: str | PathLike[str] | Sequence[str] | None, for_groups: bool
) -> list[int]:
    if count is not None and chosen is not None:
        raise OptionError(
            Problem(
                where="--held-out and --held-out-lights",
                what="both choose photographs, and one of them is expected",
                do="Leave one of them out",
            )
        )
    if isinstance(chosen, str | PathLike):
        return named_lights(chosen, stack.lights.names)
    if chosen is not None:
        return listed_lights([(f"held-out photograph {name}", name) for name in chosen], stack.lights.names)
    if count is not None:
        return spread_lights(stack.lights, count)
    return choose_test_lights(stack.lights) if for_groups else []


def _too_few(refits: dict[str, Refit], candidates: int) -> list[Problem]:
    return [
        Problem(
            where=f"--model {name}",
            what=f"needs {least_lights(refit.model)} photographs, and there are {candidates} to choose from; "
            f"expected {least_lights(refit.model) + 1} or more",
            do="Hold out fewer, take more photographs, or study a model of fewer parameters such as lambert",
        )
        for name, refit in refits.items()
        if candidates <= least_lights(refit.model)
    ]


def _bad_numbers(sizes: Sequence[int], pixels: int, draws: int, candidates: int) -> list[Problem]:
    problems = [
        Problem(
            where=f"--sizes {size}",
            what=f"is not from 1 to the {candidates} photographs there are to choose from",
            do="Name numbers of photographs such as 5,7,9,12",
        )
        for size in sizes
        if not 1 <= size <= candidates
    ]
    for option, value, least in (("--pixels", pixels, 100), ("--draws", draws, 1)):
        if value < least:
            problems.append(Problem(option, f"is {value}, expected {least} or more", "Leave it out"))
    return problems
