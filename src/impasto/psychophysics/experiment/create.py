"""Make an experiment: choose the angles, render the candidates, cut the photographs, describe it all."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.errors import OptionError, OutputError, Problem, StoreError, raise_problems
from impasto.output import prepare_folder, remove_partial
from impasto.psychophysics import stimuli
from impasto.psychophysics.experiment.angles import (
    HIGHLIGHT_FROM,
    Angle,
    choose_angles,
    common_angles,
    highlight_shares,
    named_angles,
)
from impasto.psychophysics.experiment.candidates import Candidate, group_candidates, model_candidates
from impasto.psychophysics.experiment.database import ANSWERS
from impasto.psychophysics.experiment.groups import Groups, read_groups
from impasto.psychophysics.experiment.manifest import (
    PHOTOGRAPH,
    STIMULI,
    AngleInfo,
    ConditionInfo,
    Experiment,
    ExperimentError,
    Presentation,
    Texts,
    Viewing,
    default_instructions,
    read_experiment,
    session_trials,
    write_experiment,
)
from impasto.psychophysics.experiment.pictures import Pictures, Sample
from impasto.store import Stack, fitted_models, open_fit, open_stack, provenance

DESIGNS = ("models", "angle-groups")
_ANGLES = 7
_LONGEST_PX = 400
_LONGEST_LIMITS = (32, 4096)


@dataclass(frozen=True)
class CreateSummary:
    """What `create` did.

    Parameters
    ----------
    folder : Path
        The experiment.
    design : str
    samples, angles, conditions : tuple of str
    with_highlight : tuple of str
        Those of the angles at which a highlight is seen.
    pairs : int
        Comparisons that each observer makes, without practice, repeats and catch trials.
    trials : int
        All trials of a session.
    stimuli, rendered : int
        Pictures in all, and those that this run made.
    size_px : (int, int)
        Width and height of the largest picture.
    notes : tuple of str
        What to know before observers are invited.
    seconds : float
    """

    folder: Path
    design: str
    samples: tuple[str, ...]
    angles: tuple[str, ...]
    conditions: tuple[str, ...]
    with_highlight: tuple[str, ...]
    pairs: int
    trials: int
    stimuli: int
    rendered: int
    size_px: tuple[int, int]
    notes: tuple[str, ...]
    seconds: float


def create(
    stores: Sequence[str | PathLike[str]],
    *,
    out: str | PathLike[str],
    design: str = "models",
    models: Sequence[str] = (),
    groups: Sequence[str | PathLike[str]] = (),
    samples: Sequence[str] = (),
    angles: Sequence[str] | int | None = None,
    crop: tuple[int, int, int, int] | None = None,
    longest: int = _LONGEST_PX,
    exposure: float | None = None,
    display: str | PathLike[str] = "srgb",
    white_point: str | tuple[float, float] | None = None,
    adaptation: str = "cat16",
    highlights: str = "clip",
    title: str = "Which reproduction is closer?",
    consent: str | None = None,
    instructions: str | None = None,
    presentation: Presentation | None = None,
    viewing: Viewing | None = None,
    seed: int = 0,
    show_progress: bool | None = None,
) -> CreateSummary:
    """Make a paired-comparison experiment from fitted paintings.

    Both designs follow [Chen2007]_. ``models``: for each sample and angle, renderings of the same photograph
    by every two models. ``angle-groups``: one model fitted to each group of photographs, and the real image
    among the candidates, every two of them. The reference is the photograph. Pictures that an earlier run
    made with the same settings are kept, so that an interrupted run goes on.

    Parameters
    ----------
    stores : sequence of path
        One store per sample.
    out : path
        Folder of the experiment.
    design : {'models', 'angle-groups'}, optional
    models : sequence of str, optional
        Models to compare, by default Torrance-Sparrow and Phong; for angle groups, the one to fit, by default
        Torrance-Sparrow.
    groups : sequence of path, optional
        For angle groups, the file that ``impasto angles --groups`` writes; one for all samples or one each.
    samples : sequence of str, optional
        Names of the samples; by default those of the stores.
    angles : sequence of str or int, optional
        Which angles, by degrees on the arm or by photograph; or how many, chosen so that half of them show a
        highlight. By default 7, or those that the file of groups names.
    crop : (int, int, int, int), optional
        Left, top, width and height to show, in pixels of the photographs; all by default.
    longest : int, optional
        Longer side of the pictures in pixels; larger views are averaged down in linear light.
    exposure : float, optional
        Factor on radiance under a light of intensity 1, for all samples; by default, for each sample such
        that its photographs without a highlight are shown just below the display's white.
    display, white_point, adaptation, highlights
        As for `impasto.render`.
    title, consent, instructions : str, optional
        What observers read.
    presentation : Presentation, optional
        How trials run.
    viewing : Viewing, optional
        The viewing conditions, as far as they are fixed.
    seed : int, optional
        Of the random order.
    show_progress : bool, optional
        Whether to show progress bars; by default, if standard error is a terminal.

    Returns
    -------
    CreateSummary

    Raises
    ------
    OptionError
        If an option does not exist or does not suit the stores.
    StoreError
        Listing every stack or fit that is missing, unfinished or damaged.
    ExperimentError
        If the folder holds answers to another experiment.
    OutputError
        If the folder is not an experiment's, or cannot be written.
    """
    started = time.perf_counter()
    _check_options(design, groups, longest, exposure, angles)
    stacks = _open_stacks([Path(store) for store in stores], samples)
    found_groups = read_groups(groups, stacks) if groups else {}
    candidates: Sequence[Candidate] = (
        model_candidates(stacks, models)
        if design == "models"
        else group_candidates(stacks, found_groups, models, show_progress)
    )
    chain = {
        "display": display,
        "white_point": white_point,
        "adaptation": adaptation,
        "highlights": highlights,
    }
    shown = {
        name: Sample(name, stack, stimuli.choose_view(stack.shape[1:3], crop, longest), chain)
        for name, stack in stacks.items()
    }
    folder = _prepare(Path(out))
    possible = common_angles(stacks)
    shares = {name: _shares(sample, candidates, possible) for name, sample in shown.items()}
    mean = dict(zip((angle.label for angle in possible), np.mean(list(shares.values()), axis=0), strict=True))
    chosen = _chosen(possible, angles, found_groups, stacks, mean)
    matte = [angle for angle in chosen if mean[angle.label] <= HIGHLIGHT_FROM]
    pictures = Pictures(folder, show_progress)
    for sample in shown.values():
        if exposure is None:
            sample.expose(matte or chosen)
        else:
            sample.exposure = exposure
        pictures.make(sample, chosen, candidates)
    conditions = _conditions(candidates, stacks, chosen, with_photograph=design == "angle-groups")
    presentation = presentation or Presentation()
    experiment = Experiment(
        program=" ".join(provenance().values()),
        design=design,
        seed=seed,
        texts=Texts(
            title=title,
            instructions=instructions or default_instructions(presentation.layout),
            **({"consent": consent} if consent else {}),
        ),
        presentation=presentation,
        viewing=viewing or Viewing(),
        display=next(iter(shown.values())).rendition.display.name,
        highlights=highlights,
        samples=[sample.info(str(store)) for sample, store in zip(shown.values(), stores, strict=True)],
        angles=[
            AngleInfo(
                label=angle.label,
                photographs={name: stacks[name].lights.names[light] for name, light in angle.lights.items()},
                highlight_share={name: float(shares[name][possible.index(angle)]) for name in stacks},
                with_highlight=bool(mean[angle.label] > HIGHLIGHT_FROM),
            )
            for angle in chosen
        ],
        conditions=conditions,
        pairs=[
            (sample, angle.label, first.name, second.name)
            for sample in shown
            for angle in chosen
            for first, second in combinations(conditions, 2)
        ],
        stimuli=pictures.stimuli,
    )
    _keep_answers(folder, experiment)
    write_experiment(folder, experiment)
    pictures.sweep()
    return CreateSummary(
        folder=folder,
        design=design,
        samples=tuple(shown),
        angles=tuple(angle.label for angle in chosen),
        conditions=tuple(condition.name for condition in conditions),
        with_highlight=tuple(angle.label for angle in experiment.angles if angle.with_highlight),
        pairs=len(experiment.pairs),
        trials=len(session_trials(experiment, 0)),
        stimuli=len(experiment.stimuli),
        rendered=pictures.rendered,
        size_px=max(sample.size_px for sample in experiment.samples),
        notes=tuple(_notes(experiment)),
        seconds=time.perf_counter() - started,
    )


def _check_options(
    design: str,
    groups: Sequence[str | PathLike[str]],
    longest: int,
    exposure: float | None,
    angles: Sequence[str] | int | None,
) -> None:
    problems = []
    if design not in DESIGNS:
        problems.append(Problem(f"--design {design}", "is not known", f"Choose {' or '.join(DESIGNS)}"))
    elif (design == "angle-groups") != bool(groups):
        what = "needs a file of groups" if not groups else "compares models, and a file of groups is given"
        do = "Give --groups FILE, which impasto angles STORE --groups FILE writes, with --design angle-groups"
        problems.append(Problem(f"--design {design}", what, do))
    low, high = _LONGEST_LIMITS
    if not low <= longest <= high:
        what = f"is {longest} px, expected {low} to {high}"
        problems.append(Problem("--longest", what, "Three pictures of 400 px fit a display of 1280 px"))
    if exposure is not None and not 0 < exposure < np.inf:
        problems.append(Problem("--exposure", f"is {exposure:g}, expected above 0", "Try 2 or 0.5"))
    if isinstance(angles, int) and angles < 1:
        problems.append(Problem("--angles", f"is {angles}, expected 1 or more", "The paper has 7"))
    raise_problems(OptionError, problems)


def _open_stacks(stores: Sequence[Path], names: Sequence[str]) -> dict[str, Stack]:
    """Return the stack of each store by the sample's name; every problem with either is told."""
    problems: list[Problem] = []
    if not stores:
        problems.append(Problem("impasto experiment create", "no store is given", "Name one per sample"))
    if names and len(names) != len(stores):
        what = f"{len(names)} names are given for {len(stores)} stores"
        problems.append(Problem("--sample", what, "Give one for each store, in their order"))
    names = list(names) if len(names) == len(stores) else [store.resolve().stem for store in stores]
    problems += [
        Problem(f"--sample {name}", "is the name of several stores", "Name each store with --sample NAME")
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]
    stacks = {}
    for store, name in zip(stores, names, strict=True):
        try:
            stacks[name] = open_stack(store)
        except StoreError as error:
            problems += error.problems
    raise_problems(StoreError if len(stacks) < len(set(names)) else OptionError, problems)
    return stacks


