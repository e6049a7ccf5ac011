"""At the copy stand: plan a capture, drive it, and check each photograph while it can be taken again.

Each step is a function with the name of its subcommand: `impasto capture plan`, `run` and `check`. The folder
that comes out is what `impasto.capture` reads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.stand.check import check
    from impasto.stand.plan import plan
    from impasto.stand.run import run

__all__ = ["check", "plan", "run"]

make_lazy(__name__, {name: name for name in __all__})
