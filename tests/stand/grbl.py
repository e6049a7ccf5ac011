"""A serial line with an arm at its end, by the published protocol of Grbl v1.1 (`docs/references.md`)."""

import os
import re
import threading
import time
import tty


class Grbl:
    """An emulated controller on a pseudo-terminal.

    Lines are answered with ``ok`` or ``error:N`` when they are taken, before the arm has moved. The
    characters ``?``, ``!``, ``~`` and Ctrl-X are taken out of the stream at once, wherever they stand. A move
    beyond the travel raises ``ALARM:2`` and locks the controller until it is homed or unlocked.
    """

    BANNER = "\r\nGrbl 1.1h ['$' for help]\r\n"

    def __init__(self, speed=400.0, travel=90.0):
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.speed, self.travel = speed, travel
        self.position = self._target = 0.0
        self.offset = 5.0  # the machine's zero is not the work's
        self.state = "Idle"
        self.lines, self.spindle = [], False
        self._reports = 0
        self._line = b""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        """End as when the cable is pulled."""
        if not self._ended.is_set():
            self._ended.set()
            os.close(self._slave)
            os.close(self._master)
            self._thread.join()

    def _run(self):
        os.set_blocking(self._master, False)
        last = time.monotonic()
        while not self._ended.is_set():
            now = time.monotonic()
            self._move(now - last)
            last = now
            try:
                data = os.read(self._master, 256)
            except BlockingIOError:
                data = b""
            except OSError:
                return
            for value in data:
                self._take(bytes([value]))
            time.sleep(0.002)

    def _move(self, elapsed):
        if self.state == "Run":
            step = min(abs(self._target - self.position), self.speed * elapsed)
            self.position += step if self._target > self.position else -step
            if self.position == self._target:
                self.state = "Idle"

    def _take(self, character):
        if character == b"?":
            self._report()
        elif character == b"!":
            self.state = "Hold:0" if self.state == "Run" else self.state
        elif character == b"~":
            self.state = "Run" if self.state.startswith("Hold") else self.state
        elif character == b"\x18":
            self.state = "Idle"
            self._say(self.BANNER)
        elif character in b"\r\n":
            line, self._line = self._line.decode().strip(), b""
            if line or character == b"\n":
                self._obey(line)
        else:
            self._line += character

    def _report(self):
        self._reports += 1
        report = f"<{self.state}|MPos:{self.position + self.offset:.3f},0.000,0.000|FS:0,0"
        # The offset is told in the first report and in every tenth.
        if self._reports % 10 == 1:
            report += f"|WCO:{self.offset:.3f},0.000,0.000"
        self._say(report + ">\r\n")

    def _obey(self, line):
        if not line:
            return self._say("ok\r\n")
        self.lines.append(line)
        if line == "$H":
            self.position = self._target = 0.0
            self.state = "Idle"
            return self._say("ok\r\n")
        if line == "$X":
            self.state = "Idle"
            return self._say("[MSG:Caution: Unlocked]\r\nok\r\n")
        if self.state == "Alarm":
            return self._say("error:9\r\n")
        if line[0] not in "GMSXF":
            return self._say("error:1\r\n")
        if re.search(r"G(?!0|1|90|21)\d", line):
            return self._say("error:20\r\n")
        if re.match(r"M[345]", line):
            self.spindle = line.startswith("M3")
        if target := re.search(r"X(-?[\d.]+)", line):
            if abs(float(target[1])) > self.travel:
                self.state = "Alarm"
                return self._say("ALARM:2\r\n[MSG:Reset to continue]\r\n")
            self._target = float(target[1])
            self.state = "Run" if self._target != self.position else self.state
        return self._say("ok\r\n")

    def _say(self, text):
        os.write(self._master, text.encode())


class Marlin(Grbl):
    """The same arm with Marlin: no status reports, ``M400`` is answered when the arm stands."""

    _waiting = False

    def _take(self, character):
        if character in b"?!~":
            self._line += character
        else:
            super()._take(character)

    def _obey(self, line):
        if line == "M400":
            self._waiting = True
        elif line.startswith("?"):
            self._say(f'echo:Unknown command: "{line}"\r\nok\r\n')
        else:
            super()._obey(line)

    def _move(self, elapsed):
        super()._move(elapsed)
        if self._waiting and self.state == "Idle":
            self._waiting = False
            self._say("ok\r\n")
