"""Write the table of the patches of a colour target or a grey wedge, found in a photograph of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.find_target import find_target
from impasto.calibrate.find_wedge import LEAST, MOST, find_wedge
from impasto.calibrate.known_targets import KNOWN_TARGETS
from impasto.calibrate.patches import Array, Patches
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import read_shot
from impasto.calibrate.target_picture import draw_target
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.output import write_text

_EDGES = ("column0_px", "row0_px", "column1_px", "row1_px")


@dataclass(frozen=True)
class Target:
    """What `calibrate.target` found.

    Parameters
    ----------
    file : Path
        The table of patches.
    picture : Path
        The photograph with the patches drawn into it.
    name : str
        The target's, as colour-science calls it, or "grey wedge".
    patches : tuple of str
        Those in the table.
    total : int
        Patches that the target has.
    seen : int
        Patches of all whose outlines were seen; the others follow from the lattice.
    difference : float or None
        Mean difference in CIELAB of all from the target's data, after the best 3 x 3 matrix; None for a
        wedge.
    next_step : str or None
        The calibration that takes the table; None for a wedge whose densities are still to be written into
        it.
    """

    file: Path
    picture: Path
    name: str
    patches: tuple[str, ...]
    total: int
    seen: int
    difference: float | None
    next_step: str | None


def target(
    photo: str | PathLike[str],
    out: str | PathLike[str],
    *,
    target: str = "classic",
    grey: bool = False,
    wedge: int | None = None,
    density: Sequence[float] | None = None,
    oecf: str | PathLike[str] | None = None,
) -> Target:
    """Find a colour target or a grey wedge in a photograph, and write the table of its patches.

    Parameters
    ----------
    photo : path
        Photograph of the target, turned and tilted as it may be.
    out : path
        The CSV file to write, which `colour` takes, or `oecf` if `grey` or `wedge`; a picture with the
        patches drawn into the photograph is written beside it.
    target : {'classic', 'sg'}
        The ColorChecker Classic of 24 patches, or the Digital SG of 140.
    grey : bool
        Write the neutral patches only, with their reflectance.
    wedge : int, optional
        Look for a row of so many grey patches instead, numbered from the lightest on.
    density : (float, float), optional
        Density of the wedge's lightest patch, and by how much each further one is denser. Without, the table
        does not say what is known of the patches.
    oecf : path, optional
        The camera's response, if it bends so much that colours are not known by it.

    Returns
    -------
    Target

    Raises
    ------
    CaptureError
        If the photograph cannot be used, the target is not found in it for certain, is mirrored or covered,
        or patches are too small.
    OptionError
        If the table's name is that of a picture, the target is not known, or options do not go together.
    OutputError
        If a file cannot be written.
    """
    table, picture = Path(out), Path(out).with_suffix(".png")
    raise_problems(OptionError, _option_problems(table, target, grey, wedge, density))
    shot = read_shot(Path(photo))
    radiance = shot.linear(response_table(oecf, [shot]))
    where = shot.path.name
    if wedge is None:
        known = KNOWN_TARGETS[target]
        colours = find_target(radiance, where, known)
        names = known.greys if grey else known.names
        rows = [known.names.index(name) for name in names]
        headings = ["reflectance"] if grey else ["X_D50", "Y_D50", "Z_D50"]
        values = known.xyz[rows, 1:2] if grey else known.xyz[rows]
        outlines, boxes = colours.outlines, colours.boxes
        found = Target(
            table, picture, known.data, names, len(known.names), colours.seen,
            float(np.mean(colours.difference)), "oecf" if grey else "colour",
        )  # fmt: skip
    else:
        greys = find_wedge(radiance, wedge, where)
        outlines, boxes, rows = greys.outlines, greys.boxes, list(range(wedge))
        headings = [] if density is None else ["density"]
        values = np.zeros((wedge, 0)) if density is None else _densities(density, wedge)[:, None]
        following = None if density is None else "oecf"
        found = Target(table, picture, "grey wedge", greys.names, wedge, wedge, None, following)
    chosen = Patches(found.patches, tuple(boxes[row] for row in rows), {}, {})
    raise_problems(CaptureError, chosen.problems(*radiance.shape[:2]))
    draw_target(picture, radiance, outlines, boxes)
    write_text(table, _table(chosen, headings, values))
    return found


def _option_problems(
    table: Path, target: str, grey: bool, wedge: int | None, density: Sequence[float] | None
) -> list[Problem]:
    problems = []
    if table.suffix.lower() != ".csv":
        what = f"ends in '{table.suffix}', expected .csv"
        problems.append(Problem(str(table), what, "Name a table, such as chart.csv"))
    if target not in KNOWN_TARGETS:
        do = f"Choose {' or '.join(KNOWN_TARGETS)}, or write the table by hand; see docs/calibration.md"
        problems.append(Problem(f"--target {target}", "is not looked for", do))
    if wedge is not None and not LEAST <= wedge <= MOST:
        what = f"is not from {LEAST} to {MOST}"
        problems.append(Problem(f"--wedge {wedge}", what, "Give the number of its patches"))
    if wedge is not None and (grey or target != "classic"):
        what = "goes with neither --target nor --grey: a wedge is grey patches alone"
        problems.append(Problem("--wedge", what, "Leave them out"))
    if density is not None and wedge is None:
        problems.append(Problem("--density", "is of a wedge", "Give the number of its patches with --wedge"))
    if density is not None and not (density[0] >= 0 and density[1] > 0):
        what = f"is {density[0]:g} and rises by {density[1]:g}, expected from 0 on and rising"
        do = "Give the density of the lightest patch and the step, such as 0.05,0.10"
        problems.append(Problem("--density", what, do))
    return problems


def _densities(density: Sequence[float], count: int) -> Array:
    first, step = density
    return np.asarray(first + step * np.arange(count), np.float64)


def _table(patches: Patches, headings: Sequence[str], values: Array) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["patch", *_EDGES, *headings])
    for name, box, known in zip(patches.names, patches.boxes, values, strict=True):
        writer.writerow([name, *box, *(f"{value:.6f}" for value in known)])
    return text.getvalue()
