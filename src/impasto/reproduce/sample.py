"""One sample, photographed under the arm and fitted by every procedure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impasto.capture.simulate import simulate
from impasto.capture.simulate.materials import specular_term
from impasto.capture.simulate.measured import MeasuredSet
from impasto.capture.simulate.presets import SAMPLES
from impasto.errors import OptionError
from impasto.evaluate.compare import compare
from impasto.evaluate.curves import Curve
from impasto.evaluate.gloss import gloss
from impasto.evaluate.glossmeter import GLOSSMETERS, Radiance
from impasto.evaluate.gonio import gonio
from impasto.evaluate.tally import ModelComparison
from impasto.fit import FitOptions, fit
from impasto.geometry import Array
from impasto.pixels import luminance
from impasto.reproduce.camera import RESPONSE, SHORTER_EXPOSURES, CalibratedCamera
from impasto.stack import stack
from impasto.store import open_fit

MODELS = ("torrance-sparrow", "phong")
# Lamps have a size. Without one, some networks' spikes at the mirror direction, narrower than a degree and
# between the arm's steps, would stand for the sample's highlight.
LAMP_DEG = 2.0
PROCEDURES: Mapping[str, tuple[str, FitOptions]] = {
    "paper": ("paper", FitOptions()),
    "refined": ("paper", FitOptions(refined=True)),
    "joint": ("joint", FitOptions()),
}


@dataclass(frozen=True)
class FittedSample:
    """A sample by one procedure.

    Parameters
    ----------
    procedure : str
        ``paper``, ``refined`` or ``joint``.
    models : dict of str to ModelComparison
        Empty, like `gloss`, where the highlights are not identified.
    gloss : dict of float to float
        What Torrance-Sparrow says that a glossmeter reads, its pixels laid flat: their median by angle, gloss
        units.
    curve : Curve or None
        At the pixel that the paper's procedure takes As from: that of the brightest radiance.
    plot : Path or None
    notes : tuple of str
    """

    procedure: str
    models: dict[str, ModelComparison]
    gloss: dict[float, float]
    curve: Curve | None
    plot: Path | None
    notes: tuple[str, ...]


@dataclass(frozen=True)
class VirtualSample:
    """One of the paper's samples, as it is re-enacted.

    Parameters
    ----------
    name : str
        ``a`` to ``h``.
    material : str
        The measured material, with the interface over it where there is one.
    support : str
    gloss : dict of float to float
        What a glossmeter reads on the true material, flat; by angle, gloss units.
    fitted : dict of str to FittedSample
        By procedure.
    """

    name: str
    material: str
    support: str
    gloss: dict[float, float]
    fitted: dict[str, FittedSample]


def enact(
    folder: Path,
    name: str,
    measured: MeasuredSet,
    camera: CalibratedCamera,
    *,
    size: tuple[int, int],
    seed: int,
    show_progress: bool | None,
) -> VirtualSample:
    """Photograph a sample, and fit both models by every procedure.

    Parameters
    ----------
    folder : Path
        Where the photographs, the stores and the plots go.
    name : str
    measured : MeasuredSet
    camera : CalibratedCamera
    size : tuple of int
        Width and height, pixels.
    seed : int
    show_progress : bool or None
    """
    simulate(
        folder / "photos",
        sample=name,
        arm=True,
        size=size,
        seed=seed,
        measured=measured.path,
        angular_size_deg=LAMP_DEG,
        response=RESPONSE,
        brackets=SHORTER_EXPOSURES,
        calibration=False,
        show_progress=show_progress,
    )
    fitted: dict[str, FittedSample] = {}
    peak = (0, 0)
    for procedure, (how, options) in PROCEDURES.items():
        store = folder / f"{procedure}.zarr"
        stack(
            folder / "photos",
            store,
            brackets=sorted((folder / "photos" / "brackets").iterdir()),
            oecf=camera.response.file,
            white=camera.white,
            show_progress=show_progress,
        )
        said: list[str] = []
        fit(
            store,
            models=MODELS,
            procedure=how,
            options=options,
            say=said.append,
            show_progress=show_progress,
        )
        if procedure == "paper":
            sample = open_fit(store, MODELS[0]).attributes["sample"]
            peak = (int(sample["column"]), int(sample["row"]))
        fitted[procedure] = _judge(
            store, folder / f"curves-{procedure}", procedure, peak, tuple(said), show_progress
        )
    chosen = SAMPLES[name]
    interface = f" under an interface of alpha {chosen.alpha}" if chosen.interface else ""
    return VirtualSample(
        name=name,
        material=chosen.measured + interface,
        support=chosen.support,
        gloss={meter.angle_deg: meter.measure(true_radiance(name, measured)) for meter in GLOSSMETERS},
        fitted=fitted,
    )


def _judge(
    store: Path,
    curves: Path,
    procedure: str,
    peak: tuple[int, int],
    notes: tuple[str, ...],
    show_progress: bool | None,
) -> FittedSample:
    try:
        whole = compare(store, models=MODELS, show_progress=show_progress).regions[0]
    except OptionError:  # no pixel's highlight is identified, as the notes say
        return FittedSample(procedure, {}, {}, None, None, notes)
    readings = gloss(store, model=MODELS[0], show_progress=show_progress).regions[0].readings
    shown = gonio(store, out=curves, models=MODELS, pixels=[peak], show_progress=show_progress)
    return FittedSample(
        procedure=procedure,
        models={model.model: model for model in whole.models},
        gloss={reading.angle_deg: reading.median for reading in readings},
        curve=shown.curves[0],
        plot=shown.files[0],
        notes=notes,
    )


def true_radiance(name: str, measured: MeasuredSet) -> Radiance:
    """Return the true relative radiance of a flat sample in luminance, as a function of light and view.

    Parameters
    ----------
    name : str
    measured : MeasuredSet

    Raises
    ------
    OptionError
        If the file has no such material.
    """
    sample = SAMPLES[name]
    index = 1.5

    def radiance(light: Array, view: Array) -> Array:
        normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
        base = math.pi * luminance(measured.brdf(sample.measured, normal, light, view)) * light[:, 2]
        if not sample.interface:
            return np.asarray(base)
        shape = np.full(len(light), sample.alpha)
        lobe = specular_term("torrance-sparrow-smith", normal, light, view, shape, index)
        return np.asarray(base + lobe / (4 * sample.alpha**2))

    return radiance
