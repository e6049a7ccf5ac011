"""Which model describes which measured material: the paper's question on materials that nobody here chose.

`python -m benchmarks.measured_materials FOLDER` fits every model to every material of FOLDER's
measured_brdf.npz, by the protocol of its measured_rms.json, and prints tables in Markdown; `--docs DOCS` puts
them, and a plot, into DOCS/measured-materials.md. Light in a plane every 2.5° over ±75°, view 5° out of that
plane, flat sample whose normal is known, unweighted; RMS over mean radiance, in luminance and in RGB.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from impasto.models import ModelSpec

Array = NDArray[np.float64]

# Ours: name in measured_rms.json.
MODELS = {
    "phong": "phong",
    "phong-no-ambient": "phong_noambient",
    "torrance-sparrow-gaussian": "ts_gauss",
    "torrance-sparrow": "ts",
    "torrance-sparrow-ambient": "ts_amb",
    "torrance-sparrow-2": "ts2",
    "torrance-sparrow-2-ambient": None,
    "gtr": "gtr",
    "gtr-ambient": "gtr_amb",
    "ward": None,
    "ward-anisotropic": None,
    "oren-nayar": None,
}
BASE = "torrance-sparrow"
# Pairs with as many parameters: Phong's form against Torrance and Sparrow's.
EQUALS = {"with ambient": ("phong", "torrance-sparrow-ambient"), "without": ("phong-no-ambient", BASE)}
TOLERANCE = 0.01
VIEW_DEG = 5.0
_STEPS = 200
ANGLES_DEG = np.arange(-75.0, 75.1, 2.5)
PEAK_CLASSES = {"below 2": (0, 2), "2 to 20": (2, 20), "above 20": (20, np.inf)}
_MARK = "<!-- python -m benchmarks.measured_materials writes what follows -->"
GLOSS_CLASSES = {"below 10": (0, 10), "10 to 70": (10, 70), "above 70": (70, np.inf)}


@dataclass(frozen=True)
class Study:
    """What was found of each material.

    Parameters
    ----------
    names : list of str
    peak, gloss : ndarray of shape (M,)
        Peak over diffuse radiance, and 60° gloss units.
    rms, rms_rgb : dict of str to ndarray of shape (M,)
        RMS over mean radiance per model, in luminance and in RGB.
    ratio : dict of str to ndarray of shape (M,)
        As over Ad per model, in luminance; the sum of the lobes.
    reference : dict of str to ndarray of shape (M,)
        The least RMS over mean known, where it is.
    """

    names: list[str]
    peak: Array
    gloss: Array
    rms: dict[str, Array]
    rms_rgb: dict[str, Array]
    ratio: dict[str, Array]
    reference: dict[str, Array]

    def classes(self) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield the classes by peak, by gloss, and all materials."""
        for value, classes, title in (
            (self.peak, PEAK_CLASSES, "peak {}"),
            (self.gloss, GLOSS_CLASSES, "{} GU"),
        ):
            for name, (low, high) in classes.items():
                yield title.format(name), (value >= low) & (value < high)
        yield "all", np.ones(len(self.names), bool)


def read_radiance(folder: Path, names: list[str]) -> tuple[Array, Array]:
    """Return radiance (lights, materials, 3) of the protocol, and each material's gloss at 60°."""
    from impasto.capture.simulate.measured import read_measured
    from impasto.evaluate.glossmeter import GLOSSMETERS
    from impasto.geometry import arm_direction
    from impasto.pixels import luminance

    measured = read_measured(folder / "measured_brdf.npz")

    def radiance(name: str, light: Array, view: Array) -> Array:
        normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
        return measured.brdf(name, normal, light, np.broadcast_to(view, light.shape)) * light[:, 2:]

    light = arm_direction(np.radians(ANGLES_DEG))
    seen = np.stack([radiance(name, light, _view()) for name in names], axis=1)
    gloss = [
        GLOSSMETERS[1].measure(
            lambda light, view, name=name: np.pi * luminance(radiance(name, light, view)), log2_rays=13
        )
        for name in names
    ]
    return seen, np.array(gloss)


