"""Under which lights the samples are shown: with and without a highlight, and the same for all samples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.arm import find_arm
from impasto.errors import OptionError, Problem, raise_problems
from impasto.geometry import Lights, zenith_azimuth
from impasto.pixels import join_pixels, luminance, read_pixels, render_pixels
from impasto.store import Fit, Stack

HIGHLIGHT_FROM = 0.1
"""Share of the light that the highlight brings from which on an angle counts as one with a highlight."""

_SAME_ANGLE_DEG = 0.5
_PIXELS = 20_000
_BAND_ROWS = 256


@dataclass(frozen=True)
class Angle:
    """A light that every sample was photographed under.

    Parameters
    ----------
    label : str
        Degrees along the arm, or the photograph's name where the lights lie on no arm.
    order : float
        What angles are sorted by: degrees along the arm, or the zenith angle.
    lights : dict of str to int
        Per sample, the number of its photograph.
    """

    label: str
    order: float
    lights: dict[str, int]


def common_angles(stacks: Mapping[str, Stack]) -> list[Angle]:
    """Return the lights that all samples were photographed under, in rising order.

    Lights on an arm are the same where their angles differ by less than 0.5°; others, where the photographs
    have the same name.

    Parameters
    ----------
    stacks : mapping of str to Stack
        By the name of the sample.

    Raises
    ------
    OptionError
        If there is none.
    """
    lights = {sample: stack.lights for sample, stack in stacks.items()}
    arm = all(find_arm(entry.direction).planar for entry in lights.values())
    angles = _along_arm(lights) if arm else _by_name(lights)
    if not angles:
        what = "were not photographed under one common light"
        do = "Compare samples whose lights stood alike, or make an experiment of each"
        raise OptionError(Problem(", ".join(stacks), what, do))
    return sorted(angles, key=lambda angle: (angle.order, angle.label))


def _along_arm(lights: Mapping[str, Lights]) -> list[Angle]:
    degrees = {}
    for sample, entry in lights.items():
        x, _, z = find_arm(entry.direction).into(entry.direction).T
        degrees[sample] = np.degrees(np.arctan2(x, z))
    first = next(iter(degrees.values()))
    angles: dict[str, Angle] = {}
    for angle in first:
        nearest = {sample: int(np.abs(values - angle).argmin()) for sample, values in degrees.items()}
        if all(abs(degrees[sample][index] - angle) < _SAME_ANGLE_DEG for sample, index in nearest.items()):
            # Adding 0 makes the rounded angle of a light at the normal 0 and never -0.
            label = f"{round(float(angle), 1) + 0:g}"
            angles.setdefault(label, Angle(label, float(angle), nearest))
    return list(angles.values())


def _by_name(lights: Mapping[str, Lights]) -> list[Angle]:
    first = next(iter(lights.values()))
    zenith, _ = np.degrees(zenith_azimuth(first.direction))
    return [
        Angle(
            name, float(zenith[number]), {sample: entry.names.index(name) for sample, entry in lights.items()}
        )
        for number, name in enumerate(first.names)
        if all(name in entry.names for entry in lights.values())
    ]


def named_angles(angles: Sequence[Angle], wanted: Iterable[str], stacks: Mapping[str, Stack]) -> list[Angle]:
    """Return the angles of a list, by label or by the name of any sample's photograph.

    Raises
    ------
    OptionError
        Listing every entry that no common angle has.
    """
    known = {
        stacks[sample].lights.names[index]: angle
        for angle in angles
        for sample, index in angle.lights.items()
    }
    known |= {angle.label: angle for angle in angles}
    wanted = list(dict.fromkeys(wanted))
    raise_problems(
        OptionError,
        (
            Problem(
                f"--angle {entry}",
                "is neither an angle nor a photograph that all samples have",
                f"Choose from {', '.join(angle.label for angle in angles)}",
            )
            for entry in wanted
            if entry not in known
        ),
    )
    chosen = {known[entry].label: known[entry] for entry in wanted}
    return sorted(chosen.values(), key=lambda angle: (angle.order, angle.label))


def highlight_shares(
    fit: Fit, stack: Stack, crop: tuple[slice, slice], lights: Sequence[int]
) -> NDArray[np.float64]:
    """Return the share of the light from a surface that its highlight brings.

    Parameters
    ----------
    fit : Fit
    stack : Stack
    crop : (slice, slice)
        Rows and columns to look at; 20,000 pixels among them, evenly spread.
    lights : sequence of int

    Returns
    -------
    ndarray of shape (L,), float64
        0 to 1: the luminance of the fit's specular term over that of the whole, both summed over the pixels.
    """
    rows, columns = crop
    count = (rows.stop - rows.start) * (columns.stop - columns.start)
    step = max(1, count // _PIXELS)
    parts, seen = [], 0
    for top in range(rows.start, rows.stop, _BAND_ROWS):
        band = read_pixels(fit, slice(top, min(top + _BAND_ROWS, rows.stop)), columns)
        parts.append(band.select(np.arange(-seen % step, len(band), step)))
        seen += len(band)
    pixels = join_pixels(parts)
    pixels = pixels.select(~pixels.missing)
    matte = pixels.without_highlights()
    shares = []
    for light in lights:
        one = stack.lights.select([light])
        whole, diffuse = (
            float(luminance(render_pixels(part, one, stack.camera)[0]).sum()) for part in (pixels, matte)
        )
        shares.append(1 - diffuse / whole if whole > 0 else 0.0)
    return np.array(shares)


def choose_angles(angles: Sequence[Angle], shares: Sequence[float], count: int) -> list[Angle]:
    """Choose angles so that they cover both kinds, with and without a highlight.

    One half, rounded up, has a highlight, taken evenly along the share that it brings; the others are taken
    evenly along the angle. Where there are too few of one kind, the other fills up.

    Parameters
    ----------
    angles : sequence of Angle
        In rising order.
    shares : sequence of float
        Of each, the share of the light that the highlight brings.
    count : int

    Returns
    -------
    list of Angle
        In rising order.
    """
    glossy = sorted(
        (index for index in range(len(angles)) if shares[index] > HIGHLIGHT_FROM), key=lambda i: shares[i]
    )
    matte = [index for index in range(len(angles)) if shares[index] <= HIGHLIGHT_FROM]
    count = min(count, len(angles))
    with_highlight = min(len(glossy), max(-(-count // 2), count - len(matte)))
    chosen = _evenly(glossy, with_highlight) + _evenly(matte, count - with_highlight)
    return [angles[index] for index in sorted(chosen)]


def _evenly(members: Sequence[int], count: int) -> list[int]:
    """Return the middle of each of `count` groups of equal size."""
    return [int(group[len(group) // 2]) for group in np.array_split(members, count)] if count else []
