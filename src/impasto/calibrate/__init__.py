"""Calibrate a camera, its lights and a display from photographs of what is known.

Each step is a function with the name of its subcommand, and can be left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.calibrate.colour import colour
    from impasto.calibrate.dark import dark
    from impasto.calibrate.display import display
    from impasto.calibrate.flat import flat
    from impasto.calibrate.glare import glare
    from impasto.calibrate.lights import lights
    from impasto.calibrate.oecf import oecf
    from impasto.calibrate.steadiness import steadiness
    from impasto.calibrate.target import target
    from impasto.calibrate.white import white

__all__ = ["colour", "dark", "display", "flat", "glare", "lights", "oecf", "steadiness", "target", "white"]

make_lazy(__name__, {name: name for name in __all__})
