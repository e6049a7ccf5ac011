"""What lights tell of a kind of surface: which parameters, and how well."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.angles.criterion import LOG_SD, TILT_SD
from impasto.angles.photographed import camera_for
from impasto.angles.placement import arm_angles_deg
from impasto.arm import find_arm
from impasto.evaluate.curves import half_width_deg
from impasto.fit.information import fisher_information, parameter_names
from impasto.geometry import Array, Camera, Lights, direction_tilts
from impasto.pixels import Pixels

# A parameter counts as told where its standard deviation is below this share of what was known before.
_TOLD = 0.5
# Lights further from the mirror direction than this many half-widths show the diffuse term.
_BEYOND = 3.0
_DIFFUSE_LIGHTS = 3


@dataclass(frozen=True)
class Uncertainty:
    """How well a parameter is expected to be known.

    Parameters
    ----------
    parameter : str
    unit : str
        ``deg`` or ``%``.
    sd : float
        Expected standard deviation, median of the pixels.
    sd_95 : float
        Its 95th percentile.
    told : float
        Share of the pixels in which it is below half of what is assumed beforehand.
    """

    parameter: str
    unit: str
    sd: float
    sd_95: float
    told: float


@dataclass(frozen=True)
class Kind:
    """Pixels with highlights of like width.

    Parameters
    ----------
    name : str
        ``sharp``, ``medium`` or ``broad``.
    width_deg : tuple of float
        Least and largest full width of the highlight at half its height, in angles of the light.
    seen : float
        Share of the pixels with a light within half that width of the mirror direction.
    uncertainties : tuple of Uncertainty
    """

    name: str
    width_deg: tuple[float, float]
    seen: float
    uncertainties: tuple[Uncertainty, ...]


@dataclass(frozen=True)
class Identifiability:
    """What lights tell.

    Parameters
    ----------
    sentences : tuple of str
        What they do not tell, in words; empty if nothing.
    gap_deg : float
        Highlights narrower than this fall between the lights.
    kinds : tuple of Kind
    """

    sentences: tuple[str, ...]
    gap_deg: float
    kinds: tuple[Kind, ...]


def identify(
    pixels: Pixels, lights: Lights, camera: Camera, noise: tuple[float, float, float]
) -> Identifiability:
    """Say what lights tell of pixels, from the Fisher information of the photographs they would give.

    Parameters
    ----------
    pixels : Pixels
        A kind of surface, with all parameters.
    lights : Lights
    camera : Camera
    noise : tuple of float
        (read, photon, relative), see `store.Stack.noise`.
    """
    widths = _widths_deg(pixels, camera)
    off_mirror = _off_mirror_deg(pixels, lights, camera)
    seen = off_mirror.min(axis=0) <= widths / 2
    gap = _gap_deg(pixels, lights, camera)
    sd = _deviations(pixels, lights, camera, noise)
    order = np.argsort(widths, kind="stable")
    kinds = []
    for name, members in zip(("sharp", "medium", "broad"), np.array_split(order, 3), strict=True):
        if len(members):
            span = (float(widths[members].min()), float(widths[members].max()))
            kinds.append(Kind(name, span, float(seen[members].mean()), tuple(_uncertainties(sd, members))))
    sentences = [
        *_plane(lights, camera),
        *_between(gap, widths, seen),
        *_diffuse(off_mirror, widths),
        *_untold(kinds),
    ]
    return Identifiability(tuple(sentences), gap, tuple(kinds))


def _widths_deg(pixels: Pixels, camera: Camera) -> Array:
    """Return the full width of each pixel's highlight at half its height, from a table over the shapes."""
    if not pixels.model.lobes:
        return np.full(len(pixels), np.nan)
    up = np.array([0.0, 0.0, 1.0])
    shapes = pixels.shape.astype(np.float64)
    order = np.argsort(shapes[:, 0], kind="stable")
    some = order[np.unique(np.linspace(0, len(order) - 1, 25).astype(int))]
    table = [2 * half_width_deg(pixels, shapes[each], up, camera) for each in some]
    return np.interp(shapes[:, 0], shapes[some, 0], table)


def _off_mirror_deg(pixels: Pixels, lights: Lights, camera: Camera) -> Array:
    """Return the angle of each light from each pixel's mirror direction, shape (L, P)."""
    normal, view = pixels.normal.astype(np.float64), camera.view_direction
    mirror = 2 * (normal @ view)[:, None] * normal - view
    return np.asarray(np.degrees(np.arccos(np.clip(lights.direction @ mirror.T, -1.0, 1.0))))


