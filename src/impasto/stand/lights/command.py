"""Lamps that a command of the user's switches."""

from __future__ import annotations

import shlex
import subprocess
from contextlib import suppress
from typing import Any

from pydantic import Field

from impasto.capture.toml_tables import Positive, Table
from impasto.errors import Problem
from impasto.stand.drivers import DriverError, Stand
from impasto.stand.lights.places import filled, placeholder_problem
from impasto.stand.plan_file import PlacePlan


class CommandLight:
    """Runs a command per place.

    Parameters
    ----------
    settings : CommandLight.Settings
    stand : Stand

    Raises
    ------
    DriverError
        If a command has a placeholder that some place has no value for.
    """

    class Settings(Table):
        """The table ``[light.command]``: commands, with the placeholders of `places.filled`."""

        show: str = Field("impasto-lamp {name}", min_length=1)
        off: str = ""
        timeout_s: Positive = 60.0

    def __init__(self, settings: Settings, stand: Stand) -> None:
        self._settings = settings
        placeholder_problem(settings.show, stand.plan.file.place, "[light.command] show")

    def show(self, place: PlacePlan) -> None:
        """Run the command of a place, without a shell; it has to end well."""
        # Split first: what is filled in is one argument whatever it holds.
        self._run([filled(part, place) for part in shlex.split(self._settings.show)])

    def off(self) -> None:
        """Run the command for darkness, if there is one."""
        if self._settings.off:
            self._run(shlex.split(self._settings.off))

    def close(self) -> None:
        """Switch the lamps off."""
        with suppress(DriverError):
            self.off()

    def _run(self, command: list[str]) -> None:
        where = " ".join(command)
        do = "Mend the command or the lamp, then try again"
        options: dict[str, Any] = {"capture_output": True, "text": True, "errors": "replace"}
        try:
            done = subprocess.run(command, timeout=self._settings.timeout_s, check=False, **options)
        except subprocess.TimeoutExpired as error:
            what = f"has not ended after {self._settings.timeout_s:g} s"
            raise DriverError(Problem(where, what, do)) from error
        except OSError as error:
            raise DriverError(Problem(where, f"cannot be run: {error.strerror}", do)) from error
        if done.returncode:
            said = (done.stderr or done.stdout).strip().splitlines()[-1:]
            what = f"ended with code {done.returncode}" + "".join(f": {line}" for line in said)
            raise DriverError(Problem(where, what, do))
