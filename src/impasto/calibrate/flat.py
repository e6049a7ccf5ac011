"""Measure how uneven light and lens are, from photographs of an even card."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.dark import dark_grid
from impasto.calibrate.files import subject_of, write_calibration
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import Shot, one_by_one, photographs_in
from impasto.calibrate.surface import Array, nodes, smooth_surface
from impasto.capture.light_files import read_light_file
from impasto.capture.lights import LightFile
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.geometry import position_mm

# Share of the card's samples that may be clipped.
_CLIPPED = 1e-3
# Brighter than this share of full scale, a card is well above the noise.
_DIM = 0.02
# What a smooth surface may leave of an even card.
_ROUGH = 0.05


@dataclass(frozen=True)
class Flat:
    """What `calibrate.flat` found.

    Parameters
    ----------
    file : Path
    names : tuple of str
        Lights with a card of their own; empty where one card stands for all.
    before, after : float
        Largest departure from the level in the frame's middle, as a share of it, before and after correction,
        on a grid of cells and over all cards.
    fall_off : bool
        Whether the fall-off of lights at known positions was taken out, so that the lens and the lamps' beams
        are left.
    notes : tuple of str
    """

    file: Path
    names: tuple[str, ...]
    before: float
    after: float
    fall_off: bool
    notes: tuple[str, ...]


def flat(
    photos: str | PathLike[str],
    out: str | PathLike[str],
    *,
    lights: str | PathLike[str] | None = None,
    dark: str | PathLike[str] | None = None,
    oecf: str | PathLike[str] | None = None,
) -> Flat:
    """Measure how uneven the light and the lens are.

    Parameters
    ----------
    photos : path
        A photograph of an even card that fills the frame, which then stands for all lights; or a folder of
        them, one per light, with the names of the painting's photographs.
    out : path
        The calibration file to write, such as ``flat.json``.
    lights : path, optional
        Light file with the lights' positions. The fall-off that follows from them is taken out, because a fit
        accounts for it: what is left is the lens and the lamps' beams. Without, all unevenness is corrected.
    dark : path, optional
        Photograph with the cap on, or the calibration file made from it.
    oecf : path, optional
        Calibration file of the camera's response.

    Returns
    -------
    Flat

    Raises
    ------
    CaptureError
        If photographs cannot be used, a card is clipped or dark, or the light file lacks a light.
    OutputError
        If the file cannot be written.
    """
    paths = photographs_in(Path(photos))
    file = None if lights is None else read_light_file(Path(lights))
    problems = [] if file is None else list(file.problems)
    if file is not None and not problems:
        problems += _light_problems(paths, file)
    raise_problems(CaptureError, problems)
    one = len(paths) == 1
    grids, notes = {}, []
    seen: list[Shot] = []
    before = after = 0.0
    for shot in one_by_one(paths):
        if not seen:
            table = response_table(oecf, [shot])
            black = dark_grid(dark, shot, table)
        seen.append(shot.without_pixels)
        surface, residual = smooth_surface(shot.linear(table))
        surface = surface - black
        problems += _card_problems(shot, surface, float(residual.max()))
        if file is not None:
            surface = surface / _fall_off(shot, file, one)[..., None]
        middle = surface[surface.shape[0] // 2, surface.shape[1] // 2]
        grids[shot.name] = surface / middle
        before = max(before, float(np.abs(surface / middle - 1).max()))
        after = max(after, float(residual.max()))
    raise_problems(CaptureError, problems)
    if min(float(grid.min()) for grid in grids.values()) <= 0.05:
        notes.append("the card is nearly dark at its edges: it must fill the frame")
    content = {
        "fall_off_taken_out": file is not None,
        "grids": {"*" if one else name: np.round(grid, 6).tolist() for name, grid in grids.items()},
        "before": before,
        "after": after,
    }
    write_calibration(
        Path(out),
        "flat",
        content,
        subject=subject_of(seen, f_number=True, size=True),
        made_from=[shot.provenance for shot in seen],
    )
    return Flat(Path(out), () if one else tuple(grids), before, after, file is not None, tuple(notes))


def _card_problems(shot: Shot, surface: Array, residual: float) -> list[Problem]:
    level = float(surface.mean())
    clipped = float(shot.clipped.mean())
    if clipped > _CLIPPED:
        what = f"is clipped in {clipped:.1%} of its samples"
        return [Problem(shot.path.name, what, "Expose the card for less time")]
    if level < _DIM:
        what = f"reads {level:.2%} of full scale"
        return [
            Problem(shot.path.name, what, "Expose the card for longer, so that it reads half of full scale")
        ]
    if residual > _ROUGH or surface.min() <= 0:
        what = f"is no even card: a smooth surface is off by {residual:.1%}, expected less than {_ROUGH:.0%}"
        return [Problem(shot.path.name, what, "Fill the frame with an even, matte card, and give its folder")]
    return []


def _light_problems(paths: list[Path], file: LightFile) -> list[Problem]:
    if file.camera.mm_per_px is None:
        do = "Add mm_per_px under [camera]"
        return [Problem(file.path.name, "gives no size of a pixel, which fall-off needs", do)]
    if len(paths) == 1 and len(file.rows) == 1:
        return []
    known = {Path(row.file or "").stem for row in file.rows}
    return [
        Problem(file.path.name, f"has no light {path.stem}", "Name the cards like the painting's photographs")
        for path in paths
        if path.stem not in known
    ]


def _fall_off(shot: Shot, file: LightFile, single: bool) -> Array:
    """Return the irradiance of the painting's plane on the grid's nodes, 1 in the middle."""
    rows = [row for row in file.rows if Path(row.file or "").stem == shot.name] or file.rows[: int(single)]
    height, width, _ = shot.codes.shape
    node_rows, node_columns = nodes(height, width)
    if rows[0].position_mm is None:
        return np.ones((len(node_rows), len(node_columns)))
    grid = np.meshgrid(node_rows, node_columns, indexing="ij")
    assert file.camera.mm_per_px is not None
    place = position_mm(grid[0], grid[1], height, width, file.camera.mm_per_px).astype(np.float64)
    towards = np.array(rows[0].position_mm) - np.concatenate(
        [place, np.zeros((*place.shape[:2], 1))], axis=-1
    )
    irradiance = towards[..., 2] / np.linalg.norm(towards, axis=-1) ** 3
    centre = np.array(rows[0].position_mm)
    return np.asarray(irradiance * np.linalg.norm(centre) ** 3 / centre[2])
