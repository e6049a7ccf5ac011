"""The interface for the laboratory: observers, progress, scale so far, answers, deletion."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, HTTPException, Response

from impasto.psychophysics.experiment.answers import (
    SessionState,
    answer_rows,
    answers_csv,
    answers_json,
    session_states,
)
from impasto.psychophysics.experiment.live_scale import LiveScale, live_scale
from impasto.psychophysics.experiment.manifest import ExperimentError
from impasto.psychophysics.experiment.server.access import DENIED, laboratory
from impasto.psychophysics.experiment.server.messages import Forgotten, Invite, Invited, Observer
from impasto.psychophysics.experiment.server.state import Served
from impasto.psychophysics.experiment.sessions import forget_observer, invite_observers

router = APIRouter(prefix="/api/admin", tags=["laboratory"], responses=DENIED)

Laboratory = Annotated[Served, Depends(laboratory)]
_UNKNOWN: dict[int | str, dict[str, Any]] = {404: {"description": "There is no such observer."}}


@router.get("/experiment")
def describe(served: Laboratory) -> dict[str, Any]:
    """Return the description of the experiment, without its list of pictures."""
    return served.experiment.model_dump(mode="json", exclude={"stimuli", "pairs"})


@router.get("/sessions")
def list_sessions(served: Laboratory) -> list[SessionState]:
    """Return how far each session is."""
    return session_states(served.engine)


@router.get("/scale")
def scale_so_far(served: Laboratory) -> LiveScale:
    """Return the scale that the answers so far give, all samples and angles pooled."""
    return live_scale(served.engine, served.experiment)


@router.post("/observers", responses=_UNKNOWN)
def invite(served: Laboratory, wanted: Annotated[Invite, Body()]) -> list[Invited]:
    """Invite new observers, or one of them again."""
    try:
        made = invite_observers(
            served.engine,
            served.experiment,
            observers=wanted.observers,
            runs=wanted.sessions,
            again=wanted.again,
            viewing=None if wanted.viewing is None else wanted.viewing.stated(),
        )
    except ExperimentError as error:
        raise HTTPException(404, str(error)) from error
    return [Invited(observer=entry.observer, session=entry.run, code=entry.code) for entry in made]


@router.delete("/observers/{observer}", responses=_UNKNOWN)
def forget(served: Laboratory, observer: Observer) -> Forgotten:
    """Delete everything about an observer."""
    deleted = forget_observer(served.engine, observer)
    if not deleted:
        raise HTTPException(404, "there is no such observer")
    return Forgotten(sessions=deleted)


@router.get("/answers.csv", response_class=Response, responses={200: {"content": {"text/csv": {}}}})
def as_csv(served: Laboratory) -> Response:
    """Return the answers, one row per trial."""
    return Response(answers_csv(answer_rows(served.engine)), media_type="text/csv")


@router.get("/answers.json")
def as_json(served: Laboratory) -> dict[str, Any]:
    """Return the experiment, its sessions and their answers."""
    return answers_json(served.engine, served.experiment)
