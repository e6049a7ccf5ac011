"""A camera on a cable, through libgphoto2: Nikon, Canon, Sony, Fujifilm and many others."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from impasto.capture.photographs import READERS, natural_key
from impasto.capture.raw import ENDINGS as RAW_ENDINGS
from impasto.capture.toml_tables import NotNegative, Positive, Table
from impasto.errors import Problem
from impasto.stand.drivers import DriverError, Stand, missing_package
from impasto.stand.steps import Shot, shutter

# What drivers of libgphoto2 call the exposure time.
_SHUTTER_KEYS = ("shutterspeed", "shutterspeed2", "exposuretime")
# The nearest time that a camera has may differ by a third of a stop and a rounding.
_NEAR = 1.3
_POLL_S = 0.2
_AFTER_CAPTURE_MS = 500


class GPhoto2Camera:
    """Sets the exposure time, releases, and fetches what the camera wrote.

    Files stay on the camera's card. Of a raw file and a JPEG of one photograph, the raw file is fetched.

    Parameters
    ----------
    settings : GPhoto2Camera.Settings
    stand : Stand

    Raises
    ------
    DriverError
        If the package gphoto2 is not installed, or no camera answers.
    """

    class Settings(Table):
        """The table ``[camera.gphoto2]``.

        With release ``"hand"`` somebody presses the camera's own release, and the program fetches what is new
        on its card; cameras that cannot be released through the cable need it.
        """

        model: str = ""
        port: str = ""
        release: Literal["cable", "hand"] = "cable"
        timeout_s: Positive = 60.0
        release_delay_s: NotNegative = 0.0

    def __init__(self, settings: Settings, stand: Stand) -> None:
        try:
            import gphoto2
        except ImportError as error:
            raise missing_package("gphoto2", "camera gphoto2") from error
        self._gp: Any = gphoto2
        self._settings, self._desk = settings, stand.desk
        self._camera = gphoto2.Camera()
        with self._faults():
            self._choose()
            self._camera.init()
            self._known = set(self._files())
        self._shutter_key = self._find_shutter() if settings.release == "cable" else ""

    def take(self, shot: Shot, folder: Path) -> Path:
        """Release, or wait for the release, and fetch the photograph."""
        with self._faults():
            if self._settings.release == "cable":
                self._set_shutter(shot.exposure_s)
                time.sleep(self._settings.release_delay_s)
                self._camera.trigger_capture()
            else:
                self._desk.show(waiting=f"Release the shutter: {shot.label}")
            try:
                where, name = self._wait()
            finally:
                self._desk.show(waiting=None)
            path = folder / name
            file = self._camera.file_get(where, name, self._gp.GP_FILE_TYPE_NORMAL)
            # Written here and not by libgphoto2, which does not say when a disk is full.
            path.write_bytes(file.get_data_and_size())
        return path

    def close(self) -> None:
        """Let go of the camera."""
        with suppress(self._gp.GPhoto2Error):
            self._camera.exit()

    def _choose(self) -> None:
        """Choose the camera by model and port, where the plan names them."""
        if self._settings.model:
            abilities = self._gp.CameraAbilitiesList()
            abilities.load()
            self._camera.set_abilities(abilities.get_abilities(abilities.lookup_model(self._settings.model)))
        if self._settings.port:
            ports = self._gp.PortInfoList()
            ports.load()
            self._camera.set_port_info(ports.get_info(ports.lookup_path(self._settings.port)))

    def _wait(self) -> tuple[str, str]:
        """Return folder and name of the next photograph, once all that belongs to it is written."""
        end = time.monotonic() + self._settings.timeout_s
        found: list[tuple[str, str]] = []
        while time.monotonic() < end:
            self._desk.check_stop()
            if arrived := self._events():
                found += arrived
            elif new := sorted(set(self._files()) - self._known - set(found)):
                found += new
            elif found:  # and nothing more for a while
                self._known |= set(found)
                return min(found, key=lambda file: (Path(file[1]).suffix.lower() not in RAW_ENDINGS,
                                                    natural_key(file[1])))  # fmt: skip
        what = f"no photograph has arrived for {self._settings.timeout_s:g} s"
        raise DriverError(Problem("camera gphoto2", what, "See that camera, cable and card are ready"))

    def _events(self) -> list[tuple[str, str]]:
        """Return the files that the camera says it has written, within a while."""
        try:
            kind, data = self._camera.wait_for_event(_AFTER_CAPTURE_MS)
        except self._gp.GPhoto2Error as error:
            if error.code != self._gp.GP_ERROR_NOT_SUPPORTED:
                raise
            time.sleep(_POLL_S)
            # A driver without events keeps the list of files that it read first, until it is opened anew.
            self._camera.exit()
            self._camera.init()
            return []
        if kind == self._gp.GP_EVENT_FILE_ADDED and _is_photograph(data.name):
            return [(data.folder, data.name)]
        return []

    def _files(self, folder: str = "/") -> Iterator[tuple[str, str]]:
        """Yield folder and name of all photographs on the camera."""
        for number in range((names := self._camera.folder_list_files(folder)).count()):
            if _is_photograph(name := names.get_name(number)):
                yield folder, name
        for number in range((names := self._camera.folder_list_folders(folder)).count()):
            yield from self._files(f"{folder.rstrip('/')}/{names.get_name(number)}")

    def _find_shutter(self) -> str:
        for key in _SHUTTER_KEYS:
            with suppress(self._gp.GPhoto2Error):
                self._camera.get_single_config(key)
                return key
        do = 'Set the camera to manual exposure (M), or release by hand: release = "hand"'
        raise DriverError(Problem("camera gphoto2", "its exposure time cannot be set by cable", do))

    def _set_shutter(self, seconds: float) -> None:
        widget = self._camera.get_single_config(self._shutter_key)
        choices = {
            text: value
            for number in range(widget.count_choices())
            if (value := seconds_of(text := widget.get_choice(number))) is not None
        }
        nearest = min(choices, key=lambda text: abs(choices[text] / seconds - 1), default=None)
        ratio = 0.0 if nearest is None else choices[nearest] / seconds
        if nearest is None or not 1 / _NEAR <= ratio <= _NEAR:
            what = f"has no exposure time near {shutter(seconds)}"
            do = "Set it to manual exposure (M), or plan times that it has"
            raise DriverError(Problem("camera gphoto2", what, do))
        widget.set_value(nearest)
        self._camera.set_single_config(self._shutter_key, widget)

    @contextmanager
    def _faults(self) -> Iterator[None]:
        try:
            yield
        except self._gp.GPhoto2Error as error:
            do = "See that the camera is on, its cable holds, and no other program uses it; then try again"
            raise DriverError(Problem("camera gphoto2", f"does not answer: {error.string}", do)) from error


def seconds_of(text: str) -> float | None:
    """Return the exposure time that a camera's choice says, such as ``1/60``, ``0.5s`` or ``13/10``."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?\s*(?:s|sec)?", text.strip())
    if not match:
        return None
    value = float(Fraction(match[1]) / Fraction(match[2] or "1"))
    return value or None


def _is_photograph(name: str) -> bool:
    return Path(name).suffix.lower() in READERS
