"""A server of an experiment in a process of its own, and an observer in a browser; the tests use both."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Page

ADMIN_TOKEN = "the-laboratory-s-own-token"


def free_port() -> int:
    """Return a port of loopback that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class ServerProcess:
    """The server as a laboratory runs it, in a process of its own that can be killed and started again."""

    def __init__(self, folder: Path, database: str) -> None:
        self.port = free_port()
        self.address = f"http://127.0.0.1:{self.port}"
        command = [
            sys.executable,
            "-c",
            "from impasto.cli import main; main()",
            "experiment",
            "serve",
            folder,
        ]
        self._command = [*map(str, command), "--database", database, "--port", str(self.port)]
        self._environment = {**os.environ, "IMPASTO_ADMIN_TOKEN": ADMIN_TOKEN}
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        """Start, and return when requests are answered."""
        self._process = subprocess.Popen(
            self._command, env=self._environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        for _ in range(600):
            if self._process.poll() is not None:
                raise RuntimeError(self._process.stdout.read())
            with suppress(OSError), urllib.request.urlopen(f"{self.address}/api/openapi.json", timeout=1):
                return
            time.sleep(0.1)
        raise RuntimeError("the server did not start")

    def kill(self) -> None:
        """End at once, without a chance to tidy up."""
        self._process.kill()
        self._process.wait()

    def __enter__(self) -> ServerProcess:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()


def fill_in(page: Page) -> None:
    """Fill in whatever the card that is shown asks for."""
    if page.locator("[name=agreed]").count():
        page.locator("[name=agreed]").check()
    for name, text in (("display", "a display of no make"), ("distance_mm", "700"), ("gamma", "2.2")):
        if page.locator(f"[name={name}]").count():
            page.locator(f"[name={name}]").fill(text)
    for name, answer in (("dark", "7"), ("bright", "8"), ("neutral", "yes")):
        if page.locator(f"[name={name}]").count():
            page.locator(f"[name={name}]").select_option(answer)


class Observer:
    """Goes through the page of a session in a browser, and notes what was answered."""

    def __init__(self, page: Page, address: str) -> None:
        self.page = page
        self.elsewhere: list[str] = []
        self.faults: list[str] = []
        self.given: dict[int, str] = {}
        self._address = address
        page.on("request", lambda request: self._note(request.url))
        page.on("pageerror", lambda error: self.faults.append(str(error)))

    def open(self, code: str) -> None:
        """Open the page of a session."""
        self.page.goto(f"{self._address}/#{code}")

    def _note(self, url: str) -> None:
        if not url.startswith((self._address, "blob:", "data:")):
            self.elsewhere.append(url)

    def reach_the_trials(self) -> None:
        """Fill in whatever comes before the first trial, or the next one."""
        page = self.page
        while True:
            heading = page.locator("h1, .picture.reference").first
            heading.wait_for()
            if page.locator(".picture").count():
                return
            title = heading.inner_text()
            fill_in(page)
            page.locator("button[type=submit]").click()
            page.wait_for_function("title => document.querySelector('h1')?.innerText !== title", arg=title)

    @property
    def number(self) -> int:
        """The number of the trial that is shown; practice trials have none, and count as 0."""
        words = self.page.locator(".count").inner_text()
        return 0 if words == "Practice" else int(words.split()[0])

    def wait_until_asked(self) -> str:
        """Wait for a trial that may be answered, past pauses; return its reference's address."""
        page = self.page
        while True:
            page.locator(".choices button:enabled, h1").first.wait_for(timeout=60_000)
            if not page.locator("h1").count():
                return page.locator(".picture.reference").get_attribute("src")
            if page.locator("#thanks").count():
                return ""
            page.locator("button[type=submit]").click()
            page.locator("h1").wait_for(state="detached")

    def answer(self, side: str, key: bool = True) -> None:
        """Answer the trial that is shown."""
        place = int(self.page.locator(".controls progress").get_attribute("value")) + 1
        self.given[place] = side
        if key:
            self.page.keyboard.press({"left": "ArrowLeft", "right": "ArrowRight", "tie": "ArrowDown"}[side])
        else:
            self.page.locator(f"[data-choice={side}]").click()

    def wait_for_the_next(self) -> None:
        """Wait until the trial that was answered is gone."""
        done = max(self.given)
        self.page.wait_for_function(
            "done => document.querySelector('#thanks, h1')"
            " || Number(document.querySelector('.controls progress')?.value ?? -1) >= done",
            arg=done,
            timeout=60_000,
        )
