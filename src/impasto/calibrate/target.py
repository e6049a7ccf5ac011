"""Write the table of a colour target's patches, found in a photograph of it."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.find_target import CLASSIC, FoundTarget, classic_data, find_target
from impasto.calibrate.patches import Patches
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import read_shot
from impasto.calibrate.target_picture import draw_target
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.output import write_text

_NEUTRAL = 6
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
        The target's, as colour-science calls it.
    patches : tuple of str
        Those in the table.
    seen : int
        Patches of all 24 whose outlines were seen; the others follow from the lattice.
    difference : float
        Mean difference in CIELAB of all 24 from the target's data, after the best 3 x 3 matrix.
    """

    file: Path
    picture: Path
    name: str
    patches: tuple[str, ...]
    seen: int
    difference: float


def target(
    photo: str | PathLike[str],
    out: str | PathLike[str],
    *,
    grey: bool = False,
    oecf: str | PathLike[str] | None = None,
) -> Target:
    """Find the classic colour target of 24 patches in a photograph, and write the table of its patches.

    Parameters
    ----------
    photo : path
        Photograph of the target, turned and tilted as it may be.
    out : path
        The CSV file to write, which `colour` takes, or `oecf` if `grey`; a picture with the patches drawn
        into the photograph is written beside it.
    grey : bool
        Write the six neutral patches only, with their reflectance.
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
        If the table's name is that of a picture.
    OutputError
        If a file cannot be written.
    """
    table, picture = Path(out), Path(out).with_suffix(".png")
    if table.suffix.lower() != ".csv":
        what = f"ends in '{table.suffix}', expected .csv"
        raise OptionError(Problem(str(table), what, "Name a table, such as chart.csv"))
    shot = read_shot(Path(photo))
    radiance = shot.linear(response_table(oecf, [shot]))
    found = find_target(radiance, shot.path.name)
    patches = Patches(found.names, found.boxes, {}, {})
    raise_problems(CaptureError, patches.problems(*radiance.shape[:2]))
    draw_target(picture, radiance, found)
    rows = range(len(found.names) - _NEUTRAL, len(found.names)) if grey else range(len(found.names))
    write_text(table, _table(found, rows, grey))
    names = tuple(found.names[row] for row in rows)
    return Target(table, picture, CLASSIC, names, found.seen, float(np.mean(found.difference)))


def _table(found: FoundTarget, rows: range, grey: bool) -> str:
    _, xyz, _ = classic_data()
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["patch", *_EDGES, *(["reflectance"] if grey else ["X_D50", "Y_D50", "Z_D50"])])
    for row in rows:
        known = xyz[row, 1:2] if grey else xyz[row]
        writer.writerow([found.names[row], *found.boxes[row], *(f"{value:.6f}" for value in known)])
    return text.getvalue()
