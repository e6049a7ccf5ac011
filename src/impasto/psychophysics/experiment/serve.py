"""Serve an experiment to its observers."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from os import PathLike
from pathlib import Path

from impasto.errors import OptionError, Problem
from impasto.listening import listen, shown_host
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import ExperimentError, read_experiment
from impasto.psychophysics.experiment.server.app import WEB, make_app
from impasto.psychophysics.experiment.server.limits import Limits
from impasto.psychophysics.experiment.server.state import Served

TOKEN_VARIABLE = "IMPASTO_ADMIN_TOKEN"
TOKEN_FILE = "admin-token.txt"
_SHORTEST_TOKEN = 16


def serve(
    experiment: str | PathLike[str],
    *,
    database: str | None = None,
    host: str = "127.0.0.1",
    port: int = 8000,
    certificate: str | PathLike[str] | None = None,
    key: str | PathLike[str] | None = None,
    say: Callable[[str], None] = print,
) -> None:
    """Serve an experiment until the process is told to end.

    Every answer is in the database before it is acknowledged: the process may be killed at any moment.

    Parameters
    ----------
    experiment : path
        Folder that `create` made.
    database : str, optional
        ``postgresql://user:password@host/name``; a file in the folder by default.
    host : str, optional
        Address to listen at; ``0.0.0.0`` for all of this machine's.
    port : int, optional
        0 for any that is free.
    certificate, key : path, optional
        Files in PEM format, for https.
    say : callable, optional
        Called with lines that say where the pages are.

    Returns
    -------
    None

    Raises
    ------
    ExperimentError
        If the experiment or its database cannot be used, or the pages were not built.
    OptionError
        If the address is taken or is not one of this machine's.
    """
    import uvicorn

    folder = Path(experiment)
    described = read_experiment(folder)
    if not (WEB / "experiment.html").is_file():
        do = "Install the package from a wheel, or build the pages with: make src/impasto/web/.built"
        raise ExperimentError(Problem(str(WEB), "the pages are not built", do))
    engine = open_database(database_url(database, folder), described)
    token = admin_token(folder)
    app = make_app(Served(folder, described, engine, token, Limits()))
    listening = listen(host, port)
    scheme = "https" if certificate else "http"
    address = f"{scheme}://{shown_host(host)}:{listening.getsockname()[1]}"
    say(f"{described.texts.title}: {address}/#CODE for observers, CODE as impasto experiment invite gives it")
    say(f"laboratory: {address}/admin#{token}")
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,  # addresses of observers are kept nowhere
        server_header=False,
        ssl_certfile=None if certificate is None else str(certificate),
        ssl_keyfile=None if key is None else str(key),
        timeout_graceful_shutdown=5,
    )
    try:
        uvicorn.Server(config).run(sockets=[listening])
    finally:
        listening.close()
        engine.dispose()


def admin_token(folder: Path) -> str:
    """Return the laboratory's token: of the environment, or of a file that is made when it is first needed.

    Raises
    ------
    OptionError
        If the environment has one that can be guessed.
    """
    given = os.environ.get(TOKEN_VARIABLE)
    if given is not None:
        if len(given) < _SHORTEST_TOKEN or not given.isascii():
            what = f"is no token of at least {_SHORTEST_TOKEN} plain letters and digits"
            raise OptionError(Problem(TOKEN_VARIABLE, what, "Choose a longer one, or leave it out"))
        return given
    path = folder / TOKEN_FILE
    try:
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(secrets.token_urlsafe(24))
    except FileExistsError:
        pass
    return path.read_text().strip()
