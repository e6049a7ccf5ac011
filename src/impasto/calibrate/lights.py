"""Find where the lights stand from mirror spheres in the photographs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.calibrate.files import write_calibration
from impasto.calibrate.mirror import (
    Rays,
    Reflection,
    Sphere,
    find_reflection,
    given_sphere,
    locate_sphere,
)
from impasto.calibrate.outline import circle_problem, find_circles, outline_points
from impasto.calibrate.shots import Shot, box_problems, one_by_one, photographs_in
from impasto.calibrate.sphere_picture import draw_spheres, thinned
from impasto.calibrate.sphere_windows import SphereWindow, cut_out
from impasto.calibrate.triangulate import Placed, place_light
from impasto.capture.light_files import read_camera
from impasto.capture.manifest import light_positions, manifest
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.geometry import Array, Camera, Lights
from impasto.output import prepare_folder, write_text

INTENSITIES = ("equal", "spheres", "card")
MANIFEST = "lights.toml"

# Spheres that see a light this much further apart than they see the others name a doubtful one.
_DOUBTFUL_DEG = 2.0
_OUTLYING = 4.0


@dataclass(frozen=True)
class LightsCalibration:
    """What `calibrate.lights` found.

    Parameters
    ----------
    folder : Path
        Where the files are.
    names : tuple of str, length L
    lights : Lights
    spheres : tuple of Sphere
    disagreement_deg : ndarray of shape (L,)
        Greatest angle between a sphere's view of the light and where it was placed; NaN with one sphere.
    position_sd_mm : ndarray of shape (L,)
        Standard deviation of the distance; NaN where only the direction is known.
    doubtful : tuple of str
        Lights on which the spheres do not agree.
    dropped : tuple of str
    notes : tuple of str
    """

    folder: Path
    names: tuple[str, ...]
    lights: Lights
    spheres: tuple[Sphere, ...]
    disagreement_deg: Array
    position_sd_mm: Array
    doubtful: tuple[str, ...]
    dropped: tuple[str, ...]
    notes: tuple[str, ...]


def lights(
    photos: str | PathLike[str],
    out: str | PathLike[str],
    *,
    spheres: Sequence[Sequence[float]] = (),
    count: int | None = None,
    camera: Camera | str | PathLike[str] | None = None,
    mm_per_px: float | None = None,
    radius_mm: float | None = None,
    drop: Iterable[str] = (),
    exclude: Iterable[str] = (),
    intensity: str = "equal",
    card: Sequence[int] | None = None,
) -> LightsCalibration:
    """Find the direction of each light, and with two or more spheres its position, from mirror spheres.

    Parameters
    ----------
    photos : path
        Folder of photographs, one per light, in which the spheres do not move.
    out : path
        Folder for ``lights.lp``, the manifest ``lights.toml``, ``spheres.png`` to check by eye, and
        ``lights.json``, which says what they were made from.
    spheres : sequence of (column, row, radius), optional
        Outlines of the spheres in pixels; found by themselves without.
    count : int, optional
        How many spheres to look for.
    camera : Camera or path, optional
        Where the camera stands, or a TOML file with a table ``[camera]``; straight above by default.
    mm_per_px : float, optional
        Size of a pixel on the painting, if `camera` does not say it.
    radius_mm : float, optional
        Radius of the spheres, which tells the size of a pixel where nothing else does.
    drop : iterable of str, optional
        Lights to leave out of the result.
    exclude : iterable of str, optional
        Photographs in the folder that are of no light.
    intensity : {'equal', 'spheres', 'card'}
        Where each light's relative intensity comes from: nowhere; the lamps' images in the spheres, which
        must not be clipped; or a card of even colour on the painting's plane.
    card : (int, int, int, int), optional
        First column, first row, end column and end row of the card.

    Returns
    -------
    LightsCalibration

    Raises
    ------
    CaptureError
        If photographs cannot be read, no sphere is found, or a light is seen in none of them.
    OptionError
        If an option cannot be used.
    OutputError
        If a file cannot be written.

    Notes
    -----
    The spheres rest on the plane of the painting. Directions are those from the painting's centre, which is
    the centre of the image; without positions, they are the mean over the spheres.
    """
    paths = photographs_in(Path(photos), exclude)
    dropped = tuple(dict.fromkeys(drop))
    problems = _option_problems(dropped, paths, intensity, card, mm_per_px, radius_mm, count)
    viewed = _camera(camera, mm_per_px)
    shots: list[Shot] = []
    mean = brightest = np.zeros((1, 1))
    # One photograph at a time is in memory, and all are read twice: the spheres are found in their mean.
    for shot in one_by_one(paths):
        level = shot.luminance()
        if not shots:
            raise_problems(OptionError, problems + _place_problems(spheres, card, level.shape))
            mean = np.zeros(level.shape)
            brightest = np.zeros(thinned(level).shape)
        mean += level
        np.maximum(brightest, thinned(level), out=brightest)
        shots.append(shot.without_pixels)
    mean /= len(shots)
    size = mean.shape
    found, rays = _find_spheres(mean, spheres, count, viewed, radius_mm)
    del mean
    kept = [row for row, shot in enumerate(shots) if shot.name not in dropped]
    windows, on_card = _cut_out(paths, found, card, rays)
    seen = _reflections(paths, windows, kept, found, rays)
    placed, notes = _place([seen[row] for row in kept], rays)
    names = tuple(shots[row].name for row in kept)
    notes += _cropped(found, size)
    result = Lights(
        names,
        np.array([one.direction for one in placed]),
        np.array([one.position_mm for one in placed]),
    )
    if intensity == "card" and card is not None:
        gains = _gains_on_card([on_card[row] for row in kept], card, result, rays)
    elif intensity == "spheres":
        gains = _gains_in_spheres([shots[row] for row in kept], [seen[row] for row in kept], result)
    else:
        gains = np.ones((len(kept), 1))
    result = Lights(names, result.direction, result.position_mm, gains)
    disagreement = np.array([one.disagreement_deg for one in placed])
    doubtful = tuple(names[row] for row in _doubtful(disagreement))
    folder = prepare_folder(out)
    files = [shots[row].path.name for row in kept]
    write_text(folder / "lights.lp", light_positions(files, result))
    write_text(folder / MANIFEST, manifest(files, result, rays.camera))
    draw_spheres(folder / "spheres.png", brightest, size, found, [seen[row] for row in kept], names, doubtful)
    summary = LightsCalibration(
        folder=folder,
        names=names,
        lights=result,
        spheres=tuple(found),
        disagreement_deg=disagreement,
        position_sd_mm=np.array([one.distance_sd_mm for one in placed]),
        doubtful=doubtful,
        dropped=dropped,
        notes=tuple(notes),
    )
    write_calibration(
        folder / "lights.json", "lights", _record(summary), made_from=[shot.provenance for shot in shots]
    )
    return summary


def _option_problems(
    dropped: Sequence[str],
    paths: Sequence[Path],
    intensity: str,
    card: Sequence[int] | None,
    mm_per_px: float | None,
    radius_mm: float | None,
    count: int | None,
) -> list[Problem]:
    problems = [
        Problem(f"--drop {name}", "is none of the photographs", "Correct the name")
        for name in dropped
        if name not in {path.stem for path in paths}
    ]
    if intensity not in INTENSITIES:
        what = "is not known"
        problems.append(Problem(f"--intensity {intensity}", what, f"Choose {', '.join(INTENSITIES)}"))
    for option, size in (("--mm-per-px", mm_per_px), ("--radius-mm", radius_mm), ("--count", count)):
        if size is not None and not size > 0:
            problems.append(Problem(f"{option} {size:g}", "is not above 0", "Correct it, or leave it out"))
    if (intensity == "card") != (card is not None):
        do = "Give both --intensity card and --card COLUMN,ROW,COLUMN,ROW, or neither"
        problems.append(Problem("--card", "and --intensity card belong together", do))
    return problems


def _place_problems(
    spheres: Sequence[Sequence[float]], card: Sequence[int] | None, shape: Sequence[int]
) -> list[Problem]:
    problems = [
        Problem(f"--sphere {column:g},{row:g},{radius:g}", told, "Give column, row and radius in pixels")
        for column, row, radius in spheres
        if (told := circle_problem((column, row, radius), shape))
    ]
    return problems if card is None else problems + box_problems(card, shape, "--card")


def _camera(camera: Camera | str | PathLike[str] | None, mm_per_px: float | None) -> Camera:
    if camera is None:
        found = Camera()
    else:
        found = camera if isinstance(camera, Camera) else read_camera(Path(camera))
    px = mm_per_px or found.mm_per_px
    if found.distance_mm is not None and px is None:
        what = "states the camera's distance, and no mm_per_px is known"
        raise OptionError(Problem("--camera", what, "Add mm_per_px there, or give --mm-per-px"))
    return Camera(found.view_direction, found.distance_mm, px)


def _find_spheres(
    mean: Array,
    circles: Sequence[Sequence[float]],
    count: int | None,
    camera: Camera,
    radius_mm: float | None,
) -> tuple[list[Sphere], Rays]:
    height, width = mean.shape
    rays = Rays(camera, height, width)
    if circles:
        found = [given_sphere((column, row, radius), rays) for column, row, radius in circles]
    else:
        outlines = [outline_points(mean, circle) for circle in find_circles(mean, count)]
        found = [locate_sphere(points, rays) for points in outlines if points is not None]
    if not found or (count and not circles and len(found) < count):
        what = f"show {len(found) or 'no'} sphere{'s' if len(found) != 1 else ''} with a clear outline"
        do = "Give each with --sphere COLUMN,ROW,RADIUS in pixels"
        raise CaptureError(Problem("the photographs", what, do))
    if radius_mm is not None and camera.mm_per_px is None:
        # Without perspective, a sphere's outline is as large as the sphere.
        scale = radius_mm / float(np.mean([sphere.radius for sphere in found]))
        scaled = Camera(camera.view_direction, None, scale)
        found = [
            Sphere(sphere.centre * scale, sphere.radius * scale, sphere.circle, sphere.residual_px)
            for sphere in found
        ]
        rays = Rays(scaled, height, width)
    return found, rays


def _cut_out(
    paths: Sequence[Path], spheres: Sequence[Sphere], card: Sequence[int] | None, rays: Rays
) -> tuple[list[SphereWindow], list[Shot]]:
    """Return what all photographs show of each sphere, and of the card if there is one."""
    on_card = []

    def read() -> Iterator[Shot]:
        for shot in one_by_one(paths):
            yield shot
            if card is not None:
                left, top, right, bottom = card
                on_card.append(shot.part((slice(top, bottom), slice(left, right))))

    return cut_out(read(), len(paths), spheres, rays), on_card


def _reflections(
    paths: Sequence[Path],
    windows: Sequence[SphereWindow],
    kept: Sequence[int],
    spheres: Sequence[Sphere],
    rays: Rays,
) -> dict[int, list[Reflection | None]]:
    """Return each light's reflection in each sphere."""
    seen: dict[int, list[Reflection | None]] = {row: [] for row in kept}
    for window, sphere in zip(windows, spheres, strict=True):
        background = window.background()
        for row in kept:
            seen[row].append(
                find_reflection(window.level[row], background, window.clipped[row], sphere, rays)
            )
    problems = [
        Problem(
            paths[row].name,
            "shows its lamp in no sphere",
            f"Leave it out with --drop {paths[row].stem}, or correct the circles with --sphere",
        )
        for row in kept
        if not any(seen[row])
    ]
    raise_problems(CaptureError, problems)
    return seen


