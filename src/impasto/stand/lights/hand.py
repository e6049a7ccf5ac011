"""A lamp that the operator moves by hand."""

from __future__ import annotations

from impasto.capture.toml_tables import Table
from impasto.geometry import zenith_azimuth
from impasto.stand.drivers import Stand
from impasto.stand.plan_file import PlacePlan

_DONE = {"done": "it stands there"}


class HandLight:
    """Says where the lamp belongs and waits until it stands there.

    Parameters
    ----------
    settings : HandLight.Settings
    stand : Stand
    """

    class Settings(Table):
        """The table ``[light.hand]``."""

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self._desk = stand.desk
        self._lit = True

    def show(self, place: PlacePlan) -> None:
        """Ask for the lamp at a place."""
        self._desk.ask(f"Lamp to {where(place)}", _DONE)
        self._lit = True

    def off(self) -> None:
        """Ask for darkness, once."""
        if self._lit:
            self._desk.ask("All lamps off", {"done": "they are off"})
        self._lit = False

    def close(self) -> None:
        """Do nothing: the lamp is the operator's."""


def where(place: PlacePlan) -> str:
    """Return a place in the words that the stand's scales have."""
    if place.arm_angle_deg is not None:
        return f"{place.arm_angle_deg:+g}° on the arm ({place.name})"
    if place.position_mm is not None:
        x, y, z = place.position_mm
        return f"x {x:g}, y {y:g}, z {z:g} mm ({place.name})"
    import math

    zenith, azimuth = zenith_azimuth(place.light().direction)
    high, around = math.degrees(float(zenith)), math.degrees(float(azimuth)) % 360
    return f"{high:.0f}° from the normal, {around:.0f}° around ({place.name})"
