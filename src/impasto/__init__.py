"""Measure how a painted surface reflects light, and show it under any light.

Each stage is a function with the name of its subcommand; each can be used without the others. `open` gives a
store as an xarray DataTree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from impasto.lazy import make_lazy

if TYPE_CHECKING:
    from impasto import calibrate, models, stand
    from impasto.angles import angles
    from impasto.capture.simulate import simulate
    from impasto.demo import demo
    from impasto.errors import ImpastoError
    from impasto.evaluate import evaluate
    from impasto.evaluate.compare import compare
    from impasto.evaluate.gloss import gloss
    from impasto.evaluate.gonio import gonio
    from impasto.fit import fit
    from impasto.fit.procedure import FitOptions
    from impasto.geometry import Camera, Lights
    from impasto.maps import maps
    from impasto.maps.height import height
    from impasto.psychophysics import experiment
    from impasto.psychophysics.planning import observers
    from impasto.psychophysics.scaling.scale import scale
    from impasto.publish import publish
    from impasto.render import render
    from impasto.report import report
    from impasto.reproduce import reproduce
    from impasto.stack import stack
    from impasto.store import open
    from impasto.view import view

    __version__: str

__all__ = [
    "Camera",
    "FitOptions",
    "ImpastoError",
    "Lights",
    "angles",
    "calibrate",
    "compare",
    "demo",
    "evaluate",
    "experiment",
    "fit",
    "gloss",
    "gonio",
    "height",
    "maps",
    "models",
    "observers",
    "open",
    "publish",
    "render",
    "report",
    "reproduce",
    "scale",
    "simulate",
    "stack",
    "stand",
    "view",
]

# Where each name is found when it is asked for: a stage does not import what the others need.
_HOME = {
    "Camera": "geometry",
    "FitOptions": "fit.procedure",
    "ImpastoError": "errors",
    "Lights": "geometry",
    "angles": "angles",
    "calibrate": "calibrate",
    "compare": "evaluate.compare",
    "demo": "demo",
    "evaluate": "evaluate",
    "experiment": "psychophysics.experiment",
    "fit": "fit",
    "gloss": "evaluate.gloss",
    "gonio": "evaluate.gonio",
    "height": "maps.height",
    "maps": "maps",
    "models": "models",
    "observers": "psychophysics.planning",
    "open": "store",
    "publish": "publish",
    "render": "render",
    "report": "report",
    "reproduce": "reproduce",
    "scale": "psychophysics.scaling.scale",
    "simulate": "capture.simulate",
    "stack": "stack",
    "stand": "stand",
    "view": "view",
}


make_lazy(__name__, _HOME)
