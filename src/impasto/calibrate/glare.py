"""Measure how much stray light lens and camera add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.dark import dark_image
from impasto.calibrate.response_file import response_table
from impasto.calibrate.shots import box_mean, box_problems, read_shot
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.geometry import Array

# Stray light above this share of the surround's lifts dark paints visibly.
_MUCH = 0.01
# What reads more than this share of its surround is no black trap.
_NO_TRAP = 0.3


@dataclass(frozen=True)
class Glare:
    """What `calibrate.glare` found.

    Parameters
    ----------
    share : ndarray of shape (C,)
        Stray light in the black trap, as a share of the bright surround.
    trap, bright : ndarray of shape (C,)
        What both read, in shares of full scale.
    much : bool
        Whether it is more than a careful set-up has.
    """

    share: Array
    trap: Array
    bright: Array
    much: bool


def glare(
    photo: str | PathLike[str],
    *,
    trap: Sequence[int],
    bright: Sequence[int],
    trap_reflectance: float = 0.0,
    bright_reflectance: float = 0.98,
    dark: str | PathLike[str] | None = None,
    oecf: str | PathLike[str] | None = None,
) -> Glare:
    """Measure stray light in a black trap, or a dark patch of known reflectance, beside something bright.

    Parameters
    ----------
    photo : path
    trap, bright : (int, int, int, int)
        First column, first row, end column and end row of the trap and of the bright card around it.
    trap_reflectance, bright_reflectance : float, optional
    dark, oecf : path, optional
        As for `flat`.

    Returns
    -------
    Glare

    Raises
    ------
    CaptureError
        If the photograph cannot be used, or the bright card is clipped.
    OptionError
        If a box does not lie in the photograph.

    References
    ----------
    [ISO9358]_: the black area's luminance as a share of the bright surround's.
    """
    shot = read_shot(Path(photo))
    problems = box_problems(trap, shot.codes.shape, "--trap") + box_problems(
        bright, shot.codes.shape, "--bright"
    )
    raise_problems(OptionError, problems)
    left, top, right, bottom = bright
    if shot.clipped[top:bottom, left:right].mean() > 1e-3:
        raise CaptureError(
            Problem(shot.path.name, "shows the bright card clipped", "Expose it for less time")
        )
    table = response_table(oecf, [shot])
    image = shot.linear(table) - dark_image(dark, shot, table)
    in_trap, beside = box_mean(image, trap), box_mean(image, bright)
    if not (in_trap < _NO_TRAP * beside).all():
        what = f"reads {np.max(in_trap):.3g} of full scale, and --bright {np.min(beside):.3g}: no black trap"
        raise CaptureError(Problem("--trap", what, "Check the two boxes: the first lies in the black trap"))
    share = in_trap / beside - trap_reflectance / bright_reflectance
    return Glare(share, in_trap, beside, bool(share.max() > _MUCH))