def fit_flat(model: str, radiance: Array) -> tuple[Array, Array]:
    """Return RMS over mean and As over Ad of a model fitted to flat samples, each of shape (M,)."""
    from impasto.fit.procedure import FitOptions
    from impasto.fit.tile import fit_tile
    from impasto.geometry import Camera, Lights, arm_direction
    from impasto.models import parse_model
    from impasto.pixels import luminance

    channels = radiance.shape[2]
    scaled = (radiance / radiance.max(axis=(0, 2), keepdims=True)).astype(np.float32)
    fitted = fit_tile(
        parse_model(model),
        scaled,
        lights=Lights(tuple(f"{angle:g}" for angle in ANGLES_DEG), arm_direction(np.radians(ANGLES_DEG))),
        camera=Camera(_view()),
        light_rgb=np.ones(channels),
        clip_level=np.full(channels, np.inf),
        noise=(1.0, 0.0, 0.0),
        options=FitOptions(max_steps=_STEPS),
        normal=(0.0, 0.0, 1.0),
    )
    rms = fitted["residual_rms"] / scaled.mean(axis=(0, 2))
    specular = fitted.get("specular", np.zeros(len(rms))).reshape(len(rms), -1).sum(axis=1)
    with np.errstate(divide="ignore"):
        return rms, specular / luminance(fitted["diffuse"])


def _view() -> Array:
    tilt = np.radians(VIEW_DEG)
    return np.array([0.0, np.sin(tilt), np.cos(tilt)])


def study(folder: Path) -> Study:
    """Fit every model to every material."""
    from impasto.pixels import luminance

    known = json.loads((folder / "measured_rms.json").read_text(encoding="utf-8"))["materials"]
    names = list(known)
    radiance, gloss = read_radiance(folder, names)
    grey = {model: fit_flat(model, luminance(radiance)[..., None]) for model in MODELS}
    return Study(
        names=names,
        peak=np.array([known[name]["peak_over_diffuse"] for name in names]),
        gloss=gloss,
        rms={model: rms for model, (rms, _) in grey.items()},
        rms_rgb={model: fit_flat(model, radiance)[0] for model in MODELS},
        ratio={model: ratio for model, (_, ratio) in grey.items()},
        reference={
            model: np.array([known[name]["models"][key]["rms_over_mean"] for name in names])
            for model, key in MODELS.items()
            if key
        },
    )


def geometric_mean(values: Array) -> float:
    """Return the geometric mean."""
    return float(np.exp(np.log(values).mean()))


