"""Show a painting in a browser, from its store as it lies."""

from __future__ import annotations

import json
import mimetypes
import re
import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from os import PathLike
from pathlib import Path
from urllib.parse import unquote, urlsplit

from impasto.errors import ImpastoError, OptionError, Problem
from impasto.publish import STORE_NAME
from impasto.publish.pages import page_files
from impasto.publish.publication import Publication

_CHUNK = re.compile(r"(.+)/c/(\d+(?:/\d+)*)")


@dataclass(frozen=True)
class ViewSummary:
    """What `view` served.

    Parameters
    ----------
    store : Path
    url : str
        Where the page was.
    models : tuple of str
        The models it offered.
    """

    store: Path
    url: str
    models: tuple[str, ...]


def view(
    store: str | PathLike[str],
    *,
    models: Sequence[str] = (),
    port: int = 0,
    open_browser: bool = True,
    say: Callable[[str], None] = print,
) -> ViewSummary:
    """Serve a page that relights the painting, on this machine alone, until interrupted.

    Nothing is written: pieces of the store are packed when the page asks for them.

    Parameters
    ----------
    store : path
        Store with at least one complete fit.
    models : sequence of str, optional
        Which fits, the first to be shown first; all by default.
    port : int, optional
        Port on the loopback address; a free one by default.
    open_browser : bool, optional
        Whether to open the page.
    say : callable, optional
        Called with the address.

    Returns
    -------
    ViewSummary

    Raises
    ------
    OptionError
        If there is no such model, no fit, or the port cannot be used.
    StoreError
        If the store, its stack or a fit cannot be used.
    OutputError
        If the package was installed without its pages.
    """
    with serve(store, models=models, port=port) as server:
        say(f"{server.url} shows {Path(store)}; Ctrl-C ends it")
        if open_browser:
            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            say("")
        return ViewSummary(Path(store), server.url, server.models)


class Server(ThreadingHTTPServer):
    """Serves the page and the pieces of one painting on the loopback address."""

    daemon_threads = True

    def __init__(self, publication: Publication, port: int) -> None:
        self.models = tuple(entry["name"] for entry in publication.attributes["models"])
        handler = partial(_Handler, page_files(), publication, dict(publication.documents()))
        super().__init__(("127.0.0.1", port), handler)

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://127.0.0.1:{self.server_address[1]}/"


def serve(store: str | PathLike[str], *, models: Sequence[str] = (), port: int = 0) -> Server:
    """Return a server for the page of a store, ready for `serve_forever`; see `view`."""
    publication = Publication(Path(store), models=models)
    try:
        return Server(publication, port)
    except OSError as error:
        what = f"cannot be used: {error.strerror}"
        raise OptionError(
            Problem(f"--port {port}", what, "Choose another, or none for a free one")
        ) from error


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def __init__(
        self,
        pages: dict[str, Path],
        publication: Publication,
        documents: dict[str, dict[str, object]],
        *arguments: object,
    ) -> None:
        self._pages = pages
        self._publication = publication
        self._documents = documents
        super().__init__(*arguments)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        """Answer with a file of the page or a piece of the store."""
        # A page of another name that leads to this address must not read the painting.
        if (self.headers.get("Host") or "").partition(":")[0] not in ("127.0.0.1", "localhost"):
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        path = unquote(urlsplit(self.path).path).lstrip("/") or "index.html"
        try:
            found = self._piece(path)
        except ImpastoError as error:
            self._answer(HTTPStatus.INTERNAL_SERVER_ERROR, "text/plain; charset=utf-8", str(error).encode())
            return
        if found is None:
            self.send_error(HTTPStatus.NOT_FOUND)
        else:
            self._answer(HTTPStatus.OK, *found)

    do_HEAD = do_GET

    def _piece(self, path: str) -> tuple[str, bytes] | None:
        if path in self._pages:
            # Windows may take .js for text/plain.
            kind = {".js": "text/javascript"}.get(Path(path).suffix) or mimetypes.guess_type(path)[0]
            return kind or "application/octet-stream", self._pages[path].read_bytes()
        folder, _, key = path.partition("/")
        if folder != STORE_NAME:
            return None
        name = key.removesuffix("zarr.json").rstrip("/")
        if key.endswith("zarr.json") and name in self._documents:
            return "application/json", json.dumps(self._documents[name]).encode()
        chunk = _CHUNK.fullmatch(key)
        array = self._publication.arrays.get(chunk[1]) if chunk else None
        if chunk is None or array is None:
            return None
        number = tuple(map(int, chunk[2].split("/")))
        if len(number) != len(array.grid) or not all(a < b for a, b in zip(number, array.grid, strict=True)):
            return None
        return "application/octet-stream", self._publication.chunk(chunk[1], number)

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-cache")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *arguments: object) -> None:
        """Keep quiet: the terminal belongs to the person who started it."""
