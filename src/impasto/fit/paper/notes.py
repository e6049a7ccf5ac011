"""What the paper's procedure says: what lights in one plane leave open, what it assumed, what it found."""

from __future__ import annotations

import numpy as np

from impasto.arm import Arm
from impasto.fit.paper.crossing import Crossing
from impasto.fit.paper.survey import Survey
from impasto.fit.paper.threshold import LEAST_DEG, MOST_DEG, NEGLIGIBLE


def plane(arm: Arm, view_phi: float, refined: bool) -> tuple[str, ...]:
    """Say what cannot be told from lights in one plane, and what is assumed instead.

    Parameters
    ----------
    arm : Arm
    view_phi : float
        φv, the camera's tilt out of the plane, radians.
    refined : bool
    """
    view_deg = float(np.degrees(view_phi))
    said = [
        f"the lights lie in one plane, at azimuth {round(np.degrees(arm.azimuth))}°: the diffuse term shows "
        "the product Ad cos φn only, not Ad and the normal's tilt φn out of that plane apart",
    ]
    if abs(view_deg) < 0.05:
        said.append("the height of a pixel's highlight gives |φn|: φn and −φn look the same")
    else:
        said.append(
            f"the camera is φv = {view_deg:.1f}° out of that plane, and the height of a pixel's highlight "
            "gives |φn − φv/2|: φn and φv − φn look the same"
        )
    if refined:
        said.append(
            "assumed: the view as calibrated, and of the two φn the one nearer to the painting's normal"
        )
    else:
        said.append("assumed, as in the paper: the view in the plane (φv = 0)")
        if abs(view_deg) >= 0.05:
            said[-1] += (
                f". The φn given is |φn − φv/2|; read as |φn| it is off by up to {abs(view_deg) / 2:.1f}°"
            )
    off_plane_deg = float(np.degrees(arm.off_plane))
    if off_plane_deg > 0.1:
        said.append(f"lights up to {off_plane_deg:.1f}° from the plane were taken to lie in it")
    return tuple(said)


def threshold(threshold_deg: float, seen_deg: float | None, highlight: str = "pixel") -> str:
    """Say which lights the diffuse term is from, and, where the threshold was chosen, why.

    Parameters
    ----------
    threshold_deg : float
    seen_deg : float or None
        How far highlights are seen, if the threshold was chosen by that.
    highlight : str
        ``pixel`` or ``sample``: whose brightest light the threshold is taken from.
    """
    whose = "a pixel's brightest" if highlight == "pixel" else "the brightest pixel's"
    said = f"lights less than {threshold_deg:g}° from {whose} do not count for the diffuse term"
    if seen_deg is None:
        return said
    return (
        f"{said}. Chosen because in nine of ten pixels the specular term is below {NEGLIGIBLE:.0%} of the "
        f"diffuse one from {seen_deg:.0f}° on, within {LEAST_DEG:.0f} to {MOST_DEG:.0f}° and so that enough "
        "lights remain"
    )


def specular(magnitude: float, crossing: Crossing, found: Survey, light: str) -> str:
    """Say what As is, from where, and what it rests on, or why it is not identified.

    Parameters
    ----------
    magnitude : float
        As of the brightest pixel.
    crossing : Crossing
    found : Survey
    light : str
        Name of the light under which that pixel is brightest.
    """
    if magnitude <= 0:
        return "no pixel is brighter than its diffuse term: As and the shape are not identified"
    if crossing.identified:
        return (
            f"one As for the whole sample, {magnitude:.4g}, from the brightest pixel (row {found.row}, "
            f"column {found.column}, under {light}). Lights in one plane do not tell As by themselves: "
            "assumed is that this pixel's normal lies where the half vector does"
        )
    half_deg = np.degrees(abs(crossing.view_phi) / 2)
    reach_deg, offset_deg = np.degrees([crossing.reach, crossing.offset])
    return (
        "As and the shape are not identified and left out, because no highlight crosses the lights' plane: "
        f"for that, normals must tilt φv/2 = {half_deg:.1f}° out of it, and they reach {reach_deg:.1f}° "
        f"(taken to be what they reach in the plane). From {offset_deg:.1f}° off, more than 0.64 c, what "
        f"looks like c = {crossing.c_apparent:.3f} is a highlight of c = {crossing.c:.3f} or less with a "
        "larger As. Tilt the camera into the plane, or take photographs from a second azimuth"
    )


def clipped(pixels: int, of_all: int) -> tuple[str, ...]:
    """Say how many pixels could not be asked for the peak."""
    if not pixels:
        return ()
    return (
        f"{pixels} pixels ({pixels / of_all:.2%}) have a clipped sample and were not asked for the peak: if "
        "the highlight is brightest there, As is too small",
    )


def theta_error(error_deg: float) -> str:
    """Say how large the error of θn is, as θv tells it."""
    return (
        f"the error of θn, as θv tells it, is about {error_deg:.2f}°: half its standard deviation, because "
        "it takes up what the diffuse stage got wrong; weak and broad highlights make it look larger"
    )
