"""A simulated lamp, which the simulated camera sees."""

from __future__ import annotations

from impasto.capture.toml_tables import Table
from impasto.stand.drivers import Stand
from impasto.stand.plan_file import PlacePlan


class SimulatedLight:
    """Remembers which lamp is on.

    Parameters
    ----------
    settings : SimulatedLight.Settings
    stand : Stand
    """

    class Settings(Table):
        """The table ``[light.simulated]``."""

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self.lit: str | None = None

    def show(self, place: PlacePlan) -> None:
        """Switch the lamp of a place on."""
        self.lit = place.name

    def off(self) -> None:
        """Switch all lamps off."""
        self.lit = None

    def close(self) -> None:
        """Switch all lamps off."""
        self.lit = None
