"""What the attributes of a store's groups are: docs/store.md in code, checked when a group is opened."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from impasto.errors import Problem
from impasto.store.hierarchy import Attributes
from impasto.store.kinds import (
    COUNT,
    FLAG,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    TEXT,
    Kind,
    each,
    kind,
    numbers,
    one_of,
    or_null,
    record,
)
from impasto.store.layout import STATUS_MEANING

_OBJECT = record({})
_CAMERA = record(
    {"view_direction": numbers(3), "distance_mm": or_null(POSITIVE), "mm_per_px": or_null(POSITIVE)}
)
_COLOUR = record({"matrix": numbers(3, None), "white_xyz": numbers(3), "source": TEXT})
_MADE_BY = {"program": TEXT, "version": TEXT}


def attribute_problems(store: Path, group: str, attributes: Attributes, of: Kind, do: str) -> list[Problem]:
    """Return everything that is wrong with the attributes of a group.

    Parameters
    ----------
    store : Path
    group : str
        Path of the group, "" for the root.
    attributes : dict
    of : callable
        What they have to be.
    do : str
        How to mend them.
    """
    where = f"{store}: {group}/zarr.json" if group else f"{store}: zarr.json"
    return [Problem(where, what, do) for what in of(attributes, "")]


def stack_kind(lights: int | None, channels: int | None, *, complete: bool) -> Kind:
    """Return what the attributes of a stack are; None stands for a number that is not known."""
    digest, count = (TEXT, COUNT) if complete else (or_null(TEXT), or_null(COUNT))
    photograph = record(
        {"name": TEXT, "file": TEXT, "dtype": TEXT, "transfer": TEXT, "clipped_samples": count},
        {
            "blake3": digest,
            "sha256": digest,  # of earlier versions
            **dict.fromkeys(("exposure_s", "f_number", "iso"), or_null(NUMBER)),
            **dict.fromkeys(("camera", "lens", "taken"), TEXT),
            "shift_px": numbers(2),
        },
    )
    return record(
        {
            **_MADE_BY,
            "scale": NUMBER,
            "offset": NUMBER,
            "clip_level": each(or_null(NUMBER), channels),
            "noise": record(dict.fromkeys(("read", "photon", "relative"), NOT_NEGATIVE)),
            "camera": _CAMERA,
            "inputs": each(photograph, lights),
            "settings_sha256": TEXT,
        },
        {
            "light_rgb": numbers(channels),
            "light_rgb_source": TEXT,
            "camera_colour": or_null(_COLOUR),
            "white_reference": or_null(_OBJECT),
            "light_file": record({"file": TEXT}),
            "notes": each(TEXT),
            "complete": FLAG,
        },
    )


def fit_kind(model: str, attributes: Attributes, channels: int | None) -> Kind:
    """Return what the attributes of a fit are, whose parts have to match; None as for `stack_kind`."""
    lights = _count(attributes, "photographs")
    counts = {"pixels": record({}, dict.fromkeys(STATUS_MEANING.values(), COUNT)), "clipped_samples": COUNT}
    return record(
        {
            **_MADE_BY,
            "model": one_of(model),
            "procedure": TEXT,
            "index_of_refraction": POSITIVE,
            "fresnel": one_of("facet", "element"),
            "options": _OPTIONS,
            "light_rgb": numbers(channels),
            "photographs": COUNT,
            "settings_sha256": TEXT,
            **(counts if attributes.get("complete") else {}),
        },
        {
            "notes": each(TEXT),
            "self_calibration": _self_calibration(lights, channels),
            "highlight_colour": record({"used": one_of("white", "own")}),
            "residual": _residual(channels),
            "sample": _SAMPLE,
            "complete": FLAG,
        },
    )


def _count(found: Attributes, name: str) -> int | None:
    """Return a count, None where it is not known."""
    value: int | None = found.get(name)
    return None if any(COUNT(value, name)) else value


_OPTIONS = record(
    {"exclude": each(TEXT)},
    {
        **dict.fromkeys(("loss", "highlight", "highlight_colour"), TEXT),
        **dict.fromkeys(("shadow_level", "threshold_deg"), or_null(NUMBER)),
        **dict.fromkeys(("shadows", "share_reflectance", "refined", "residual"), FLAG),
        **dict.fromkeys(("calibrate_directions", "calibrate_distances"), FLAG),
        "loss_scale": POSITIVE,
        "max_steps": COUNT,
        "residual_components": COUNT,
        "self_calibrate": or_null(FLAG),
    },
)

_SAMPLE = record({"arm_azimuth_deg": NUMBER, "threshold_deg": NUMBER, "row": COUNT, "column": COUNT})


def _over_direction(channels: int | None, lights: int | None) -> Kind:
    """Return what is told over direction: by a table or, in older stores, by the weights of a kernel."""

    def check(value: Any, name: str) -> Iterator[str]:
        if isinstance(value, dict) and "weights" in value:
            return record({"weights": numbers(channels, lights), "length": POSITIVE})(value, name)
        wrong = list(record({"table": numbers(channels, None, None)})(value, name))
        if not wrong and not np.size(value["table"]):
            wrong.append(f"the attribute {name}.table is empty, expected directions in every channel")
        return iter(wrong)

    return check


def _told(value: Any, name: str) -> Iterator[str]:
    yield from record({"distance": POSITIVE}, {"direction": numbers(None, 3)})(value, name)
    if isinstance(value, dict) and {"table", "weights"} & value.keys():
        direction = value.get("direction")
        lights = len(direction) if isinstance(direction, list) else 0
        yield from _over_direction(1, lights)(value, name)


def _self_calibration(lights: int | None, channels: int | None) -> Kind:
    found = {"common": POSITIVE, "own": numbers(lights)}
    corrected = {"corrected": numbers(lights, 3)}

    def distances(value: Any, name: str) -> Iterator[str]:
        used = value.get("used") if isinstance(value, dict) else None
        needed = {"used": one_of("stated", *found)} | {key: of for key, of in found.items() if key == used}
        return record(needed, {**found, "told": or_null(_told)})(value, name)

    def directions(value: Any, name: str) -> Iterator[str]:
        used = isinstance(value, dict) and value.get("used") is True
        return record({"used": FLAG, **(corrected if used else {})}, corrected)(value, name)

    strengths = numbers(lights, channels)
    return record({"gain": strengths, "trend": strengths}, {"directions": directions, "distances": distances})


def _residual(channels: int | None) -> Kind:
    """Return what a residual term is, whose parts have to match."""

    def check(value: Any, name: str) -> Iterator[str]:
        found = value if isinstance(value, dict) else {}
        components = _count(found, "components")
        lights = len(found["direction"]) if isinstance(found.get("direction"), list) else None
        # A published store has what each of 256 codes stands for.
        values = {"table": numbers(256)} if "table" in found else {"step": numbers(components)}
        return record(
            {
                "components": COUNT,
                **values,
                "toe": POSITIVE,
                "direction": numbers(lights, 3),
                "length": POSITIVE,
                "weights": numbers(components, channels, lights),
                "hull": numbers(None, 3),
                "fade": POSITIVE,
            },
            {"zero": COUNT, "strength": or_null(_over_direction(channels, lights))},
        )(value, name)

    return check


_OR_UNKNOWN = or_null(NUMBER)
_ERRORS = record(
    dict.fromkeys(("psnr_db", "ssim", "rms_relative"), _OR_UNKNOWN),
    dict.fromkeys(("compared", "predicted", "ciede2000"), _OR_UNKNOWN),
)
_SHARES = record(
    {**dict.fromkeys(("model", "lights", "shadows", "noise"), _OR_UNKNOWN), "pixels": COUNT},
    {"sampling": _OR_UNKNOWN},  # which earlier versions did not tell
)
_JUDGED = record({"name": TEXT, "zenith_deg": NUMBER, "azimuth_deg": NUMBER, "errors": _ERRORS})

EVALUATION = record(
    {
        "model": TEXT,
        "procedure": TEXT,
        "index_of_refraction": POSITIVE,
        "fresnel": TEXT,
        "options": _OPTIONS,
        "stack_sha256": TEXT,
        "px_per_px": kind("a whole number from 1", lambda value: type(value) is int and value > 0),
        "lights": each(_JUDGED),
        "mean": _ERRORS,
    },
    {"as_photographed": or_null(_ERRORS), "shares": or_null(_SHARES)},
)
"""What the attributes of an evaluation are."""

_COLUMN = record(
    {
        **dict.fromkeys(("name", "units", "long_name"), TEXT),
        "component": COUNT,
        "transfer": one_of("linear", "log"),
        **dict.fromkeys(("scale", "offset"), NUMBER),
    }
)


def published_kind(attributes: Attributes) -> Kind:
    """Return what those attributes of a published store are that renderings need."""
    colour = attributes.get("light_rgb")
    channels = len(colour) if isinstance(colour, list) else None

    def columns(value: Any, name: str) -> Iterator[str]:
        wrong = list(each(_COLUMN)(value, name))
        yield from wrong
        if wrong:
            return
        for quantity, count in (("normal", 2), ("diffuse", channels)):
            found = [column["component"] for column in value if column["name"] == quantity]
            if found != list(range(count or 0)):
                yield f"the attribute {name} has components {found} of {quantity}, expected {count} in order"

    def model(value: Any, name: str) -> Iterator[str]:
        named = value.get("name") if isinstance(value, dict) else None
        return record(
            {
                "name": TEXT,
                "model": one_of(str(named)),
                "index_of_refraction": POSITIVE,
                "fresnel": one_of("facet", "element"),
                "light_rgb": numbers(channels),
                "parameters": columns,
            },
            {
                "residual": or_null(_residual(channels)),
                "self_calibration": record({}, {"distances": record({}, {"told": _told})}),
                "sample": _SAMPLE,
            },
        )(value, name)

    return record(
        {"light_rgb": numbers(None), "size": each(COUNT, 2), "camera": _CAMERA, "models": each(model)},
        {"camera_colour": or_null(_COLOUR)},
    )
