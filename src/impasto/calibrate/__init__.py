"""Calibrate a camera, its lights and a display from photographs of what is known.

Each step is a function with the name of its subcommand, and can be left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto.calibrate.lights import lights
    from impasto.calibrate.oecf import oecf

__all__ = ["lights", "oecf"]

make_lazy(__name__, {"lights": "lights", "oecf": "oecf"})
