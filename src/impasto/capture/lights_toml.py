"""Read TOML manifests: camera, photographs and lights of a capture in one file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError, field_validator

from impasto.capture.lights import LightFile, LightRow, place
from impasto.capture.toml_tables import CameraTable, PhotographsTable, Table, camera_of, table_problems
from impasto.errors import CaptureError, Problem


class _Photographs(PhotographsTable):
    brackets: list[str] = Field(default_factory=list)


class LampTable(Table):
    """Where a lamp stands, in one of four ways, and how strong it is."""

    direction: list[float] | None = None
    arm_angle_deg: float | None = None
    zenith_deg: float | None = None
    azimuth_deg: float | None = None
    position_mm: list[float] | None = None
    gain: list[float] = Field([1.0], min_length=1)
    angular_size_deg: float = float("nan")

    @field_validator("gain", mode="before")
    @classmethod
    def _one_or_per_channel(cls, value: Any) -> Any:
        return [value] if isinstance(value, int | float) else value

    def row(self, where: str, file: str, exposure_s: float | None = None) -> LightRow:
        """Return the lamp as the light of a photograph.

        Raises
        ------
        ValueError
            If its place is given in no way or in several.
        """
        direction, position = place(
            direction=self.direction,
            arm_angle_deg=self.arm_angle_deg,
            zenith_deg=self.zenith_deg,
            azimuth_deg=self.azimuth_deg,
            position_mm=self.position_mm,
        )
        return LightRow(where, file, direction, position, tuple(self.gain), self.angular_size_deg, exposure_s)


class _Light(LampTable):
    file: str
    exposure_s: float | None = None


class _Manifest(Table):
    lights: str | None = None
    camera: CameraTable = CameraTable()
    photographs: _Photographs = _Photographs()
    light: list[_Light] = Field(default_factory=list)


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
        file.problems += table_problems(path.name, content, _Manifest, error)
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
    file.brackets = tuple(manifest.photographs.brackets)
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
        file.problems += table_problems(path.name, content, _Manifest, error)
    else:
        _take_camera(file, camera)
    return file


def _take_camera(file: LightFile, table: CameraTable) -> None:
    try:
        file.camera = camera_of(table, f"{file.path.name} [camera]")
    except CaptureError as error:
        file.problems += error.problems


def _take_light(file: LightFile, light: _Light, where: str) -> None:
    try:
        file.rows.append(light.row(where, light.file, light.exposure_s))
    except ValueError as error:
        file.problems.append(Problem(where, str(error), "Correct this light"))
