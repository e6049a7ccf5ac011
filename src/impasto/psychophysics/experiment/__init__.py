"""The paired-comparison experiment: its stimuli, its server, and the answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.psychophysics.experiment.administer import export, forget, invite
    from impasto.psychophysics.experiment.create import create
    from impasto.psychophysics.experiment.manifest import Presentation, Viewing
    from impasto.psychophysics.experiment.serve import serve
    from impasto.psychophysics.experiment.simulate import simulate

__all__ = ["Presentation", "Viewing", "create", "export", "forget", "invite", "serve", "simulate"]

# Where each name is found when it is asked for: the server is not imported to make an experiment.
_HOME = {
    "Presentation": "manifest",
    "Viewing": "manifest",
    "create": "create",
    "export": "administer",
    "forget": "administer",
    "invite": "administer",
    "serve": "serve",
    "simulate": "simulate",
}

make_lazy(__name__, _HOME)
