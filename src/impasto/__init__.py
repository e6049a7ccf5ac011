"""Measure how a painted surface reflects light, and show it under any light.

Each stage is a function with the name of its subcommand; each can be used without the others. `open` gives a
store as an xarray DataTree.
"""

from importlib.metadata import version

from impasto import models
from impasto.capture.simulate import simulate
from impasto.demo import demo
from impasto.errors import ImpastoError
from impasto.evaluate import evaluate
from impasto.fit import FitOptions, fit
from impasto.geometry import Camera, Lights
from impasto.maps import maps
from impasto.render import render
from impasto.stack import stack
from impasto.store import open

__version__ = version("impasto")

__all__ = [
    "Camera",
    "FitOptions",
    "ImpastoError",
    "Lights",
    "demo",
    "evaluate",
    "fit",
    "maps",
    "models",
    "open",
    "render",
    "simulate",
    "stack",
]
