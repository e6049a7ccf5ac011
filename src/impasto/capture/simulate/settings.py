"""What a simulation is asked for: checked as a whole before anything is made."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.capture.simulate.files import ENDINGS
from impasto.capture.simulate.materials import SHAPES
from impasto.capture.simulate.presets import PRESETS, SAMPLES
from impasto.errors import Problem
from impasto.geometry import Lights
from impasto.images import Compression

SIZE_LIMITS = (16, 32768)
_COMPRESSIONS = ("zstd", "deflate", "lzw", "none")
_RESPONSES = ("linear", "srgb", "tone")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The options of `simulate`, which documents them."""

    sample: str | None = None
    preset: str | None = None
    arm: bool = False
    dome: bool = False
    lights: int | Lights | NDArray[np.float64] | None = None
    size: tuple[int, int] = (512, 512)
    seed: int = 0
    brackets: int = 0
    model: str | None = None
    measured: str | Path | None = None
    index: float = 1.5
    relief_scale: float = 1.0
    cast_shadows: bool = True
    mm_per_px: float | None = None
    view_tilt_deg: float | None = None
    camera_distance_mm: float | None = None
    light_distance_mm: float | None = None
    angular_size_deg: float = 0.0
    gain_spread: float = 0.0
    exposure: float = 0.25
    noise: bool | tuple[float, float] = True
    response: str | None = None
    vignetting: float = 0.0
    format: str = "tiff"
    bits: int | None = None
    compression: Compression = "zstd"
    calibration: bool = True

    @property
    def painting(self) -> str:
        """What is painted: ``sample a`` … ``sample h``, or a preset's name."""
        return f"sample {self.sample}" if self.sample else self.preset or "still-life"

    @property
    def on_arm(self) -> bool:
        """Whether the lights stand on an arm: asked for, or by default for the paper's samples."""
        return self.arm or (not self.dome and self.lights_are_counted and self.sample is not None)

    @property
    def lights_are_counted(self) -> bool:
        """Whether the lights are a number of them, to be placed, rather than given."""
        return self.lights is None or isinstance(self.lights, int)

    @property
    def interface_model(self) -> str:
        """The specular model; the samples' interfaces are smooth GGX ones unless another is asked for."""
        return self.model or ("torrance-sparrow-smith" if self.sample else "torrance-sparrow")

    @property
    def pixel_mm(self) -> float:
        """Size of a pixel on the painting; its short side measures 100 mm by default."""
        return 100.0 / min(self.size) if self.mm_per_px is None else float(self.mm_per_px)

    @property
    def dtype(self) -> str:
        """Type of the stored values."""
        if self.format == "exr":
            return "float32"
        return "uint8" if self.format == "jpeg" or self.bits == 8 else "uint16"

    @property
    def sensor_response(self) -> str:
        """The camera's response: sRGB for 8-bit files and linear for others unless asked for."""
        return self.response or ("srgb" if self.dtype == "uint8" else "linear")

    def as_json(self) -> dict[str, Any]:
        """Return the settings as data for JSON."""
        return {field.name: _plain(getattr(self, field.name)) for field in fields(self)}

    def problems(self) -> Iterator[Problem]:
        """Yield everything that is wrong with the settings."""
        yield from self._painting_problems()
        yield from self._light_problems()
        yield from self._number_problems()
        yield from self._file_problems()

    def _painting_problems(self) -> Iterator[Problem]:
        if self.sample is not None and self.sample not in SAMPLES:
            yield Problem(
                "sample", f"{self.sample!r} is none of the paper's", f"Choose one of {', '.join(SAMPLES)}"
            )
        if self.preset is not None and self.preset not in PRESETS:
            yield Problem("preset", f"{self.preset!r} does not exist", f"Choose one of {', '.join(PRESETS)}")
        if self.sample is not None and self.preset is not None:
            yield Problem(
                "sample and preset", "were both given, expected one painting", "Leave one of them out"
            )
        if self.model is not None and self.model not in (*SHAPES, "mixed"):
            yield Problem(
                "model", f"{self.model!r} does not exist", f"Choose one of {', '.join((*SHAPES, 'mixed'))}"
            )
        low, high = SIZE_LIMITS
        if len(self.size) != 2 or not all(
            isinstance(side, int) and low <= side <= high for side in self.size
        ):
            yield Problem(
                "size",
                f"{self.size} is not two whole numbers from {low} to {high}",
                "Give width and height in pixels",
            )
        if self.measured is not None and not Path(self.measured).is_file():
            yield Problem(
                "measured",
                f"{self.measured} does not exist",
                "Give the path of an .npz of measured materials",
            )

    def _light_problems(self) -> Iterator[Problem]:
        if self.arm and self.dome:
            yield Problem("arm and dome", "were both asked for, expected one", "Leave one of them out")
        if not self.lights_are_counted and (self.arm or self.dome):
            yield Problem("lights", "are given and also placed by arm or dome", "Leave one of them out")
        if isinstance(self.lights, int):
            if isinstance(self.lights, bool) or not 1 <= self.lights <= 10000:
                yield Problem("lights", f"{self.lights} is not from 1 to 10000", "Give the number of lights")
        elif self.lights is not None:
            yield from _given_light_problems(self.lights)

    def _number_problems(self) -> Iterator[Problem]:
        yield from self._outside("seed", self.seed, 0, 2**63 - 1, "Give a whole number")
        yield from self._outside("brackets", self.brackets, 0, 8, "Give the number of shorter exposures")
        for name, low, high, do in (
            ("index", 1.01, 4.0, "Give an index of refraction, 1.5 for varnish"),
            ("relief_scale", 0.0, 10.0, "1 is the painting's own relief, 0 a flat one"),
            ("mm_per_px", 1e-4, 100.0, "Give the size of a pixel on the painting in mm"),
            ("view_tilt_deg", -45.0, 45.0, "Give the camera's tilt out of the arm's plane in degrees"),
            ("camera_distance_mm", 10.0, math.inf, "Leave it out for a camera without perspective"),
            ("light_distance_mm", 10.0, math.inf, "Leave it out for distant lights"),
            ("angular_size_deg", 0.0, 30.0, "Give the lamps' angular diameter in degrees"),
            ("gain_spread", 0.0, 1.0, "0.05 makes lamps differ by about 5 %"),
            ("exposure", 1e-4, 1.0, "Give the image value of white as a share of full scale"),
            ("vignetting", 0.0, 0.9, "Give the share of light lost in the corners"),
        ):
            value = getattr(self, name)
            if value is not None:
                yield from self._outside(name, value, low, high, do)
        if not isinstance(self.noise, bool) and (
            len(self.noise) != 2 or not all(0 <= part < 1 for part in self.noise)
        ):
            yield Problem(
                "noise", f"{self.noise} is not two shares from 0 to 1", "Give read and photon noise, or False"
            )

    def _outside(self, name: str, value: float, low: float, high: float, do: str) -> Iterator[Problem]:
        whole = name in ("seed", "brackets")
        if isinstance(value, bool) or (whole and not isinstance(value, int)) or not low <= value <= high:
            span = f"from {low:g} to {high:g}" if math.isfinite(high) else f"at least {low:g}"
            yield Problem(name, f"{value} is not {'a whole number ' * whole}{span}", do)

    def _file_problems(self) -> Iterator[Problem]:
        if self.format not in ENDINGS:
            yield Problem("format", f"{self.format!r} is not written", f"Choose one of {', '.join(ENDINGS)}")
        depths = {"tiff": (8, 16), "png": (8, 16), "jpeg": (8,), "exr": (32,), "dng": (16,)}.get(
            self.format, ()
        )
        if self.bits is not None and depths and self.bits not in depths:
            wanted = " or ".join(str(depth) for depth in depths)
            yield Problem(
                "bits", f"{self.bits} does not go with {self.format}, expected {wanted}", "Leave it out"
            )
        if self.compression not in _COMPRESSIONS:
            yield Problem(
                "compression",
                f"{self.compression!r} is not known",
                f"Choose one of {', '.join(_COMPRESSIONS)}",
            )
        if self.response is not None and not _is_response(self.response):
            yield Problem(
                "response", f"{self.response!r} is not known", "Choose linear, srgb, gamma:<number> or tone"
            )
        elif self.format in ("exr", "dng") and self.response not in (None, "linear"):
            yield Problem(
                "response",
                f"{self.response!r} does not go with {self.format}, which is linear",
                "Leave it out",
            )
        if self.format == "exr" and self.brackets:
            yield Problem("brackets", "do not go with exr, which never clips", "Leave them out")


