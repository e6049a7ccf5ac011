"""Tables that TOML files of a capture share, and what is wrong with them in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from impasto.colour import TRANSFER_CHOICES, linearisation_table
from impasto.errors import CaptureError, ImpastoError, Problem
from impasto.geometry import Camera, dome_direction, tilt_direction

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Table(BaseModel):
    """A table of which unknown keys are errors, and in which numbers are no strings."""

    model_config = ConfigDict(extra="forbid", strict=True)


class View(Table):
    """Where the camera looks from, in one of three ways."""

    vector: list[Finite] | None = Field(None, min_length=3, max_length=3)
    zenith_deg: Finite | None = None
    azimuth_deg: Finite | None = None
    theta_deg: Finite | None = None
    phi_deg: Finite | None = None


class CameraTable(Table):
    """The table ``[camera]``."""

    view: View = View(vector=[0.0, 0.0, 1.0])
    distance_mm: Positive | None = None
    mm_per_px: Positive | None = None

    @field_validator("view", mode="before")
    @classmethod
    def _vector_or_table(cls, value: Any) -> Any:
        return {"vector": value} if isinstance(value, list) else value


class Noise(Table):
    """Parts of the noise model that are known."""

    read: NotNegative | None = None
    photon: NotNegative | None = None
    relative: NotNegative | None = None


class PhotographsTable(Table):
    """The table ``[photographs]``."""

    transfer: str | None = None
    clip_level: Positive | None = None
    noise: Noise = Noise()

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


def camera_of(table: CameraTable, where: str) -> Camera:
    """Return the camera that a table describes.

    Raises
    ------
    CaptureError
        If its view is given in several ways, or from below the surface.
    """
    view = table.view.model_dump(exclude_none=True)
    if set(view) == {"vector"}:
        direction = np.array(view["vector"])
    elif set(view) == {"zenith_deg", "azimuth_deg"}:
        direction = dome_direction(np.radians(view["zenith_deg"]), np.radians(view["azimuth_deg"]))
    elif set(view) <= {"theta_deg", "phi_deg"} and view:
        direction = tilt_direction(
            np.radians(view.get("theta_deg", 0.0)), np.radians(view.get("phi_deg", 0.0))
        )
    else:
        raise CaptureError(
            Problem(
                where,
                f"view gives {', '.join(view) or 'nothing'}, expected one of: three numbers; zenith_deg and "
                "azimuth_deg; theta_deg and phi_deg",
                "Write for example view = { zenith_deg = 5, azimuth_deg = 90 }",
            )
        )
    length = float(np.linalg.norm(direction))
    if not direction[2] > 1e-6 * length:
        raise CaptureError(
            Problem(
                where, "view points below the surface; z must be > 0", "Check the frame in docs/notation.md"
            )
        )
    return Camera(direction / length, table.distance_mm, table.mm_per_px)


def table_problems(
    name: str, content: dict[str, Any], model: type[Table], error: ValidationError
) -> list[Problem]:
    """Return the complaints of pydantic about a file in the words of TOML.

    Parameters
    ----------
    name : str
        The file's.
    content : dict
        What it holds.
    model : type of Table
        What it was read as.
    error : ValidationError
    """
    return [_problem(name, content, model, dict(detail)) for detail in error.errors()]


def _problem(name: str, content: dict[str, Any], model: type[Table], detail: dict[str, Any]) -> Problem:
    location = detail["loc"]
    tables = tuple(part for part in location[:-1] if isinstance(part, str))
    where = name
    if len(location) > 1 and isinstance(location[1], int):
        entry = content[location[0]][location[1]]
        called = [entry.get(key) for key in ("file", "name")] if isinstance(entry, dict) else []
        named = "".join(f" ({text})" for text in called if isinstance(text, str))
        where += f" {location[0]} {location[1] + 1}{named}"
    elif tables:
        where += f" [{'.'.join(tables)}]"
    key = next((part for part in reversed(location) if isinstance(part, str)), "")
    if detail["type"] == "extra_forbidden":
        return Problem(where, f"unknown key {key}", f"Allowed here: {', '.join(_keys(model, tables))}")
    if detail["type"] == "missing":
        return Problem(where, f"key {key} is missing", f"Add {key} = …")
    do = f"Use {TRANSFER_CHOICES}" if key == "transfer" else f"Correct {key}"
    message = detail["msg"].removeprefix("Value error, ")
    return Problem(where, f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}", do)


def _keys(model: type[Table], tables: tuple[str, ...]) -> list[str]:
    """Return the keys of a table inside that of a model."""
    for name in tables:
        model = next(_models(model.model_fields[name].annotation))
    return list(model.model_fields)


def _models(annotation: Any) -> Iterator[type[Table]]:
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)
