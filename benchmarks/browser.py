"""A browser that nobody looks into: driven by Chrome's DevTools protocol over a pipe, with the least of it.

Playwright has the browser keep a copy of what it received, up to 200 MB, to be asked for. Where memory is
measured, that copy must not count as the page's.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from fcntl import F_DUPFD, fcntl
from types import TracebackType
from typing import Any

# Without what a browser does beside showing a page, most of all when it starts for the first time.
_QUIET = (
    "--no-first-run", "--no-default-browser-check", "--disable-background-networking", "--disable-breakpad",
    "--disable-component-update", "--disable-default-apps", "--disable-extensions", "--disable-sync",
    "--disable-field-trial-config", "--metrics-recording-only", "--mute-audio", "--password-store=basic",
)  # fmt: skip
# Where the browser expects the pipe.
_COMMANDS, _REPLIES = 3, 4


class Browser:
    """Chromium without a window, with one page.

    Parameters
    ----------
    executable : str
    flags : sequence of str
    profile : str
        Folder for its files.
    width, height : int
        Of the page, in pixels.
    """

    def __init__(self, executable: str, flags: Sequence[str], profile: str, width: int, height: int) -> None:
        commands, self._to = os.pipe()
        self._from, replies = os.pipe()
        # Out of the way of the numbers that they are to have.
        ends = [fcntl(end, F_DUPFD, 16) for end in (commands, replies)]

        def connect() -> None:
            for end, number in zip(ends, (_COMMANDS, _REPLIES), strict=True):
                os.dup2(end, number)

        self._process = subprocess.Popen(
            [
                executable, "--headless", "--remote-debugging-pipe", *_QUIET,
                f"--user-data-dir={profile}", f"--window-size={width},{height}", *flags,
            ],
            preexec_fn=connect, pass_fds=(_COMMANDS, _REPLIES), stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for end in (commands, replies, *ends):
            os.close(end)
        self._received = b""
        self._sent = 0
        self._session: str | None = None
        target = self.send(
            "Target.createTarget", url="about:blank", newWindow=True, width=width, height=height
        )["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.send("Page.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(30)
        os.close(self._to)
        os.close(self._from)

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command of the protocol and return its result."""
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while (reply := self._receive()).get("id") != self._sent:
            pass  # an event
        if "error" in reply:
            raise RuntimeError(f"{method}: {reply['error']['message']}")
        result: dict[str, Any] = reply["result"]
        return result

    def open(self, url: str) -> None:
        """Open a page, and wait until it is loaded."""
        self.send("Page.navigate", url=url)
        while self._receive().get("method") != "Page.loadEventFired":
            pass

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._received:
            if not (piece := os.read(self._from, 1 << 16)):
                raise RuntimeError("the browser has gone")
            self._received += piece
        text, _, self._received = self._received.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        return message

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, or of the promise that it is."""
        done = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            raise RuntimeError(done["exceptionDetails"]["text"])
        return done["result"].get("value")

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> None:
        """Drag the mouse with its left button."""

        def mouse(kind: str, share: float) -> None:
            x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            button = {"button": "left", "buttons": 1, "clickCount": 1}
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **button)

        mouse("mousePressed", 0)
        for step in range(1, steps + 1):
            mouse("mouseMoved", step / steps)
        mouse("mouseReleased", 1)
