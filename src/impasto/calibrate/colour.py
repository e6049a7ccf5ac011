"""Find what a camera's colours are in XYZ, from a photograph of a colour target."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.calibrate.colour_fit import METHODS, ColourFit, fit_colour
from impasto.calibrate.dark import dark_image
from impasto.calibrate.files import subject_of, write_calibration
from impasto.calibrate.patches import Array, read_patches
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import Shot, read_shot
from impasto.calibrate.targets import known_xyz
from impasto.errors import CaptureError, OptionError, Problem, raise_problems

_CLIPPED = 1e-3
_LEAST_PATCHES = 12
# Mean CIEDE2000 of a fit that is worse than any camera's: the patches are not those of the table.
_NO_CAMERA = 10.0
# By what factor a white card's patches may differ, and what share of full scale they read at least.
_UNEVEN, _DIM = 2.5, 0.02


@dataclass(frozen=True)
class Colour:
    """What `calibrate.colour` found.

    Parameters
    ----------
    file : Path
    fits : dict of str to ColourFit
        By method: ``matrix`` (3 x 3) and ``root-polynomial`` (3 x 6).
    chosen : str
        The method with the smaller error on patches left out, which `stack` takes.
    white_xyz : ndarray of shape (3,)
        Of a perfect white diffuser under the illuminant of the target's data, Y = 1.
    names : tuple of str
        The patches.
    """

    file: Path
    fits: dict[str, ColourFit]
    chosen: str
    white_xyz: Array
    names: tuple[str, ...]


def colour(
    photo: str | PathLike[str],
    patches: str | PathLike[str],
    out: str | PathLike[str],
    *,
    target: str | None = None,
    card: str | PathLike[str] | None = None,
    white: str | None = None,
    dark: str | PathLike[str] | None = None,
    oecf: str | PathLike[str] | None = None,
    method: str | None = None,
    without: Iterable[str] = (),
) -> Colour:
    """Find the transform from a camera's radiance to XYZ, from a photograph of a colour target.

    Parameters
    ----------
    photo : path
        Photograph of the target.
    patches : path
        CSV with a row per patch: ``patch``, its box ``column0_px``, ``row0_px``, ``column1_px``, ``row1_px``,
        and, without `target`, what is known: ``X_D50``, ``Y_D50``, ``Z_D50`` (or another illuminant; Y = 1
        for a perfect white), ``L``, ``a``, ``b`` (D50), or reflectances ``R400``, ``R410``, ….
    out : path
        The calibration file to write, such as ``colour.json``.
    target : str, optional
        A target whose data are known by name, such as ``ColorChecker24 - After November 2014``; patches then
        have its names.
    card : path, optional
        Photograph of a white card in the target's place, of known reflectance 0.98 or more: tells how even
        the light is, and what white is.
    white : str, optional
        The patch that is white, if there is no card: its known Y tells what a perfect white would read.
    dark, oecf : path, optional
        As for `flat`.
    method : {'matrix', 'root-polynomial'}, optional
        Which one `stack` is to take; by default the one with the smaller error on patches left out.
    without : iterable of str, optional
        Patches to leave out.

    Returns
    -------
    Colour

    Raises
    ------
    CaptureError
        If photograph or table cannot be used, or patches are clipped.
    OptionError
        If an option cannot be used.
    OutputError
        If the file cannot be written.

    Notes
    -----
    Radiance counts relative to a perfect white diffuser, whose mean over the channels is 1. The light's
    colour stays in it: no white balance is applied.

    References
    ----------
    [Finlayson2015]_, [Sharma2005]_
    """
    table = read_patches(Path(patches)).without(list(without))
    xyz, white_xyz = known_xyz(table, target)
    shot = read_shot(Path(photo))
    even = None if card is None else read_shot(Path(card))
    problems = table.problems(*shot.codes.shape[:2]) + _shot_problems(shot, even)
    options = []
    if method is not None and method not in METHODS:
        options.append(Problem(f"--method {method}", "is not known", f"Choose {' or '.join(METHODS)}"))
    if card is None and white is None:
        do = "Give --card PHOTO, or the name of the white patch with --white"
        options.append(Problem("--card", "and --white are both missing: nothing says what white is", do))
    if white is not None and white not in table.names:
        options.append(Problem(f"--white {white}", "is no patch of the table", "Correct the name"))
    raise_problems(OptionError, options)
    if len(table.names) < _LEAST_PATCHES:
        what = f"holds {len(table.names)} patches, expected at least {_LEAST_PATCHES}"
        problems.append(Problem(table.source["file"], what, "Use a target of more colours"))
    raise_problems(CaptureError, problems)
    for row, name in enumerate(table.names):
        share = float(shot.clipped[table.inner(row)].mean())
        if share > _CLIPPED:
            do = "Expose for less time, or leave it out with --without"
            problems.append(Problem(f"patch {name}", f"is clipped in {share:.1%} of its samples", do))
    raise_problems(CaptureError, problems)
    response = response_table(oecf, [shot])
    black = dark_image(dark, shot, response)
    rgb, _, _ = table.read(shot.linear(response) - black)
    if even is not None:
        level, _, _ = table.read(even.linear(response) - black)
        raise_problems(CaptureError, _card_problems(even, level.mean(axis=1)))
        # Divided by its brightness, not by its colour: the light's colour belongs to the camera's numbers.
        rgb = rgb * (level.mean() / level.mean(axis=1, keepdims=True)) / level.mean()
    else:
        row = table.names.index(str(white))
        rgb = rgb / (rgb[row].mean() / xyz[row, 1])
    fits = {name: fit_colour(rgb, xyz, white_xyz, name) for name in METHODS}
    chosen = method or min(fits, key=lambda name: float(fits[name].left_out.mean()))
    if (off := float(fits[chosen].difference.mean())) > _NO_CAMERA:
        what = f"shows patches that are off what is known of them by {off:.0f} CIEDE2000 in the mean, "
        what += f"expected less than {_NO_CAMERA:.0f}"
        do = "Check the boxes, which way up the target lies, and that the table is of this target"
        raise CaptureError(Problem(shot.path.name, what, do))
    content = {
        "chosen": chosen,
        "white_xyz": white_xyz.tolist(),
        "patches": list(table.names),
        "boxes_px": [list(box) for box in table.boxes],
        "methods": {
            name: {
                "matrix": fit.matrix.tolist(),
                "ciede2000": fit.difference.tolist(),
                "ciede2000_left_out": fit.left_out.tolist(),
            }
            for name, fit in fits.items()
        },
    }
    used = [shot, *([even] if even else [])]
    made_from = [
        *(one.provenance for one in used),
        table.source,
        {"target": target or "the table's own data"},
    ]
    write_calibration(Path(out), "colour", content, subject=subject_of([shot]), made_from=made_from)
    return Colour(Path(out), fits, chosen, white_xyz, table.names)


def _card_problems(card: Shot, level: Array) -> list[Problem]:
    if level.max() < _DIM:
        what = f"reads {level.max():.1%} of full scale in a patch's place, expected more than {_DIM:.0%}"
        return [Problem(card.path.name, what, "Photograph a white card in the target's place")]
    if level.max() > _UNEVEN * level.min():
        what = f"is no even card: its patches read {level.min():.2g} to {level.max():.2g} of full scale"
        return [Problem(card.path.name, what, "Photograph a white card in the target's place, evenly lit")]
    return []


def _shot_problems(shot: Shot, card: Shot | None) -> list[Problem]:
    problems = []
    if shot.codes.shape[2] != 3:
        problems.append(Problem(shot.path.name, "is grey, expected three channels", "Photograph in colour"))
    if card is not None and card.codes.shape != shot.codes.shape:
        problems.append(
            Problem(card.path.name, f"has another size than {shot.path.name}", "Export both alike")
        )
    if card is not None and float(card.clipped.mean()) > _CLIPPED:
        problems.append(Problem(card.path.name, "is clipped", "Expose the card for less time"))
    return problems