def _gap_deg(pixels: Pixels, lights: Lights, camera: Camera) -> float:
    """Return the width below which a highlight, where normals send it, may meet no light."""
    in_plane = camera_for(lights, camera)
    angle = arm_angles_deg(lights.direction)
    if angle is None:
        nearest = _off_mirror_deg(pixels, lights, in_plane).min(axis=0)
        return float(2 * np.percentile(nearest, 95))
    arm = find_arm(lights.direction)
    theta, _ = np.degrees(direction_tilts(arm.into(pixels.normal)))
    view, _ = np.degrees(direction_tilts(arm.into(in_plane.view_direction)))
    nearest = np.abs(2 * theta - view - angle[:, None]).min(axis=0)
    return float(2 * np.percentile(nearest, 95))


def _deviations(
    pixels: Pixels, lights: Lights, camera: Camera, noise: tuple[float, float, float]
) -> dict[str, tuple[str, Array, float]]:
    """Return per parameter its unit, its standard deviation in each pixel, and what is known beforehand."""
    names = parameter_names(pixels)
    unclipped = np.full(pixels.diffuse.shape[1], np.inf)
    information = fisher_information(pixels, lights, camera, noise, unclipped)
    prior = np.full(len(names), LOG_SD)
    prior[:2] = TILT_SD
    covariance = np.linalg.inv(information + np.diag(1 / prior**2))
    azimuth = find_arm(lights.direction).azimuth if arm_angles_deg(lights.direction) is not None else 0.0
    found = {}
    # The tangents of normals that tilt little are X and Y.
    for words, angle in (("tilt along", azimuth), ("tilt across", azimuth + np.pi / 2)):
        towards = np.array([np.cos(angle), np.sin(angle)])
        variance = np.einsum("i,pij,j->p", towards, covariance[:, :2, :2], towards)
        found[words] = ("deg", np.degrees(np.sqrt(variance)), float(np.degrees(TILT_SD)))
    for number, name in enumerate(names[2:], start=2):
        found[name] = ("%", 100 * np.sqrt(covariance[:, number, number]), 100 * LOG_SD)
    return found


def _uncertainties(
    sd: dict[str, tuple[str, Array, float]], members: NDArray[np.intp]
) -> Iterator[Uncertainty]:
    for name, (unit, values, known) in sd.items():
        median, high = np.percentile(values[members], [50, 95]).tolist()
        yield Uncertainty(name, unit, median, high, float(np.mean(values[members] < _TOLD * known)))


def _plane(lights: Lights, camera: Camera) -> Iterator[str]:
    arm = find_arm(lights.direction)
    if not arm.planar:
        return
    yield (
        "with one azimuth, the tilt towards the normal of the lights' plane cannot be told from a darker "
        "pigment, nor from a weaker and broader highlight; a second azimuth would tell them apart"
    )
    _, phi = np.degrees(direction_tilts(arm.into(camera.view_direction)))
    if abs(phi) > 1.0:
        yield (
            f"the camera stands {abs(phi):.0f}° out of the lights' plane: only surface that tilts by "
            f"{abs(phi) / 2:.1f}° towards it shows the peak of its highlight"
        )


def _between(gap: float, widths: Array, seen: NDArray[np.bool_]) -> Iterator[str]:
    if not np.isfinite(widths).any():
        return
    share = float(np.mean(widths < gap))
    if share > 0.05:
        yield (
            f"highlights narrower than {gap:.0f}° fall between your lights: {100 * share:.0f} % of this "
            "surface has such"
        )
    if seen.mean() < 0.95:
        unseen = 100 * (1 - seen.mean())
        yield f"{unseen:.0f} % of this surface shows the peak of its highlight under no light"


def _diffuse(off_mirror: Array, widths: Array) -> Iterator[str]:
    beyond = (off_mirror > _BEYOND * widths / 2).sum(axis=0)
    short = float(np.mean(beyond < _DIFFUSE_LIGHTS)) if np.isfinite(widths).any() else 0.0
    if short > 0.05:
        yield (
            f"{100 * short:.0f} % of this surface has fewer than {_DIFFUSE_LIGHTS} lights clear of its "
            "highlight: colour and gloss are told apart badly there"
        )


def _untold(kinds: list[Kind]) -> Iterator[str]:
    for kind in kinds:
        untold = [each.parameter for each in kind.uncertainties if each.told < 0.5]
        if untold:
            yield f"{kind.name} highlights: {', '.join(untold)} not told in most of the surface"
