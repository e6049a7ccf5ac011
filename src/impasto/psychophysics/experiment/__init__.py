"""The paired-comparison experiment: its stimuli, its server, and the answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.psychophysics.experiment.create import create

__all__ = ["create"]

# Where each name is found when it is asked for: the server is not imported to make an experiment.
_HOME = {"create": "create"}

make_lazy(__name__, _HOME)
