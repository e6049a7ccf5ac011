"""A stepper arm or gantry that speaks G-code over a serial line: GRBL or Marlin."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Literal

from pydantic import Field

from impasto.capture.toml_tables import NotNegative, Positive, Table
from impasto.errors import Problem
from impasto.stand.drivers import DriverError, Stand, missing_package
from impasto.stand.lights.places import filled, placeholder_problem
from impasto.stand.plan_file import PlacePlan

_POLL_S = 0.05
_LINE_S = 0.2
_TRY_AGAIN = "See to the arm, then try again"

# What GRBL's error and alarm numbers mean, as far as moving an arm meets them.
_ERRORS = {
    "1": "a word does not begin with a letter",
    "2": "a number is not one",
    "8": "this needs the arm to be idle",
    "9": "it is locked, after an alarm or while jogging",
    "15": "the move is beyond the arm's travel",
    "20": "it does not know this command",
    "22": "no feed rate is set",
}
_ALARMS = {
    "1": "a limit switch was hit",
    "2": "the target is beyond the arm's travel",
    "3": "it was reset while moving, and does not know where it stands",
    "6": "homing was reset",
    "8": "homing did not leave the switch",
    "9": "homing did not find the switch",
}


class GCodeLight:
    """Moves the lamp and waits until it stands.

    Parameters
    ----------
    settings : GCodeLight.Settings
    stand : Stand

    Raises
    ------
    DriverError
        If the package pyserial is not installed, the port does not open, or nobody answers at it.

    Notes
    -----
    A held arm (feed hold) is left alone until somebody says to try again; then it is told to go on. After an
    alarm it is homed if the plan says so, and otherwise left locked: it does not know where it stands.

    References
    ----------
    [Grbl11]_
    """

    class Settings(Table):
        """The table ``[light.gcode]``; commands have the placeholders of `places.filled`."""

        port: str = "/dev/ttyUSB0"
        baud: int = Field(115200, gt=0)
        firmware: Literal["grbl", "marlin"] = "grbl"
        move: str = Field("G90 G1 X{arm_angle_deg:.3f} F1200", min_length=1)
        lamp_on: str = ""
        lamp_off: str = ""
        home: bool = False
        tolerance: NotNegative = 0.05
        timeout_s: Positive = 60.0

    def __init__(self, settings: Settings, stand: Stand) -> None:
        try:
            import serial
        except ImportError as error:
            raise missing_package("pyserial", "light gcode") from error
        placeholder_problem(settings.move, stand.plan.file.place, "[light.gcode] move")
        self._serial: Any = serial
        self._settings = settings
        with self._faults():
            self._line = serial.serial_for_url(
                settings.port, settings.baud, timeout=_LINE_S, write_timeout=settings.timeout_s
            )
            self._greet()

    def show(self, place: PlacePlan) -> None:
        """Move the lamp to a place, wait until it stands there, and switch it on."""
        with self._faults():
            self._wait_idle(release_hold=True)
            move = filled(self._settings.move, place)
            self._command(move)
            self._wait_idle()
            self._check_position(move)
            if self._settings.lamp_on:
                self._command(self._settings.lamp_on)

    def off(self) -> None:
        """Switch the lamp off, if the arm can."""
        if self._settings.lamp_off:
            with self._faults():
                self._command(self._settings.lamp_off)

    def close(self) -> None:
        """Switch the lamp off, if the arm can, and let go of the line."""
        with suppress(DriverError, self._serial.SerialException, OSError):
            self.off()
        with suppress(self._serial.SerialException, OSError):
            self._line.close()

    def _greet(self) -> None:
        """Wake the controller and wait for its answer; opening the port may have reset it."""
        self._line.write(b"\r\n\r\n")
        end = time.monotonic() + min(10.0, self._settings.timeout_s)
        while time.monotonic() < end:
            if self._settings.firmware == "grbl":
                if self._status():
                    break
            else:
                self._line.write(b"M400\n")
                if "ok" in self._read_line():
                    break
        else:
            raise self._problem("nobody answers", "See that the arm is on, and that port and baud are right")
        while self._read_line():  # what it still says about waking up must not pass for a later answer
            pass
        if self._settings.home:
            self._home()

    def _home(self) -> None:
        self._command("$H" if self._settings.firmware == "grbl" else "G28")

    def _command(self, line: str) -> None:
        """Send a line and wait for its ``ok``."""
        self._line.write(line.encode() + b"\n")
        end = time.monotonic() + self._settings.timeout_s
        while time.monotonic() < end:
            answer = self._read_line()
            if answer == "ok" or answer.startswith("ok "):
                return
            self._raise_fault(answer, line)
        raise self._problem(f"{line!r} is not answered", "See that its cable holds, then try again")

    def _wait_idle(self, release_hold: bool = False) -> None:
        """Wait until the arm stands still."""
        if self._settings.firmware == "marlin":
            self._command("M400")
            return
        end = time.monotonic() + self._settings.timeout_s
        while time.monotonic() < end:
            state = self._status().get("state", "")
            if state == "Idle":
                return
            if state.startswith("Hold"):
                if not release_hold:
                    raise self._problem("the arm is held", "Release it; trying again lets the move go on")
                self._line.write(b"~")
                release_hold = False
            if state.startswith(("Door", "Sleep")):
                raise self._problem(f"the arm says {state}", _TRY_AGAIN)
            if state.startswith("Alarm"):
                if not self._settings.home:
                    do = "Home or unlock it by hand: it does not know where it stands. Then try again"
                    raise self._problem("the arm is locked by an alarm", do)
                self._home()
            time.sleep(_POLL_S)
        raise self._problem(f"the arm does not stand after {self._settings.timeout_s:g} s", _TRY_AGAIN)

    def _check_position(self, move: str) -> None:
        """Compare where GRBL says it stands, axes in the order X, Y, Z, with where it was sent."""
        position = self._status().get("position") if self._settings.firmware == "grbl" else None
        if position is None:
            return
        for axis, stands in zip("XYZ", position, strict=False):
            sent = re.search(rf"{axis}(-?\d+(?:\.\d+)?)", move)
            if sent and abs(float(sent[1]) - stands) > self._settings.tolerance:
                what = f"axis {axis} stands at {stands:g} and was sent to {float(sent[1]):g}"
                raise self._problem(what, _TRY_AGAIN)

    def _status(self) -> dict[str, Any]:
        """Return GRBL's state and its position in the work's frame, as far as the report has them."""
        self._line.write(b"?")
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            answer = self._read_line()
            self._raise_fault(answer, "?")
            if answer.startswith("<") and answer.endswith(">"):
                return self._parsed(answer)
        return {}

    def _parsed(self, report: str) -> dict[str, Any]:
        state, *fields = report[1:-1].split("|")
        values = dict(field.partition(":")[::2] for field in fields)
        if "WCO" in values:
            self._offset = _numbers(values["WCO"])
        found: dict[str, Any] = {"state": state}
        if "WPos" in values:
            found["position"] = _numbers(values["WPos"])
        elif "MPos" in values and (offset := getattr(self, "_offset", None)) is not None:
            found["position"] = [m - o for m, o in zip(_numbers(values["MPos"]), offset, strict=False)]
        return found

    def _read_line(self) -> str:
        """Return the next line, "" if none comes in time."""
        data: bytes = self._line.readline()
        return data.decode(errors="replace").strip()

    def _raise_fault(self, answer: str, line: str) -> None:
        kind, _, number = answer.partition(":")
        if kind.casefold() == "error":
            number = number.strip()
            raise self._problem(
                f"{line!r} is refused: {answer} ({_ERRORS.get(number, 'see its manual')})",
                "Correct the command in the plan, or see to the arm; then try again",
            )
        if kind == "ALARM":
            raise self._problem(f"{answer} ({_ALARMS.get(number.strip(), 'see its manual')})", _TRY_AGAIN)

    def _problem(self, what: str, do: str) -> DriverError:
        return DriverError(Problem(f"arm at {self._settings.port}", what, do))

    @contextmanager
    def _faults(self) -> Iterator[None]:
        try:
            yield
        except (self._serial.SerialException, OSError) as error:
            do = "See that its cable holds and the port is right, then try again"
            raise self._problem(f"the serial line is gone: {error}", do) from error


def _numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]
