"""The interface for the page that an observer sees: one session, and nothing of any other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, HTTPException
from fastapi.responses import FileResponse

from impasto.psychophysics.experiment.server.access import DENIED, observer, served
from impasto.psychophysics.experiment.server.messages import (
    Answer,
    Digest,
    Next,
    Recorded,
    SessionInfo,
    Shown,
    StatedViewing,
    Step,
)
from impasto.psychophysics.experiment.server.state import Served
from impasto.psychophysics.experiment.sessions import Refused, Session, Trial

router = APIRouter(prefix="/api/session", tags=["session"], responses=DENIED)

Own = Annotated[Session, Depends(observer)]
State = Annotated[Served, Depends(served)]
_REFUSED: dict[int | str, dict[str, Any]] = {
    404: {"description": "There is no such trial in this session."},
    409: {"description": "The session does not allow this now."},
}


@router.get("")
def describe(session: Own, state: State) -> SessionInfo:
    """Say what the session is like and how far it is."""
    experiment = state.experiment
    done, answered, total = session.progress()
    sizes = [sample.size_px for sample in experiment.samples]
    return SessionInfo(
        **experiment.texts.model_dump(),
        **experiment.presentation.model_dump(include=set(SessionInfo.model_fields)),
        viewing=StatedViewing(**session.viewing),
        width_px=max(width for width, _ in sizes),
        height_px=max(height for _, height in sizes),
        done=done,
        answered=answered,
        total=total,
    )


@router.post("/steps", status_code=204)
def record_step(session: Own, step: Annotated[Step, Body()]) -> None:
    """Store what a step before the trials found."""
    session.record_step(step.name, step.model_dump(mode="json", exclude={"name"}))


@router.post("/next", responses={409: _REFUSED[409]})
def next_trial(session: Own) -> Next:
    """Return the first trial without an answer, the same one until it has an answer."""
    with _allowed():
        return Next(trial=_shown(session.next_trial()))


@router.post("/answers", responses=_REFUSED)
def record_answer(session: Own, answer: Answer) -> Recorded:
    """Store the answer to a trial, once, and return the next."""
    with _allowed():
        choice, already, following = session.answer(
            answer.token, answer.choice, answer.response_s, answer.window.model_dump()
        )
        return Recorded(choice=choice, already=already, trial=_shown(following))


@router.get(
    "/pictures/{digest}",
    response_class=FileResponse,
    responses={
        200: {"content": {"image/png": {}}},
        404: {"description": "There is no such picture."},
    },
)
def picture(session: Own, digest: Digest, state: State) -> FileResponse:
    """Return a picture."""
    if digest not in state.files:
        raise HTTPException(404, "there is no such picture")
    headers = {"Cache-Control": "private, max-age=86400, immutable"}
    return FileResponse(state.files[digest], media_type="image/png", headers=headers)


def _shown(trial: Trial | None) -> Shown | None:
    return None if trial is None else Shown(**{**asdict(trial), "ahead": list(trial.ahead)})


@contextmanager
def _allowed() -> Iterator[None]:
    """Turn what a session refuses into an answer that says so."""
    try:
        yield
    except Refused as error:
        raise HTTPException(404 if error.unknown else 409, str(error)) from error
