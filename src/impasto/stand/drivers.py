"""What a camera and a light have to do, and which there are: one file and one line each."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from impasto.capture.toml_tables import Table
from impasto.errors import ImpastoError, Problem

if TYPE_CHECKING:
    from impasto.stand.desk import Desk
    from impasto.stand.plan_file import PlacePlan, Plan
    from impasto.stand.steps import Shot

CAMERAS = {
    "gphoto2": "impasto.stand.cameras.gphoto2:GPhoto2Camera",
    "folder": "impasto.stand.cameras.folder:FolderCamera",
    "simulated": "impasto.stand.cameras.simulated:SimulatedCamera",
}
LIGHTS = {
    "hand": "impasto.stand.lights.hand:HandLight",
    "gcode": "impasto.stand.lights.gcode:GCodeLight",
    "dmx": "impasto.stand.lights.dmx:DmxLight",
    "command": "impasto.stand.lights.command:CommandLight",
    "simulated": "impasto.stand.lights.simulated:SimulatedLight",
}


class DriverError(ImpastoError):
    """A camera or a light that does not do what it is told; it may after another try."""


class Light(Protocol):
    """Moves and switches the lamps of a stand.

    A class of its own has an attribute ``Settings``, the `Table` of what the plan says in its table, and is
    made with these settings and the `Stand`.
    """

    def show(self, place: PlacePlan) -> None:
        """Light the painting from a place and from nowhere else; return when the lamp stands still.

        Raises
        ------
        DriverError
            If that cannot be done. Calling again is another try.
        """

    def off(self) -> None:
        """Switch all lamps off, as far as they can be; errors as for `show`."""

    def close(self) -> None:
        """Let go of the device, and leave it dark if it can be; asks nobody and never raises."""


class Camera(Protocol):
    """Takes photographs; made as a `Light` is."""

    def take(self, shot: Shot, folder: Path) -> Path:
        """Take a photograph and return its file, complete, in a folder of temporary files.

        Raises
        ------
        DriverError
            If the camera does not answer, or its file cannot be fetched.
        OSError
            If the file cannot be written.
        """

    def close(self) -> None:
        """Let go of the device; never raises."""


@dataclass
class Stand:
    """What drivers may need to know of the rest.

    Parameters
    ----------
    plan : Plan
    desk : Desk
        Where a person is asked.
    light : Light or None
        For the simulated camera, which sees what the light does.
    """

    plan: Plan
    desk: Desk
    light: Light | None = None


def open_light(stand: Stand) -> Light:
    """Return the light of a plan; errors as for `Light.show`."""
    return _driver(LIGHTS, stand.plan.file.light.driver)(stand.plan.light_settings, stand)  # type: ignore[no-any-return]


def open_camera(stand: Stand) -> Camera:
    """Return the camera of a plan; errors as for `Camera.take`."""
    return _driver(CAMERAS, stand.plan.file.camera.driver)(stand.plan.camera_settings, stand)  # type: ignore[no-any-return]


def settings_of(drivers: dict[str, str], name: str) -> type[Table]:
    """Return the table of a driver's settings."""
    settings: type[Table] = _driver(drivers, name).Settings
    return settings


def missing_package(package: str, purpose: str) -> DriverError:
    """Return the error for a package that comes with the extra ``stand`` only."""
    do = "Install it: pip install 'impasto[stand]'"
    return DriverError(Problem(purpose, f"the package {package} is not installed", do))


def _driver(drivers: dict[str, str], name: str) -> Any:
    module, _, kind = drivers[name].partition(":")
    return getattr(import_module(module), kind)
