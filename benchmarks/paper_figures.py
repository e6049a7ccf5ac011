"""How well the paper's procedure does, literally and refined: the figures of docs/paper-procedure.md.

`python -m benchmarks.paper_figures MEASURED` prints them and, with `--write`, puts them into that page.
MEASURED is a file of measured materials as `impasto simulate --measured` takes it. 37 angles, camera 5° out
of their plane, tilts of 4° standard deviation both ways, noise of 0.5 %; measured materials in luminance,
because the highlight of some is coloured.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tests.arm_scenes import Scene, make_scene, photograph, turned

import impasto
from impasto.capture.simulate.measured import MeasuredSet, read_measured
from impasto.fit import FitOptions
from impasto.geometry import direction_tilts

MODEL = "torrance-sparrow"
MATERIALS = {
    "matte": ("merl/pink-fabric", "rgl/paper_green", "merl/dark-red-paint"),
    "satin": ("rgl/satin_purple", "rgl/satin_blue", "merl/purple-paint"),
    "broad tails": ("merl/gold-metallic-paint", "merl/violet-acrylic", "rgl/satin_white"),
    "car paint": ("rgl/vch_dragon_eye_red", "rgl/vch_ultra_pink"),
    "glossy": ("merl/gray-plastic", "merl/specular-maroon-phenolic", "merl/black-phenolic"),
}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
WIDTHS = (0.03, 0.07, 0.15, 0.3)
PAGE = Path(__file__).parents[1] / "docs" / "paper-procedure.md"


@dataclass(frozen=True)
class Figures:
    """Errors of one fit.

    Parameters
    ----------
    theta_error_deg : tuple of float
        Median and 95th percentile of the error of θn.
    view_tells : float
        Correlation of θv/2 with that error; NaN for a refined fit, which has no θv.
    said_deg : float
        The error that the program itself gives, sd(θv)/2; NaN likewise.
    shape : float
        Median c.
    rms : float
        Median over the pixels of the residual, over the mean radiance.
    """

    theta_error_deg: tuple[float, float]
    view_tells: float
    said_deg: float
    shape: float
    rms: float


def measure(scene: Scene, *, refined: bool, threshold_deg: float | None = 35.0) -> Figures:
    """Fit a scene by the paper's procedure and compare with the truth."""
    options = FitOptions(refined=refined, threshold_deg=threshold_deg)
    impasto.fit(
        scene.store, models=[MODEL], procedure="paper", options=options, overwrite=True, show_progress=False
    )
    height, width = scene.theta.shape
    maps = impasto.store.read_fit(scene.store, MODEL, slice(0, height), slice(0, width))
    attributes = impasto.store.fit_attributes(scene.store, MODEL)
    theta, _ = direction_tilts(turned(maps["normal"], -attributes["sample"]["arm_azimuth_deg"]))
    error = theta - scene.theta
    known = np.isfinite(error)
    tells = said = float("nan")
    if "view_tilt" in maps and (maps["status"] == 0).sum() > 2:
        good = maps["status"] == 0
        tells = float(np.corrcoef(maps["view_tilt"][good] / 2, error[good])[0, 1])
        said = attributes["theta_error_deg"]
    size = np.degrees(np.abs(error[known]))
    return Figures(
        theta_error_deg=(float(np.median(size)), float(np.percentile(size, 95))),
        view_tells=tells,
        said_deg=said,
        shape=float(np.nanmedian(maps["c"])) if np.isfinite(maps["c"]).any() else float("nan"),
        rms=float(np.nanmedian(maps["residual_rms"])) / scene.mean_radiance,
    )


def measured_scene(folder: Path, measured: MeasuredSet, material: str) -> Scene:
    """Photograph a bumpy surface of a measured material."""

    def reflect(normal: np.ndarray, lights: np.ndarray, camera: np.ndarray) -> np.ndarray:
        brdf = [measured.brdf(material, normal, light, camera) @ LUMINANCE for light in lights]
        return np.pi * np.stack(brdf)[..., None] * np.maximum(lights @ normal.T, 0)[..., None]

    return photograph(folder / material.replace("/", "-"), reflect)


def tables(measured: MeasuredSet, folder: Path) -> Iterator[str]:
    """Yield both tables as lines of Markdown."""
    yield (
        "| truth | | θn error, literal | sd(θv)/2 | correlation | θn error, refined "
        "| RMS/mean, literal | refined |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for kind, materials in MATERIALS.items():
        for material in materials:
            scene = measured_scene(folder, measured, material)
            literal, refined = (measure(scene, refined=form) for form in (False, True))
            yield (
                f"| {material} | {kind} | {_pair(literal)} | {literal.said_deg:.2f} "
                f"| {literal.view_tells:.2f} | {_pair(refined)} | {literal.rms:.3f} | {refined.rms:.3f} |"
            )
    yield ""
    yield "| truth | c/true, literal, 35° | literal, auto | refined | θn error, literal | refined |"
    yield "|---|---|---|---|---|---|"
    for c in WIDTHS:
        scene = make_scene(folder / f"c{c}", shape=c, specular=1 / (4 * c * c))
        literal = measure(scene, refined=False)
        auto = measure(scene, refined=False, threshold_deg=None)
        refined = measure(scene, refined=True)
        yield (
            f"| c = {c} | {literal.shape / c:.2f} | {auto.shape / c:.2f} | {refined.shape / c:.2f} | "
            f"{_pair(literal)} | {_pair(refined)} |"
        )


def _pair(figures: Figures) -> str:
    return " / ".join(f"{value:.2f}" for value in figures.theta_error_deg)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper_figures")
    parser.add_argument("measured", type=Path)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/paper-procedure.md")
    arguments = parser.parse_args()
    measured = read_measured(arguments.measured)
    with tempfile.TemporaryDirectory() as folder:
        lines = []
        for line in tables(measured, Path(folder)):
            print(line, flush=True)
            lines.append(line)
    if arguments.write:
        text = PAGE.read_text(encoding="utf-8")
        text = re.sub(
            r"(<!-- figures -->\n).*?(<!-- end of figures -->)",
            lambda found: found[1] + "\n" + "\n".join(lines) + "\n\n" + found[2],
            text,
            flags=re.DOTALL,
        )
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
