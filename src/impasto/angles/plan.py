"""Before a capture: what given lights would tell, and where to put lights."""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.angles.expected import expect
from impasto.angles.files import write_lights
from impasto.angles.identifiability import Identifiability, identify
from impasto.angles.photographed import camera_for
from impasto.angles.picture import draw_plan
from impasto.angles.placement import even_lights
from impasto.angles.search import greedy_exchange
from impasto.angles.study import least_lights
from impasto.angles.surfaces import (
    USUAL_GLOSS,
    USUAL_NOISE,
    USUAL_RELIEF_DEG,
    Surface,
    assumed_surface,
    fitted_surface,
    has_fit,
)
from impasto.errors import OptionError, Problem, raise_problems
from impasto.fit import FitOptions, fit_tile
from impasto.fit.information import noise_variance
from impasto.geometry import Array, Camera, Lights, arm_direction, dome_direction, tilt_direction
from impasto.output import prepare_folder
from impasto.pixels import Pixels, luminance, pixels_of_maps, render_pixels
from impasto.render.lights import requested_lights
from impasto.store import open_stack

ARM_REACH_DEG, ARM_STEP_DEG = 76.0, 2.0
ARM_VIEW_DEG = 5.0
DOME_ZENITH_DEG = (10.0, 76.0)
_DOME_PLACES = 180
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5.0))
_MOST = 120


@dataclass(frozen=True)
class CheckSummary:
    """What lights tell.

    Parameters
    ----------
    source : Path
        The store or the light file.
    lights : int
    surface : str
        What it was checked for, in words.
    identifiability : Identifiability
    """

    source: Path
    lights: int
    surface: str
    identifiability: Identifiability


@dataclass(frozen=True)
class PlanSummary:
    """Where to put lights.

    Parameters
    ----------
    kind : str
        ``arm`` or ``dome``.
    surface : str
        What it is planned for, in words.
    lights : tuple of str
    direction : ndarray of shape (L, 3)
    expected_rms, even_expected_rms : float
        Expected RMS of renderings over their mean, under all places of the arm or dome, from noise alone, and
        the same for lights spread evenly.
    simulated_rms, even_simulated_rms : float
        What fits to simulated photographs of the surface come to.
    identifiability : Identifiability
    files : tuple of Path
    """

    kind: str
    surface: str
    lights: tuple[str, ...]
    direction: Array
    expected_rms: float
    even_expected_rms: float
    simulated_rms: float
    even_simulated_rms: float
    identifiability: Identifiability
    files: tuple[Path, ...]


def check(
    source: str | PathLike[str],
    *,
    model: str = "torrance-sparrow",
    gloss: tuple[float, float] | None = None,
    relief_deg: float | None = None,
) -> CheckSummary:
    """Say what the lights of a store or of a light file tell of a surface.

    Parameters
    ----------
    source : path
        A store, or a light file, with the camera along the painting's normal.
    model : str, optional
        Whose fit in the store tells the surface.
    gloss : tuple of float, optional
        Range of gloss units at 60° to assume instead, as where there is no fit.
    relief_deg : float, optional
        Tilt that 95 % of the normals stay below.

    Raises
    ------
    OptionError
        If an option cannot be used.
    CaptureError
        If a light file cannot be read.
    StoreError
        If the store cannot be read.
    """
    path = Path(source)
    noise = USUAL_NOISE
    camera = Camera()
    if path.is_dir() or not path.exists():
        stack = open_stack(path)
        lights, camera, noise = stack.lights, stack.camera, stack.noise
        fitted = gloss is None and relief_deg is None and has_fit(path, model)
        surface = fitted_surface(path, model) if fitted else _assumed(gloss, relief_deg)
        if not fitted:
            # Assumed pixels have no place on the painting: lights count by their direction.
            lights = Lights(lights.names, lights.direction)
            camera = replace(camera, distance_mm=None)
    else:
        lights = requested_lights(path, (), (), 3, Camera(mm_per_px=1.0))
        lights = Lights(lights.names, lights.direction)
        surface = _assumed(gloss, relief_deg)
    raise_problems(OptionError, _few(f"{path}", len(lights), surface.pixels))
    return CheckSummary(
        path, len(lights), surface.description, identify(surface.pixels, lights, camera, noise)
    )


