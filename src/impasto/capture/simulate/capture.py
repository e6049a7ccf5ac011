"""Simulate the capture of a painting: photographs, lights, calibration shots and the truth beside them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate import lamps
from impasto.capture.simulate.calibration import Studio, write_calibration
from impasto.capture.simulate.camera import EXPOSURE_S, Sensor
from impasto.capture.simulate.files import ENDINGS, write_image
from impasto.capture.simulate.illumination import Scene
from impasto.capture.simulate.manifest import simulated_manifest
from impasto.capture.simulate.measured import read_measured
from impasto.capture.simulate.painting.relief import Grid
from impasto.capture.simulate.presets import PRESETS, SAMPLES, Order, paint_sample
from impasto.capture.simulate.settings import Settings
from impasto.capture.simulate.truth import write_truth
from impasto.errors import OptionError, Problem, raise_problems
from impasto.geometry import Camera, Lights, tilt_direction
from impasto.images import Compression
from impasto.output import prepare_folder, remove_partial, write_json, write_text
from impasto.progress import progress

MANIFEST = "capture.toml"
_STARTED = "truth/settings.json"
BRACKET_STEP_EV = 2
_TILT_OF_ARM_DEG = 5.0


@dataclass(frozen=True)
class Simulation:
    """What `simulate` made.

    Parameters
    ----------
    folder : Path
    painting : str
        The preset's name, or ``sample a`` …
    size : tuple of int
        Width and height in pixels.
    photographs : int
        Photographs in the folder itself, one per light.
    brackets : int
        Further exposures of each.
    clipped_share : float
        Share of the samples at full scale, over the photographs taken in this run; NaN if all were there.
    shadowed_share : float
        Share of pixels that see less than half of the light past the relief, over the same photographs.
    files : int
        Files in the folder and those below it.
    """

    folder: Path
    painting: str
    size: tuple[int, int]
    photographs: int
    brackets: int
    clipped_share: float
    shadowed_share: float
    files: int

    def as_json(self) -> dict[str, Any]:
        """Return the summary as data for JSON."""
        content = asdict(self) | {"folder": str(self.folder)}
        return {key: None if value != value else value for key, value in content.items()}


def simulate(
    out: str | PathLike[str],
    *,
    sample: str | None = None,
    preset: str | None = None,
    arm: bool = False,
    dome: bool = False,
    lights: int | Lights | NDArray[np.float64] | None = None,
    size: tuple[int, int] = (512, 512),
    seed: int = 0,
    brackets: int = 0,
    model: str | None = None,
    measured: str | PathLike[str] | None = None,
    index: float = 1.5,
    relief_scale: float = 1.0,
    cast_shadows: bool = True,
    mm_per_px: float | None = None,
    view_tilt_deg: float | None = None,
    camera_distance_mm: float | None = None,
    light_distance_mm: float | None = None,
    angular_size_deg: float = 0.0,
    gain_spread: float = 0.0,
    exposure: float = 0.25,
    noise: bool | tuple[float, float] = True,
    response: str | None = None,
    vignetting: float = 0.0,
    format: str = "tiff",
    bits: int | None = None,
    compression: Compression = "zstd",
    calibration: bool = True,
    show_progress: bool | None = None,
) -> Simulation:
    """Simulate the capture of a painting.

    Parameters
    ----------
    out : path
        Folder to make. A run that was interrupted is taken up where it stopped if the options are the same.
    sample : {'a', ..., 'h'}, optional
        One of the paper's eight samples.
    preset : {'still-life', 'swatches'}, optional
        Another painting; the still life is the default.
    arm, dome : bool
        Lights on an arm in the XZ plane, from -72° to 72°, or spread over a dome. By default an arm for the
        samples and a dome for the presets.
    lights : int, Lights or ndarray of shape (L, 3), optional
        Number of lights on the arm (37 by default) or in the dome (48), or the lights themselves.
    size : tuple of int
        Width and height in pixels.
    seed : int
        Decides the painting's every stroke, the lamps' intensities and the noise.
    brackets : int
        Number of further exposures, each two stops shorter than the last, in subfolders of ``brackets`` that
        are captures by themselves.
    model : str, optional
        Model of the specular reflection: ``lambert``, ``phong``, ``torrance-sparrow`` (the presets' default),
        ``torrance-sparrow-gaussian``, ``torrance-sparrow-smith`` (the samples' default), or ``mixed``, which
        gives the paints different ones in turn.
    measured : path, optional
        File of measured materials, which then take the place of the paints' own reflectance.
    index : float
        Index of refraction.
    relief_scale : float
        Factor on the relief's heights.
    cast_shadows : bool
        Whether the relief casts shadows.
    mm_per_px : float, optional
        Size of a pixel on the painting; by default its short side measures 100 mm. Slopes stay the same.
    view_tilt_deg : float, optional
        The camera's tilt out of the arm's plane, towards +Y; by default 5° with an arm and 0° otherwise.
    camera_distance_mm : float, optional
        Distance of the camera; no perspective without it.
    light_distance_mm : float, optional
        Distance of lights that have no position of their own; infinitely far without it.
    angular_size_deg : float
        Angular diameter of the lamps: widens highlights and softens shadows.
    gain_spread : float
        Standard deviation of the lamps' relative intensities, which the manifest states as they are.
    exposure : float
        Image value, as a share of full scale, of a perfect white diffuser that faces a light.
    noise : bool or tuple of float
        Whether the sensor is noisy, or its read and photon noise in shares of full scale: variance = read² +
        photon · signal.
    response : str, optional
        ``linear``, ``srgb``, ``gamma:<number>``, or ``tone``, a curve per channel that has to be measured. By
        default sRGB for files of 8 bits and linear for others.
    vignetting : float
        Share of light lost in the image's corners.
    format : {'tiff', 'png', 'jpeg', 'exr', 'dng'}
        Of the photographs. EXR stands for merged exposures: floats that never clip.
    bits : int, optional
        8 or 16 per value for TIFF and PNG, 16 by default.
    compression : {'zstd', 'deflate', 'lzw', 'none'}
        Of TIFF files.
    calibration : bool
        Whether calibration shots are taken.
    show_progress : bool, optional
        Whether to show a progress bar; by default, if standard error is a terminal.

    Returns
    -------
    Simulation

    Raises
    ------
    OptionError
        With everything that is wrong with the options, before anything is written.
    OutputError
        If a file cannot be written.

    Notes
    -----
    Radiance is relative: 1 is a perfect white diffuser that a light of intensity 1 meets along its normal.
    Direct light only: there are no reflections from stroke to stroke, and relief causes no parallax.
    """
    options = {key: value for key, value in locals().items() if key not in ("out", "show_progress")}
    if isinstance(options["measured"], PathLike):
        options["measured"] = Path(options["measured"])
    settings = Settings(**options)
    folder = Path(out)
    raise_problems(OptionError, [*settings.problems(), *_folder_problems(folder, settings)])
    scene, placed = set_up(settings)
    _start(folder, settings)
    sensor = make_sensor(settings)
    ending = ENDINGS[settings.format]
    files = [name + ending for name in placed.names]
    exposures = _exposures(folder, settings)
    clipped, shadowed = [], []
    with progress("Simulating photographs", len(files), show=show_progress) as advance:
        for light, file in enumerate(files):
            missing = [(ev, place / file) for ev, place in exposures if not (place / file).exists()]
            if missing:
                visible = scene.visible(placed, light)
                shadowed.append(float(np.mean(visible < 0.5)))
                radiance = scene.radiance(placed, light, visible)
            for ev, path in missing:
                image = sensor.expose(radiance, np.random.default_rng((seed, 1, light, -ev)), ev)
                if ev == 0:
                    clipped.append(float(np.mean(image >= sensor.full_scale)))
                write_image(path, image, compression, exposure_s=EXPOSURE_S * 2.0**ev)
            advance(1)
    if calibration:
        studio = Studio(placed, scene.camera, sensor, (size[1], size[0]), ending, compression, seed)
        write_calibration(folder / "calibration", studio)
    write_truth(folder / "truth", scene, placed, files, _description(settings))
    # The manifest of the folder itself comes last: it says that all is there.
    for ev, place in reversed(exposures):
        exposure_s = EXPOSURE_S * 2.0**ev
        text = simulated_manifest(files, placed, scene.camera, sensor, ev=ev, exposure_s=exposure_s)
        write_text(place / MANIFEST, text)
    return Simulation(
        folder=folder,
        painting=settings.painting,
        size=settings.size,
        photographs=len(files),
        brackets=settings.brackets,
        clipped_share=float(np.mean(clipped)) if clipped else float("nan"),
        shadowed_share=float(np.mean(shadowed)) if shadowed else float("nan"),
        files=sum(path.is_file() for path in folder.rglob("*")),
    )


def set_up(settings: Settings) -> tuple[Scene, Lights]:
    """Return the painting before the camera, and the lights, for settings without problems."""
    width, height = settings.size
    measured = None if settings.measured is None else read_measured(settings.measured)
    order = Order(
        Grid(height, width),
        settings.seed,
        settings.interface_model,
        measured,
        settings.pixel_mm,
        settings.relief_scale,
    )
    painted = (
        paint_sample(order, SAMPLES[settings.sample])
        if settings.sample
        else PRESETS[settings.painting](order)
    )
    tilt_deg = settings.view_tilt_deg
    if tilt_deg is None:
        tilt_deg = _TILT_OF_ARM_DEG if settings.on_arm else 0.0
    view_direction = tilt_direction(0.0, np.radians(tilt_deg))
    camera = Camera(view_direction, settings.camera_distance_mm, settings.pixel_mm)
    return Scene(painted, camera, measured, settings.index, settings.cast_shadows), _lights(settings)


def make_sensor(settings: Settings) -> Sensor:
    """Return the camera's sensor as the settings have it."""
    read, photon = (Sensor.read, Sensor.photon) if isinstance(settings.noise, bool) else settings.noise
    return Sensor(
        settings.exposure, read, photon, bool(settings.noise), settings.sensor_response, settings.dtype,
        settings.vignetting,
    )  # fmt: skip


def _lights(settings: Settings) -> Lights:
    if settings.lights is None or isinstance(settings.lights, int):
        place, usual = (
            (lamps.arm_lights, lamps.ARM_COUNT) if settings.on_arm else (lamps.dome_lights, lamps.DOME_COUNT)
        )
        lights = place(settings.lights or usual)
    else:
        lights = (
            settings.lights
            if isinstance(settings.lights, Lights)
            else lamps.named(np.asarray(settings.lights))
        )
    return lamps.set_up(
        lights,
        distance_mm=settings.light_distance_mm,
        gain_spread=settings.gain_spread,
        angular_size_deg=settings.angular_size_deg,
        seed=settings.seed,
    )


def _exposures(folder: Path, settings: Settings) -> list[tuple[int, Path]]:
    """Return each exposure in stops and the folder of its photographs, the full exposure first."""
    steps = [-BRACKET_STEP_EV * (number + 1) for number in range(settings.brackets)]
    return [(0, folder), *((ev, folder / "brackets" / f"ev{ev}") for ev in steps)]


def _folder_problems(folder: Path, settings: Settings) -> list[Problem]:
    """Return what is wrong with the folder: anything in it but an interrupted run with the same settings."""
    if not folder.exists():
        return []
    if not folder.is_dir():
        return [Problem(str(folder), "is a file, expected a folder to make", "Give another name")]
    if not any(folder.iterdir()):
        return []
    try:
        started = json.loads((folder / _STARTED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return [Problem(str(folder), "is not empty, expected a new folder", "Give another name, or empty it")]
    if (folder / MANIFEST).exists():
        return [Problem(str(folder), "holds a finished simulation", "Give another name, or remove it")]
    if started.get("fingerprint") != _fingerprint(settings):
        what = "holds an interrupted simulation with other options, or by another version"
        return [Problem(str(folder), what, "Give the same options to go on, another name, or remove it")]
    return []


def _start(folder: Path, settings: Settings) -> None:
    """Make the folder and note what it is for, so that an interrupted run can be taken up."""
    prepare_folder((folder / _STARTED).parent)
    remove_partial(folder)
    write_json(folder / _STARTED, {"fingerprint": _fingerprint(settings), **_description(settings)})


def _description(settings: Settings) -> dict[str, Any]:
    program = f"impasto {version('impasto')}"
    return {"program": program, "painting": settings.painting, "settings": settings.as_json()}


def _fingerprint(settings: Settings) -> str:
    """Return a hash that runs share which would write the same files."""
    return hashlib.sha256(json.dumps(_description(settings), sort_keys=True).encode()).hexdigest()