def _place(seen: Sequence[list[Reflection | None]], rays: Rays) -> tuple[list[Placed], list[str]]:
    """Place all lights; how far the spheres disagree, over all of them, says how well distances are known."""
    known = rays.camera.mm_per_px is not None
    views = [[view for view in light if view is not None] for light in seen]
    first = [place_light(light, near=known, sd=None) for light in views]
    apart = np.array([one.disagreement_deg for one in first])
    sd = float(np.nanmedian(np.radians(apart))) if np.isfinite(apart).any() else None
    placed = [place_light(light, near=known, sd=sd) for light in views]
    notes = []
    far = [one for one in placed if not np.isfinite(one.position_mm).all()]
    if all(len(light) < 2 for light in views):
        notes.append("one sphere tells directions only; a second one would tell distances")
    elif not known:
        notes.append("directions only: give --mm-per-px or --radius-mm for distances")
    elif far:
        notes.append(f"{len(far)} of {len(placed)} lights are too far away for their distance to be told")
    if far and len(far) < len(placed):
        notes.append("lights without a position count as infinitely far away")
    return placed, notes


def _cropped(spheres: Sequence[Sphere], size: tuple[int, ...]) -> list[str]:
    """Return a note for each sphere that the frame cuts off."""
    notes = []
    for number, sphere in enumerate(spheres, start=1):
        column, row, radius = sphere.circle
        if not (radius <= column <= size[1] - 1 - radius and radius <= row <= size[0] - 1 - radius):
            notes.append(
                f"sphere {number} is cut off by the frame's edge: lamps that it mirrors there are not seen; "
                "lay it well within the frame"
            )
    return notes