def _prepare(out: Path) -> Path:
    folder = prepare_folder(out)
    if any(folder.iterdir()) and not (folder / STIMULI).is_dir():
        what = "is not empty and was not made by impasto experiment create"
        raise OutputError(Problem(str(folder), what, "Give the name of a new folder"))
    prepare_folder(folder / STIMULI)
    remove_partial(folder / STIMULI)
    return folder


def _shares(sample: Sample, candidates: Sequence[Candidate], angles: Sequence[Angle]) -> NDArray[np.float64]:
    """Return the highlight's share at each angle, by a fit that is in the store."""
    stack, lights = sample.stack, [angle.lights[sample.name] for angle in angles]
    fitted = fitted_models(stack.store)
    model = next((candidate.model for candidate in candidates if candidate.model in fitted), None)
    if model is None:
        what = f"has no fit of {candidates[0].model}, which tells where highlights are"
        do = f"Make it with: impasto fit {stack.store} --model {candidates[0].model}"
        raise StoreError(Problem(str(stack.store), what, do))
    crop = sample.view.rows, sample.view.columns
    return highlight_shares(open_fit(stack.store, model), stack, crop, lights)


def _chosen(
    possible: Sequence[Angle],
    wanted: Sequence[str] | int | None,
    groups: Mapping[str, Groups],
    stacks: Mapping[str, Stack],
    shares: Mapping[str, float],
) -> list[Angle]:
    test_lights = next((entry.test_lights for entry in groups.values()), [])
    if wanted is None and test_lights:
        wanted = test_lights
    if wanted is None or isinstance(wanted, int):
        return choose_angles(possible, [shares[angle.label] for angle in possible], wanted or _ANGLES)
    return named_angles(possible, wanted, stacks)


