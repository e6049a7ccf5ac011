"""Do observers agree? The experiment with paired comparisons, and what follows from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.psychophysics.differences import image_difference, measure_differences
    from impasto.psychophysics.planning import next_pairs, observers_needed, stopping_rule
    from impasto.psychophysics.scaling.closed_form import fit_closed_form
    from impasto.psychophysics.scaling.comparisons import Comparisons, count_choices
    from impasto.psychophysics.scaling.consistency import agreement, circular_triads, repeats
    from impasto.psychophysics.scaling.distance_prior import fit_distance_prior
    from impasto.psychophysics.scaling.groups import ScaleOptions
    from impasto.psychophysics.scaling.likelihood import fit_likelihood
    from impasto.psychophysics.scaling.limits import limits
    from impasto.psychophysics.scaling.posterior import posterior
    from impasto.psychophysics.scaling.scale import scale
    from impasto.psychophysics.scaling.screening import screen
    from impasto.psychophysics.scaling.ties import fit_ties
    from impasto.psychophysics.scaling.trials import read_trials, write_trials
    from impasto.psychophysics.simulated_observers import ObserverModel, simulate_observers

__all__ = [
    "Comparisons",
    "ObserverModel",
    "ScaleOptions",
    "agreement",
    "circular_triads",
    "count_choices",
    "fit_closed_form",
    "fit_distance_prior",
    "fit_likelihood",
    "fit_ties",
    "image_difference",
    "limits",
    "measure_differences",
    "next_pairs",
    "observers_needed",
    "posterior",
    "read_trials",
    "repeats",
    "scale",
    "screen",
    "simulate_observers",
    "stopping_rule",
    "write_trials",
]

# Where each name is found when it is asked for.
_HOME = {
    "Comparisons": "scaling.comparisons",
    "ObserverModel": "simulated_observers",
    "ScaleOptions": "scaling.groups",
    "agreement": "scaling.consistency",
    "circular_triads": "scaling.consistency",
    "count_choices": "scaling.comparisons",
    "fit_closed_form": "scaling.closed_form",
    "fit_distance_prior": "scaling.distance_prior",
    "fit_likelihood": "scaling.likelihood",
    "fit_ties": "scaling.ties",
    "image_difference": "differences",
    "limits": "scaling.limits",
    "measure_differences": "differences",
    "next_pairs": "planning",
    "observers_needed": "planning",
    "posterior": "scaling.posterior",
    "read_trials": "scaling.trials",
    "repeats": "scaling.consistency",
    "scale": "scaling.scale",
    "screen": "scaling.screening",
    "simulate_observers": "simulated_observers",
    "stopping_rule": "planning",
    "write_trials": "scaling.trials",
}

make_lazy(__name__, _HOME)
