"""The application: both interfaces and the pages, behind limits."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from sqlalchemy.exc import DBAPIError, TimeoutError
from starlette.types import ASGIApp

import impasto
from impasto.psychophysics.experiment.server import admin, observers
from impasto.psychophysics.experiment.server.limits import Guard
from impasto.psychophysics.experiment.server.state import Served

WEB = Path(impasto.__file__).parent / "web"
"""The built pages, which the package carries."""

_PAGES = {"/": "experiment.html", "/admin": "experiment-admin.html"}
_TYPES = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".woff2": "font/woff2"}


def make_app(served: Served, web: Path = WEB) -> ASGIApp:
    """Return the application that serves an experiment.

    Parameters
    ----------
    served : Served
    web : Path, optional
        Folder of the built pages.
    """
    app = FastAPI(
        title="impasto experiment",
        version=impasto.__version__,
        description="Paired comparisons of renderings with photographs.",
        openapi_url="/api/openapi.json",
        docs_url=None,  # those pages would be loaded from elsewhere
        redoc_url=None,
    )
    app.state.served = served
    app.include_router(observers.router)
    app.include_router(admin.router)
    app.add_exception_handler(RequestValidationError, _not_understood)
    app.add_exception_handler(DBAPIError, _database_away)
    app.add_exception_handler(TimeoutError, _database_away)
    for address, file in _files(web).items():
        app.add_api_route(address, _sender(file), methods=["GET", "HEAD"], include_in_schema=False)
    return Guard(app, served.limits.body_bytes)


def _files(web: Path) -> Mapping[str, Path]:
    """Return the files of the pages by their address; what is not in this list is not served."""
    files = {address: web / name for address, name in _PAGES.items()}
    files |= {
        f"/{path.relative_to(web).as_posix()}": path
        for path in sorted(web.rglob("*"))
        if path.is_file() and path.suffix in _TYPES
    }
    return files


def _sender(file: Path):  # type: ignore[no-untyped-def]
    media_type = _TYPES.get(file.suffix, "text/html")
    # Names in assets/ change with their contents.
    age = "max-age=31536000, immutable" if file.parent.name == "assets" else "no-cache"

    def send() -> FileResponse:
        return FileResponse(file, media_type=media_type, headers={"Cache-Control": age})

    return send


def _not_understood(request: Request, error: Exception) -> Response:
    """Say what is wrong with a request, without sending back what it held, which no text may be able to."""
    assert isinstance(error, RequestValidationError)
    detail = [{key: entry[key] for key in ("loc", "msg", "type")} for entry in error.errors()]
    return Response(json.dumps({"detail": detail}), 422, media_type="application/json")


def _database_away(request: Request, error: Exception) -> JSONResponse:
    """Say that the page should ask again: it keeps the answer until it is stored."""
    detail = "the database does not answer; ask again"
    return JSONResponse({"detail": detail}, 503, {"Retry-After": "2"})