def _conditions(
    candidates: Sequence[Candidate],
    stacks: Mapping[str, Stack],
    angles: Sequence[Angle],
    with_photograph: bool,
) -> list[ConditionInfo]:
    references = {
        name: {stack.lights.names[angle.lights[name]] for angle in angles} for name, stack in stacks.items()
    }
    conditions = []
    for candidate in candidates:
        used = {name: candidate.used(name) for name in stacks}
        seen = any(references[name] & set(photographs) for name, photographs in used.items())
        conditions.append(
            ConditionInfo(
                name=candidate.name,
                model=candidate.model,
                photographs=used,
                reference_in_fit=seen,
                recommended=candidate.recommended,
            )
        )
    if with_photograph:
        conditions.append(ConditionInfo(name=PHOTOGRAPH, model=None))
    return conditions


def _keep_answers(folder: Path, experiment: Experiment) -> None:
    """Refuse to change what answers refer to."""
    if not (folder / ANSWERS).exists():
        return
    before = read_experiment(folder, check_stimuli=False)
    if before.design_sha256 != experiment.design_sha256:
        what = "holds answers to other pictures or comparisons than those asked for now"
        do = f"Choose another folder; or, if the answers are of no use, remove {folder / ANSWERS}"
        raise ExperimentError(Problem(str(folder), what, do))


def _notes(experiment: Experiment) -> Iterator[str]:
    """Yield what to know before observers are invited."""
    seen = [condition.name for condition in experiment.conditions if condition.reference_in_fit]
    if seen:
        yield (
            f"the fits of {', '.join(seen)} used photographs that are references here; to judge by unseen "
            "ones, fit with --exclude"
        )
    if all(angle.with_highlight for angle in experiment.angles):
        yield "every angle shows a highlight"
    if not any(angle.with_highlight for angle in experiment.angles):
        yield "no angle shows a highlight"
    pictures = experiment.pictures()
    alike = sum(
        pictures[sample, angle, first] == pictures[sample, angle, second]
        for sample, angle, first, second in experiment.pairs
    )
    if alike:
        yield f"in {alike} of {len(experiment.pairs)} comparisons both pictures are the same, code by code"