def tables(found: Study) -> str:
    """Return the tables in Markdown."""
    from impasto.models import parse_model

    classes = list(found.classes())
    parts = []

    def table(title: str, rows: Iterator[tuple[str, list[str]]], columns: list[str]) -> None:
        head = ["", *columns]
        lines = [f"**{title}**", "", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
        parts.append("\n".join([*lines, *("| " + " | ".join([name, *cells]) + " |" for name, cells in rows)]))

    titles = [f"{name} ({inside.sum()})" for name, inside in classes]
    for title, rms in (("Luminance", found.rms), ("RGB", found.rms_rgb)):
        rows = (
            (
                model,
                [
                    str(_unknowns(parse_model(model), 1 if rms is found.rms else 3)),
                    *(f"{geometric_mean((rms[model] / rms[BASE])[inside]):.2f}" for _, inside in classes),
                ],
            )
            for model in MODELS
        )
        table(f"{title}: RMS error as a ratio to {BASE}", rows, ["unknowns", *titles])
    equals = (
        (
            f"{phong} over {other}",
            [f"{geometric_mean((found.rms[phong] / found.rms[other])[inside]):.2f}" for _, inside in classes],
        )
        for phong, other in EQUALS.values()
    )
    table("As many unknowns on both sides, luminance", equals, titles)
    absolute = (
        (model, [f"{100 * np.median(found.rms[model][inside]):.1f} %" for _, inside in classes])
        for model in MODELS
    )
    table("RMS error over mean radiance, luminance, median", absolute, titles)
    ratios = (
        (model, [f"{np.median(found.ratio[model][inside]):.3g}" for _, inside in classes])
        for model in MODELS
        if model.startswith(("phong", "torrance-sparrow")) and parse_model(model).lobes == 1
    )
    table("As/Ad, luminance, median", ratios, titles)
    convergence = []
    for model, reference in found.reference.items():
        excess = found.rms[model] / reference - 1
        worse = [
            f"{found.names[index]} ({excess[index]:+.1%})"
            for index in np.argsort(-excess)
            if excess[index] > TOLERANCE
        ]
        below = int((excess < -TOLERANCE).sum())
        count = f"{len(excess) - len(worse)} of {len(excess)}"
        convergence.append((model, [count, ", ".join(worse) or "none", str(below)]))
    table(
        "Against the least error known",
        iter(convergence),
        ["within 1 % or below", "further off", "below by more than 1 %"],
    )
    return "\n\n".join(parts)


def _unknowns(model: ModelSpec, channels: int) -> int:
    """Return the number of unknowns of a sample whose normal is known."""
    return len(model.shape) + model.lobes + channels * (2 if model.ambient else 1)


def plot(found: Study, path: Path) -> None:
    """Draw each material's error under each model, as a ratio to `BASE`."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    # Okabe and Ito's colours, and shapes that do without them.
    looks = {"below 10": ("#0072b2", "o"), "10 to 70": ("#e69f00", "s"), "above 70": ("#cc79a7", "^")}
    models = [model for model in MODELS if model not in (BASE, "oren-nayar")]
    figure, panels = plt.subplots(1, 2, figsize=(11, 5.2), sharey=True, layout="constrained")
    rng = np.random.default_rng(0)
    jitter = rng.uniform(-0.22, 0.22, len(found.names))
    for axes, (title, rms) in zip(panels, (("luminance", found.rms), ("RGB", found.rms_rgb)), strict=True):
        for row, model in enumerate(models):
            ratio = rms[model] / rms[BASE]
            for name, (low, high) in GLOSS_CLASSES.items():
                inside = (found.gloss >= low) & (found.gloss < high)
                colour, marker = looks[name]
                label = f"60° gloss {name} GU" if row == 0 else None
                axes.plot(
                    ratio[inside],
                    row + jitter[inside],
                    marker,
                    color=colour,
                    markersize=4.5,
                    alpha=0.75,
                    markeredgewidth=0,
                    label=label,
                )
            mean = geometric_mean(ratio)
            axes.plot([mean, mean], [row - 0.36, row + 0.36], color="black", linewidth=2.5)
            axes.text(
                0.985, row, f"{mean:.2f}", transform=axes.get_yaxis_transform(), ha="right", va="center"
            )
        axes.axvline(1, color="#555555", linewidth=1, linestyle=":")
        axes.set_xscale("log")
        axes.text(0.985, -0.62, "mean", transform=axes.get_yaxis_transform(), ha="right", va="center")
        axes.set_xlim(0.08, 10)
        axes.set_xticks([0.1, 0.2, 0.5, 1, 2, 5], ["0.1", "0.2", "0.5", "1", "2", "5"])
        axes.minorticks_off()
        axes.set_xlabel(f"RMS error over that of {BASE}, {title}")
        axes.grid(axis="x", color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    panels[0].set_yticks(range(len(models)), models)
    panels[0].set_ylim(len(models) - 0.4, -0.95)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write_docs(found: Study, docs: Path) -> None:
    """Replace the tables of DOCS/measured-materials.md, below the mark for them, and its plot."""
    page = docs / "measured-materials.md"
    head, _, _ = page.read_text(encoding="utf-8").partition(_MARK)
    page.write_text(f"{head}{_MARK}\n\n{tables(found)}\n", encoding="utf-8")
    plot(found, docs / "images" / "measured-materials.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with measured_brdf.npz and measured_rms.json")
    parser.add_argument("--docs", type=Path, help="documentation to write the tables and the plot into")
    arguments = parser.parse_args()
    found = study(arguments.folder)
    print(tables(found))
    if arguments.docs:
        write_docs(found, arguments.docs)
