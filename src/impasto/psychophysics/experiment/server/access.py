"""Who may ask: an observer with the code of a session, the laboratory with its token.

Both come in the header ``Authorization``, which no page of another site can make a browser send; there are no
cookies, so nothing can be asked for in somebody's name.
"""

from __future__ import annotations

import hmac
import re
from typing import Annotated, Any

from fastapi import HTTPException, Request, Security
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from impasto.psychophysics.experiment.server.limits import Rate
from impasto.psychophysics.experiment.server.state import Served
from impasto.psychophysics.experiment.sessions import Session

_CODE = HTTPBearer(scheme_name="code", description="The code of a session.", auto_error=False)
_TOKEN = HTTPBearer(scheme_name="token", description="The laboratory's token.", auto_error=False)

Credentials = HTTPAuthorizationCredentials | None

DENIED: dict[int | str, dict[str, Any]] = {
    401: {"description": "The code or token is missing or wrong."},
    429: {"description": "Too many requests."},
}


def served(request: Request) -> Served:
    """Return what the server serves."""
    found: Served = request.app.state.served
    return found


def observer(request: Request, credentials: Annotated[Credentials, Security(_CODE)]) -> Session:
    """Return the session that the request's code opens.

    Raises
    ------
    HTTPException
        401 if there is none, 429 if it asks too often.
    """
    state = served(request)
    # As it is read out or typed: small letters, groups of four.
    code = re.sub(r"[\s-]", "", credentials.credentials if credentials else "").upper()
    session = None
    if re.fullmatch(r"[0-9A-Z]{1,40}", code):
        session = Session.by_code(state.engine, state.experiment, code)
    if session is None:
        raise _denied(request, state.guesses, "this code opens no session")
    _within(state.requests, f"session {session.id}")
    return session


def laboratory(request: Request, credentials: Annotated[Credentials, Security(_TOKEN)]) -> Served:
    """Return what the server serves, if the request has the laboratory's token.

    Raises
    ------
    HTTPException
        401 if it has not, 429 if it asks too often.
    """
    state = served(request)
    given = credentials.credentials if credentials else ""
    if not hmac.compare_digest(given.encode("utf-8", "replace"), state.admin_token.encode()):
        raise _denied(request, state.guesses, "this is not the laboratory's token")
    _within(state.requests, "laboratory")
    return state


def _denied(request: Request, guesses: Rate, detail: str) -> HTTPException:
    if not guesses.allows(request.client.host if request.client else ""):
        return _too_many()
    return HTTPException(401, detail, {"WWW-Authenticate": "Bearer"})


def _within(requests: Rate, key: str) -> None:
    if not requests.allows(key):
        raise _too_many()


def _too_many() -> HTTPException:
    return HTTPException(429, "too many requests; wait a little", {"Retry-After": "5"})