def _doubtful(disagreement_deg: Array) -> list[int]:
    if not np.isfinite(disagreement_deg).any():
        return []
    usual = float(np.nanmedian(disagreement_deg))
    return np.flatnonzero(disagreement_deg > max(_OUTLYING * usual, _DOUBTFUL_DEG)).tolist()


def _gains_in_spheres(
    shots: Sequence[Shot], seen: Sequence[list[Reflection | None]], lights: Lights
) -> Array:
    """Return each light's relative irradiance at the centre of the painting, of mean 1, shape (L, 1)."""
    what = "shows its lamp clipped, so that its intensity cannot be told"
    do = "Expose the spheres for less time, or take the intensities from a card with --card"
    raise_problems(
        CaptureError,
        [
            Problem(shot.path.name, what, do)
            for shot, views in zip(shots, seen, strict=True)
            if any(view is not None and view.clipped for view in views)
        ],
    )
    gains = np.array([
        [np.mean([v.irradiance * _to_centre(v.point, lights, row) for v in views if v is not None])]
        for row, views in enumerate(seen)
    ])  # fmt: skip
    return np.asarray(gains / gains.mean())


def _gains_on_card(shots: Sequence[Shot], card: Sequence[int], lights: Lights, rays: Rays) -> Array:
    """Return the same from what photographs show of the card alone, per channel, shape (L, C)."""
    raise_problems(
        CaptureError,
        [
            Problem(shot.path.name, "shows the card clipped", "Expose it for less time")
            for shot in shots
            if shot.clipped.any()
        ],
    )
    left, top, right, bottom = card
    place, _ = rays(np.array([(left + right - 1) / 2]), np.array([(top + bottom - 1) / 2]))
    rows = []
    for row, shot in enumerate(shots):
        towards = lights.position_mm[row] - place[0]
        near = np.isfinite(towards).all()
        cosine = towards[2] / np.linalg.norm(towards) if near else lights.direction[row, 2]
        level = shot.linear().mean(axis=(0, 1), dtype=np.float64)
        rows.append(level * _to_centre(place[0], lights, row) / cosine)
    gains = np.array(rows)
    return np.asarray(gains / gains.mean())


def _to_centre(place: Array, lights: Lights, row: int) -> float:
    """Return a light's irradiance at the painting's centre as a share of that at a place, both facing it."""
    position = lights.position_mm[row]
    if not np.isfinite(position).all():
        return 1.0
    return float(np.sum((position - place) ** 2) / np.sum(position**2))


def _record(found: LightsCalibration) -> dict[str, object]:
    return {
        "spheres": [
            {
                "circle_px": list(sphere.circle),
                "centre": sphere.centre.tolist(),
                "radius": sphere.radius,
                "residual_px": None if np.isnan(sphere.residual_px) else sphere.residual_px,
            }
            for sphere in found.spheres
        ],
        "lights": [
            {
                "name": name,
                "direction": found.lights.direction[row].tolist(),
                "position_mm": _finite(found.lights.position_mm[row]),
                "gain": found.lights.intensity[row].tolist(),
                "disagreement_deg": _finite(found.disagreement_deg[row : row + 1]),
            }
            for row, name in enumerate(found.names)
        ],
        "dropped": list(found.dropped),
        "notes": list(found.notes),
    }


def _finite(values: Array) -> list[float] | None:
    return values.tolist() if np.isfinite(values).all() else None
