"""A watched folder, into which any tethering program puts its photographs."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

from pydantic import Field

from impasto.capture.photographs import READERS, natural_key, without_previews
from impasto.capture.toml_tables import Positive, Table
from impasto.errors import CaptureError, Problem
from impasto.stand.drivers import DriverError, Stand
from impasto.stand.look import look_at
from impasto.stand.steps import Shot

_POLL_S = 0.1
# Names that programs give to what they are still writing.
_TEMPORARY_ENDINGS = (".tmp", ".part", ".partial", ".crdownload", ".download", ".filepart")
_TEMPORARY_BEGINNINGS = (".", "~", "_tmp")


class FolderCamera:
    """Waits for the next photograph in a folder; the shutter is released by hand or by the other program.

    Only files that were not there before count. A file is taken when its size has rested for a while and it
    decodes to its end; it stays in the folder, and a copy is taken.

    Parameters
    ----------
    settings : FolderCamera.Settings
    stand : Stand

    Raises
    ------
    DriverError
        If the folder does not exist.
    """

    class Settings(Table):
        """The table ``[camera.folder]``; a path that is not absolute begins at the plan's own folder."""

        folder: str = Field("tethered", min_length=1)
        rest_s: Positive = 0.5
        timeout_s: Positive = 300.0

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self._settings, self._desk = settings, stand.desk
        self._folder = stand.plan.path.parent / settings.folder
        if not self._folder.is_dir():
            do = "Make it, and have the tethering program save there; or correct folder under [camera.folder]"
            raise DriverError(Problem(str(self._folder), "is no folder to watch", do))
        self._known = self._names()

    def take(self, shot: Shot, folder: Path) -> Path:
        """Wait for a new photograph."""
        self._desk.show(waiting=f"Release the shutter: {shot.label}")
        try:
            arrived = self._wait()
        finally:
            self._desk.show(waiting=None)
        copy = folder / arrived.name
        shutil.copyfile(arrived, copy)
        self._known.add(arrived.name)
        return copy

    def close(self) -> None:
        """Do nothing."""

    def _wait(self) -> Path:
        sizes: dict[str, tuple[int, float]] = {}
        broken: CaptureError | None = None
        end = time.monotonic() + self._settings.timeout_s
        while time.monotonic() < end:
            self._desk.check_stop()
            new = [self._folder / name for name in sorted(self._names() - self._known, key=natural_key)]
            for path in without_previews(new)[0]:
                size, now = _size(path), time.monotonic()
                if size != sizes.get(path.name, (-1, 0.0))[0]:
                    sizes[path.name] = (size, now)
                elif size and now - sizes[path.name][1] >= self._settings.rest_s:
                    try:
                        look_at(path)
                    except CaptureError as error:
                        # It may be a slow copy that pauses: it counts once it grows, or is not waited for.
                        broken = error
                        sizes[path.name] = (size, now)
                    else:
                        return path
            time.sleep(_POLL_S)
        if broken is not None:
            self._known |= self._names()
            raise DriverError(broken.problems)
        what = f"no photograph has arrived for {self._settings.timeout_s:g} s"
        do = "Release the shutter, and see that the tethering program saves into this folder"
        raise DriverError(Problem(str(self._folder), what, do))

    def _names(self) -> set[str]:
        return {
            path.name
            for path in self._folder.iterdir()
            if path.suffix.lower() in READERS
            and not path.name.casefold().startswith(_TEMPORARY_BEGINNINGS)
            and not path.name.casefold().endswith(_TEMPORARY_ENDINGS)
        }


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:  # renamed just now
        return -1
