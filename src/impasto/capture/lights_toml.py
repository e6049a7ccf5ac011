"""Read TOML manifests: camera, photographs and lights of a capture in one file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from impasto.capture.lights import LightFile, LightRow, place
from impasto.colour import TRANSFER_CHOICES, linearisation_table
from impasto.errors import ImpastoError, Problem
from impasto.geometry import Camera, dome_direction, tilt_direction

_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _View(_Table):
    vector: list[_Finite] | None = Field(None, min_length=3, max_length=3)
    zenith_deg: _Finite | None = None
    azimuth_deg: _Finite | None = None
    theta_deg: _Finite | None = None
    phi_deg: _Finite | None = None


class _Camera(_Table):
    view: _View = _View(vector=[0.0, 0.0, 1.0])
    distance_mm: _Positive | None = None
    mm_per_px: _Positive | None = None

    @field_validator("view", mode="before")
    @classmethod
    def _vector_or_table(cls, value: Any) -> Any:
        return {"vector": value} if isinstance(value, list) else value


class _Noise(_Table):
    read: _NotNegative | None = None
    photon: _NotNegative | None = None
    relative: _NotNegative | None = None


class _Photographs(_Table):
    transfer: str | None = None
    clip_level: _Positive | None = None
    noise: _Noise = _Noise()

    @field_validator("transfer", mode="before")
    @classmethod
    def _known_transfer(cls, value: Any) -> Any:
        if isinstance(value, int | float) and not isinstance(value, bool):
            value = f"gamma:{value:g}"
        try:
            if isinstance(value, str):
                linearisation_table(value, np.uint8)
        except ImpastoError as error:
            raise ValueError(f"{value!r} is not one of linear, srgb or a gamma above 0") from error
        return value


class _Light(_Table):
    file: str
    direction: list[float] | None = None
    arm_angle_deg: float | None = None
    zenith_deg: float | None = None
    azimuth_deg: float | None = None
    position_mm: list[float] | None = None
    gain: list[float] = Field([1.0], min_length=1)
    angular_size_deg: float = float("nan")
    exposure_s: float | None = None

    @field_validator("gain", mode="before")
    @classmethod
    def _one_or_per_channel(cls, value: Any) -> Any:
        return [value] if isinstance(value, int | float) else value


class _Manifest(_Table):
    lights: str | None = None
    camera: _Camera = _Camera()
    photographs: _Photographs = _Photographs()
    light: list[_Light] = []


_TABLES: dict[tuple[str, ...], type[_Table]] = {
    (): _Manifest,
    ("camera",): _Camera,
    ("camera", "view"): _View,
    ("photographs",): _Photographs,
    ("photographs", "noise"): _Noise,
    ("light",): _Light,
}


def read_toml(path: Path, text: str) -> tuple[LightFile, str | None]:
    """Read a TOML manifest; unknown keys are errors.

    Returns
    -------
    file : LightFile
    lights : str or None
        Name of the light file that the manifest refers to instead of listing the lights itself.
    """
    file = LightFile(path)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        file.problems.append(Problem(path.name, f"is not valid TOML: {error}", "Correct the syntax there"))
        return file, None
    try:
        manifest = _Manifest.model_validate(content)
    except ValidationError as error:
        file.problems += [_problem(path, content, dict(detail)) for detail in error.errors()]
        return file, None
    if manifest.lights is not None and manifest.light:
        file.problems.append(
            Problem(path.name, "has both a key lights and tables [[light]]", "Keep one of them")
        )
    if manifest.lights is None and not manifest.light:
        file.problems.append(
            Problem(
                path.name,
                "holds no lights",
                'Add a table [[light]] per photograph, or lights = "<file>.lp" above all tables',
            )
        )
    _take_camera(file, manifest.camera)
    file.transfer = manifest.photographs.transfer
    file.clip_level = manifest.photographs.clip_level
    file.noise = manifest.photographs.noise.model_dump(exclude_none=True)
    for number, light in enumerate(manifest.light, start=1):
        _take_light(file, light, f"{path.name} light {number} ({light.file})")
    return file, manifest.lights


def toml_camera(path: Path, text: str) -> LightFile:
    """Read the table ``[camera]`` of a TOML file, whatever else is in it; see `LightFile.problems`."""
    file = LightFile(path)
    try:
        content = tomllib.loads(text)
        camera = _Manifest.model_validate({"camera": content.get("camera", {})}).camera
    except tomllib.TOMLDecodeError as error:
        file.problems.append(Problem(path.name, f"is not valid TOML: {error}", "Correct the syntax there"))
    except ValidationError as error:
        file.problems += [_problem(path, content, dict(detail)) for detail in error.errors()]
    else:
        _take_camera(file, camera)
    return file


def _take_camera(file: LightFile, camera: _Camera) -> None:
    view = camera.view.model_dump(exclude_none=True)
    where = f"{file.path.name} [camera]"
    if set(view) == {"vector"}:
        direction = np.array(view["vector"])
    elif set(view) == {"zenith_deg", "azimuth_deg"}:
        direction = dome_direction(np.radians(view["zenith_deg"]), np.radians(view["azimuth_deg"]))
    elif set(view) <= {"theta_deg", "phi_deg"} and view:
        direction = tilt_direction(
            np.radians(view.get("theta_deg", 0.0)), np.radians(view.get("phi_deg", 0.0))
        )
    else:
        file.problems.append(
            Problem(
                where,
                f"view gives {', '.join(view) or 'nothing'}, expected one of: three numbers; zenith_deg and "
                "azimuth_deg; theta_deg and phi_deg",
                "Write for example view = { zenith_deg = 5, azimuth_deg = 90 }",
            )
        )
        return
    length = float(np.linalg.norm(direction))
    if not direction[2] > 1e-6 * length:
        file.problems.append(
            Problem(
                where, "view points below the surface; z must be > 0", "Check the frame in docs/notation.md"
            )
        )
        return
    file.camera = Camera(direction / length, camera.distance_mm, camera.mm_per_px)


def _take_light(file: LightFile, light: _Light, where: str) -> None:
    try:
        direction, position = place(
            direction=light.direction,
            arm_angle_deg=light.arm_angle_deg,
            zenith_deg=light.zenith_deg,
            azimuth_deg=light.azimuth_deg,
            position_mm=light.position_mm,
        )
    except ValueError as error:
        file.problems.append(Problem(where, str(error), "Correct this light"))
        return
    file.rows.append(
        LightRow(
            where,
            light.file,
            direction,
            position,
            tuple(light.gain),
            light.angular_size_deg,
            light.exposure_s,
        )
    )


def _problem(path: Path, content: dict[str, Any], detail: dict[str, Any]) -> Problem:
    """Return one complaint of pydantic in the words of the manifest."""
    location = detail["loc"]
    tables = tuple(part for part in location[:-1] if isinstance(part, str))
    where = path.name
    if location[0] == "light" and len(location) > 1:
        number = location[1]
        entry = content["light"][number] if isinstance(number, int) else {}
        named = (
            f" ({entry['file']})" if isinstance(entry, dict) and isinstance(entry.get("file"), str) else ""
        )
        where += f" light {number + 1}{named}"
    elif tables:
        where += f" [{'.'.join(tables)}]"
    key = next((part for part in reversed(location) if isinstance(part, str)), "")
    if detail["type"] == "extra_forbidden":
        allowed = ", ".join(_TABLES[tables].model_fields)
        return Problem(where, f"unknown key {key}", f"Allowed here: {allowed}")
    if detail["type"] == "missing":
        return Problem(where, f"key {key} is missing", f"Add {key} = …")
    do = f"Use {TRANSFER_CHOICES}" if key == "transfer" else f"Correct {key}"
    message = detail["msg"].removeprefix("Value error, ")
    return Problem(where, f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}", do)
