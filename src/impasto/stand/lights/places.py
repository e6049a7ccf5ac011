"""Places filled into texts of the user's, such as a G-code line or a command."""

from __future__ import annotations

import math
from collections.abc import Sequence

from impasto.errors import Problem
from impasto.geometry import zenith_azimuth
from impasto.stand.drivers import DriverError
from impasto.stand.plan_file import PlacePlan


def filled(text: str, place: PlacePlan) -> str:
    """Return a text with a place filled in.

    Parameters
    ----------
    text : str
        With any of ``{name}``, ``{arm_angle_deg}``, ``{zenith_deg}``, ``{azimuth_deg}``, ``{x}``, ``{y}``,
        ``{z}`` (direction or mm) and ``{dmx_channel}``, and a format such as ``{arm_angle_deg:.2f}``.
    place : PlacePlan

    Raises
    ------
    KeyError
        For a name that the place has no value for.
    """
    return text.format_map(_values(place))


def placeholder_problem(text: str, places: Sequence[PlacePlan], where: str) -> None:
    """Raise if a text cannot be filled in for some place.

    Raises
    ------
    DriverError
        Naming the first placeholder that does not exist, and the place that has none.
    """
    for place in places:
        try:
            filled(text, place)
        except (KeyError, ValueError, IndexError, AttributeError) as error:
            known = ", ".join(f"{{{name}}}" for name in _values(place))
            what = f"{text!r} cannot be filled in for {place.name}: {error}"
            raise DriverError(Problem(where, what, f"Write one of {known}")) from error


def _values(place: PlacePlan) -> dict[str, float | int | str]:
    direction, position = place.light().direction, place.position_mm
    zenith, azimuth = (math.degrees(float(angle)) for angle in zenith_azimuth(direction))
    x, y, z = position or direction
    values = {
        "name": place.name,
        "arm_angle_deg": place.arm_angle_deg,
        "zenith_deg": zenith,
        "azimuth_deg": azimuth % 360,
        "x": x,
        "y": y,
        "z": z,
        "dmx_channel": place.dmx_channel,
    }
    return {key: value for key, value in values.items() if value is not None}