def plan(
    kind: str,
    lights: int,
    *,
    store: str | PathLike[str] | None = None,
    model: str = "torrance-sparrow",
    gloss: tuple[float, float] | None = None,
    relief_deg: float | None = None,
    out: str | PathLike[str],
) -> PlanSummary:
    """Choose where to put lights before a capture, for the least expected error of renderings.

    Parameters
    ----------
    kind : str
        ``arm``, a plane along X with the camera 5° out of it, or ``dome``, with the camera on the normal.
    lights : int
        How many.
    store : path, optional
        Store with an earlier fit of a like painting, to plan for what was measured there.
    model : str, optional
        Of that fit.
    gloss, relief_deg : optional
        Kind of surface, without a store; see `assumed_surface`.
    out : path
        Folder for ``plan.lp``, ``plan.csv`` and ``plan.png``.

    Raises
    ------
    OptionError
        If an option cannot be used.
    StoreError
        If the store has no such fit.
    OutputError
        If the files cannot be written.
    """
    problems = []
    if kind not in ("arm", "dome"):
        problems.append(Problem("--plan", f"there is no {kind!r}", "Choose arm or dome"))
    if store is not None and (gloss is not None or relief_deg is not None):
        problems.append(
            Problem(
                "--gloss and --relief",
                "assume a surface, and a store tells one; expected one of both",
                "Leave out STORE, or these options",
            )
        )
    if lights > _MOST:
        problems.append(Problem("--lights", f"is {lights}, expected {_MOST} at most", "Ask for fewer"))
    raise_problems(OptionError, problems)
    surface = fitted_surface(Path(store), model) if store is not None else _assumed(gloss, relief_deg)
    places = _places(kind)
    problems = _few(f"--lights {lights}", lights, surface.pixels)
    if lights > len(places):
        problems.append(
            Problem(
                f"--lights {lights}", f"is more than the {len(places)} places on the arm", "Ask for fewer"
            )
        )
    raise_problems(OptionError, problems)
    view = tilt_direction(0.0, np.radians(ARM_VIEW_DEG)) if kind == "arm" else np.array([0.0, 0.0, 1.0])
    camera = Camera(view)
    clip = np.full(surface.pixels.diffuse.shape[1], np.inf)
    expected = expect(surface.pixels, places, camera_for(places, camera), USUAL_NOISE, clip)
    # Fits may go astray from lights that are all near the highlights: the outermost lead them back.
    low = even_lights(places.direction, 2)
    plans = {
        greedy_exchange(expected.criterion, lights),
        tuple(sorted({*greedy_exchange(expected.criterion, lights - 2), *low})),
    }
    chosen = min(
        sorted(each for each in plans if len(each) == lights),
        key=lambda each: _simulated_rms(surface.pixels, places, each, camera),
    )
    even = even_lights(places.direction, lights)
    names = tuple(f"light-{number:03d}" for number in range(1, lights + 1))
    found = Lights(names, places.direction[_in_order(places, chosen, kind)])
    folder = prepare_folder(out)
    picture = folder / "plan.png"
    draw_plan(picture, found, f"{lights} lights for {surface.description}")
    return PlanSummary(
        kind=kind,
        surface=surface.description,
        lights=names,
        direction=found.direction,
        expected_rms=expected.rms(chosen),
        even_expected_rms=expected.rms(even),
        simulated_rms=_simulated_rms(surface.pixels, places, chosen, camera),
        even_simulated_rms=_simulated_rms(surface.pixels, places, even, camera),
        identifiability=identify(surface.pixels, found, camera, USUAL_NOISE),
        files=(*write_lights(folder / "plan", found), picture),
    )


def _simulated_rms(pixels: Pixels, places: Lights, chosen: tuple[int, ...], camera: Camera) -> float:
    """Return the RMS under all places of fits to simulated, noisy photographs from the chosen ones."""
    clean = render_pixels(pixels, places, camera).astype(np.float64)
    deviation = np.sqrt(noise_variance(clean, USUAL_NOISE))
    noisy = clean + deviation * np.random.default_rng(0).standard_normal(clean.shape)
    camera = camera_for(places, camera)
    attributes = pixels.attributes
    maps = fit_tile(
        pixels.model,
        noisy[list(chosen)].astype(np.float32),
        lights=places.select(np.array(chosen)),
        camera=camera,
        light_rgb=pixels.light_rgb,
        clip_level=np.full(clean.shape[-1], np.inf),
        noise=USUAL_NOISE,
        options=FitOptions(index=attributes["index_of_refraction"], fresnel=attributes["fresnel"]),
    )
    found = pixels_of_maps(attributes, pixels.size, pixels.row, pixels.column, maps)
    rendered = np.nan_to_num(render_pixels(found, places, camera))
    truth = luminance(clean)
    return float(np.sqrt(np.mean((luminance(rendered) - truth) ** 2)) / truth.mean())


def _assumed(gloss: tuple[float, float] | None, relief_deg: float | None) -> Surface:
    return assumed_surface(gloss or USUAL_GLOSS, USUAL_RELIEF_DEG if relief_deg is None else relief_deg)


def _few(where: str, lights: int, pixels: Pixels) -> list[Problem]:
    least = least_lights(pixels.model)
    if lights >= least:
        return []
    what = f"has {lights} lights, and a fit of {pixels.model.name} needs {least}"
    return [Problem(where, what, "Plan for more photographs")]


def _places(kind: str) -> Lights:
    """Return every place that a light may take: an arm every 2°, or a dome in steps of some 9°."""
    if kind == "arm":
        angle = np.radians(np.arange(-ARM_REACH_DEG, ARM_REACH_DEG + 1e-9, ARM_STEP_DEG))
        direction = arm_direction(angle)
    else:
        top, bottom = np.cos(np.radians(DOME_ZENITH_DEG))
        number = np.arange(_DOME_PLACES)
        z = top + (bottom - top) * (number + 0.5) / _DOME_PLACES
        direction = dome_direction(np.arccos(z), _GOLDEN_ANGLE * number)
    return Lights(tuple(map(str, range(len(direction)))), direction)


def _in_order(places: Lights, chosen: tuple[int, ...], kind: str) -> list[int]:
    """Return places in the order in which one would light them: along the arm, or ring by ring."""
    x, y, z = places.direction[list(chosen)].T
    rank = np.argsort(x) if kind == "arm" else np.lexsort((np.arctan2(y, x), np.round(np.arccos(z), 1)))
    return [chosen[each] for each in rank]