def _is_response(response: str) -> bool:
    if response in _RESPONSES:
        return True
    try:
        return response.startswith("gamma:") and 0.1 <= float(response.removeprefix("gamma:")) <= 10
    except ValueError:
        return False


def _given_light_problems(lights: Lights | NDArray[np.float64]) -> Iterator[Problem]:
    direction = lights.direction if isinstance(lights, Lights) else np.asarray(lights)
    if direction.ndim != 2 or direction.shape[1] != 3 or not len(direction):
        yield Problem(
            "lights", f"have shape {direction.shape}, expected (L, 3)", "Give one vector towards each light"
        )
        return
    if isinstance(lights, Lights):
        yield from _name_problems(lights.names)
        near = np.isfinite(lights.position_mm).all(axis=1, keepdims=True)
        direction = np.where(near, lights.position_mm, direction)
    for row, vector in enumerate(direction):
        length = np.linalg.norm(vector)
        if not np.isfinite(length) or length == 0 or vector[2] <= 1e-6 * length:
            text = ", ".join(f"{part:.3g}" for part in vector)
            yield Problem(
                f"light {row}",
                f"({text}) does not lie above the surface; z must be > 0",
                "Flip the sign or check the frame in docs/notation.md",
            )


def _name_problems(names: tuple[str, ...]) -> Iterator[Problem]:
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield Problem(f"light {name}", f"is there {names.count(name)} times", "Give each light its own name")
    for name in names:
        if not name or "/" in name or name.startswith("."):
            yield Problem(f"light {name!r}", "cannot name a photograph", "Use a plain name without slashes")


def _plain(value: Any) -> Any:
    """Return a setting as JSON's types."""
    if isinstance(value, Lights):
        return {
            "names": list(value.names),
            "direction": value.direction.tolist(),
            "position_mm": [row.tolist() if np.isfinite(row).all() else None for row in value.position_mm],
            "intensity": value.intensity.tolist(),
        }
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return list(value)
    return str(value) if isinstance(value, Path) else value
