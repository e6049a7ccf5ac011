"""Serve the page for a tablet at the stand: what the desk shows, and the answers to what it asks."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from impasto.listening import listen, shown_host
from impasto.stand.desk import Desk

_HERE = Path(__file__).parent
_FILES = {"": "page.html", "page.js": "page.js", "page.css": "page.css"}
# A page that has heard nothing for so long asks again, so that it notices a lost connection.
_WAIT_S = 5.0
_TYPES = {"photograph.jpg": "image/jpeg", "clipped.png": "image/png"}
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'",
}
_MOST_BYTES = 1000


@contextmanager
def serve_page(desk: Desk, host: str = "127.0.0.1", port: int = 0) -> Iterator[str]:
    """Serve the page while the block runs.

    Parameters
    ----------
    desk : Desk
    host : str, optional
        Address to listen at.
    port : int, optional
        0 for any that is free.

    Yields
    ------
    str
        The page's address, with a token that nobody can guess.

    Raises
    ------
    OptionError
        If the address cannot be listened at.
    """
    import uvicorn

    listening = listen(host, port)
    token = secrets.token_urlsafe(16)
    config = uvicorn.Config(
        make_app(desk, token),
        log_level="critical",  # a page that still waits when the run ends is no fault
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    try:
        yield f"http://{shown_host(host)}:{listening.getsockname()[1]}/{token}/"
    finally:
        desk.show(ended=True)
        server.should_exit = True
        thread.join(5)
        listening.close()


def make_app(desk: Desk, token: str) -> Starlette:
    """Return the application: everything lies below the token, and there is nothing elsewhere."""
    endpoints: dict[str, tuple[Callable[[Request], Awaitable[Response]], str]] = {
        **{name: (_sender(_HERE / file), "GET") for name, file in _FILES.items()},
        "state": (_state(desk), "GET"),
        "answer": (_answer(desk), "POST"),
        "stop": (_stop(desk), "POST"),
        "picture/{name}": (_picture(desk), "GET"),
    }

    def known(endpoint: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
        async def answer(request: Request) -> Response:
            if not secrets.compare_digest(request.path_params["token"].encode(), token.encode()):
                return Response(status_code=404)
            response = await endpoint(request)
            response.headers.update(_HEADERS)
            return response

        return answer

    return Starlette(
        routes=[
            Route(f"/{{token}}/{path}", known(endpoint), methods=[method])
            for path, (endpoint, method) in endpoints.items()
        ]
    )


def _sender(file: Path) -> Callable[[Request], Awaitable[Response]]:
    async def send(request: Request) -> Response:
        return FileResponse(file)

    return send


def _state(desk: Desk) -> Callable[[Request], Awaitable[Response]]:
    async def state(request: Request) -> Response:
        try:
            version = int(request.query_params.get("after", -1))
        except ValueError:
            return Response(status_code=400)
        return JSONResponse(await run_in_threadpool(desk.seen_after, version, _WAIT_S))

    return state


def _answer(desk: Desk) -> Callable[[Request], Awaitable[Response]]:
    async def answer(request: Request) -> Response:
        if len(body := await request.body()) > _MOST_BYTES:
            return Response(status_code=413)
        # Two words: the question's number, and the choice.
        number, _, choice = body.decode(errors="replace").partition(" ")
        if not number.isdecimal() or not desk.answer(int(number), choice):
            return Response(status_code=409)
        return Response(status_code=204)

    return answer


def _stop(desk: Desk) -> Callable[[Request], Awaitable[Response]]:
    async def stop(request: Request) -> Response:
        desk.stop()
        return Response(status_code=204)

    return stop


def _picture(desk: Desk) -> Callable[[Request], Awaitable[Response]]:
    async def picture(request: Request) -> Response:
        name = request.path_params["name"]
        data = desk.pictures.get(name)
        return Response(status_code=404) if data is None else Response(data, media_type=_TYPES[name])

    return picture
