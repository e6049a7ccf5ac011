"""Limits of size and rate, and the headers that every answer carries."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' blob: data:; connect-src 'self'; font-src 'self'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_KEPT_AT_MOST = 10_000


@dataclass(frozen=True)
class Limits:
    """How much is taken, and how often.

    Parameters
    ----------
    body_bytes : int
        Of a request.
    per_second, at_once : float
        Requests of one session or of the laboratory: in the long run, and in a burst.
    guesses_per_second, guesses_at_once : float
        Requests with a wrong code or token, from one address.
    """

    body_bytes: int = 16_384
    per_second: float = 20.0
    at_once: float = 200.0
    guesses_per_second: float = 0.2
    guesses_at_once: float = 20.0


class Rate:
    """Allow so many events per second for each key, with bursts.

    Parameters
    ----------
    per_second, at_once : float
    clock : callable, optional
        Seconds.
    """

    def __init__(
        self, per_second: float, at_once: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._per_second = per_second
        self._at_once = at_once
        self._clock = clock
        self._left: dict[str, tuple[float, float]] = {}
        self._lock = threading.Lock()

    def allows(self, key: str) -> bool:
        """Count an event, and return whether it is within the limit."""
        with self._lock:
            time_now = self._clock()
            left, before = self._left.pop(key, (self._at_once, time_now))
            left = min(self._at_once, left + (time_now - before) * self._per_second)
            allowed = left >= 1
            self._left[key] = (left - allowed, time_now)
            while len(self._left) > _KEPT_AT_MOST:  # the one that was not heard of for longest
                self._left.pop(next(iter(self._left)))
            return allowed


class Guard:
    """Refuse bodies that are too large, and send the headers with everything.

    Parameters
    ----------
    app : ASGI application
    body_bytes : int
    """

    def __init__(self, app: ASGIApp, body_bytes: int) -> None:
        self._app = app
        self._body_bytes = body_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers[name] = value
                # Answers and what the laboratory sees stay nowhere; pictures and pages say otherwise.
                headers.setdefault("Cache-Control", "no-store")
            await send(message)

        body = bytearray()
        while True:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            body += message.get("body", b"")
            if len(body) > self._body_bytes:
                await _refuse(guarded, self._body_bytes)
                return
            if not message.get("more_body"):
                break
        whole: list[Message] = [{"type": "http.request", "body": bytes(body), "more_body": False}]

        async def replay() -> Message:
            return whole.pop() if whole else await receive()

        await self._app(scope, replay, guarded)


async def _refuse(send: Send, body_bytes: int) -> None:
    detail = json.dumps({"detail": f"the request is larger than {body_bytes} bytes"}).encode()
    headers = [(b"content-type", b"application/json"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": 413, "headers": headers})
    await send({"type": "http.response.body", "body": detail})
