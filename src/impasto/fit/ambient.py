"""Whether a model is fitted with its ambient term: as lights left out bear out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from impasto import store as stores
from impasto.errors import ImpastoError, OptionError, Problem
from impasto.fit.choice import choose
from impasto.fit.joint import Joint
from impasto.fit.procedure import Findings, FitOptions, Procedure
from impasto.fit.remainder import decibels, usual_toe
from impasto.fit.sample import Sample, deal_lights, sample_pixels
from impasto.models import ModelSpec, with_ambient

_FOLDS = 5
_PIXELS = 2000


def choose_ambient(
    stack: stores.Stack,
    procedures: Mapping[str, Procedure],
    options: FitOptions,
    show_progress: bool | None,
) -> dict[str, tuple[Procedure, Findings]]:
    """Return for each model the fit with or without its ambient term that meets lights left out closer.

    Parameters
    ----------
    stack : Stack
    procedures : mapping of str to Procedure
        By the models' names.
    options : FitOptions
    show_progress : bool or None
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    dict of str to (Procedure, Findings)
        By the name of the model that is to be fitted.

    Raises
    ------
    OptionError
        If a model is not to be fitted by the joint procedure.
    StoreError
        If the stack is damaged.

    Notes
    -----
    The pixels of a sample are fitted without each fifth of the lights in turn, as they are stated. What a
    model leaves over of these lights is taken on the square-root scale of the residual term, as the mean over
    the lights of its mean square in decibels; `choose` decides. A term that nothing asks for changes it by
    less than `choice.WORTH_DB`.
    """
    joint = {name: made for name, made in procedures.items() if isinstance(made, Joint)}
    if len(joint) < len(procedures):
        raise OptionError(
            Problem(
                where="--choose-ambient",
                what="is no option of the paper procedure, but of the joint one",
                do="Leave it out, or choose --procedure joint",
            )
        )
    lights = next(iter(joint.values())).lights
    sample = sample_pixels(stack, lights, show_progress).thinned(_PIXELS)
    chosen: dict[str, tuple[Procedure, Findings]] = {}
    for made in joint.values():
        procedure, findings = _choose(lambda spec: Joint(stack, spec, options), made.model, sample)
        chosen[procedure.model.name] = procedure, findings
    return chosen


def _choose(make: Callable[[ModelSpec], Joint], model: ModelSpec, sample: Sample) -> tuple[Joint, Findings]:
    without = make(with_ambient(model, False))
    try:
        ambient = make(with_ambient(model, True))
    except ImpastoError:  # too few lights for one more unknown
        return without, Findings()
    ways = {"without": without, "with": ambient}
    choice = choose(list(ways), lambda way: model_left_out_db(ways[way], sample))
    found, used = choice.left_out_db, choice.used == "with"
    note = (
        f"ambient term: lights left out are met to {found['with']:.2f} dB with it, to "
        f"{found['without']:.2f} dB without: {'it is fitted' if used else 'it is left away'}"
    )
    return ways[choice.used], Findings({"ambient_left_out_db": found}, (note,))


def model_left_out_db(procedure: Joint, sample: Sample) -> float:
    """Return how close a model meets lights that it was not fitted to, in decibels.

    Parameters
    ----------
    procedure : Joint
    sample : Sample
        Pixels under its lights.
    """
    values, lights = sample.values, procedure.stated_lights
    toe = usual_toe(procedure.measured(values))
    errors = np.zeros(len(lights))
    for held in deal_lights(lights, min(_FOLDS, len(lights))):
        seen = np.setdiff1d(np.arange(len(lights)), held)
        part = np.ascontiguousarray(values[seen])
        maps = procedure.fit_pixels(part, sample.row, sample.column, lights.select(seen))
        pixels = procedure.pixels(maps, sample.row, sample.column)
        rest = procedure.left_over(values[held], pixels, lights.select(held), toe)
        errors[held] = np.square(rest, dtype=np.float64).mean(axis=(0, 2))
    return decibels(errors)
