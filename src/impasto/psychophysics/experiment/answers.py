"""The answers as data: one row per trial, and all that is known about each session."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Engine, Row, func, select

from impasto.psychophysics.experiment.database import reading, sessions, steps, trials
from impasto.psychophysics.experiment.manifest import Experiment

COLUMNS = (
    "observer",
    "session",
    "sample",
    "angle",
    "condition_A",
    "condition_B",
    "side",
    "choice",
    "time",
    "display",
    "kind",
    "place",
    "answered_at",
)
"""Of the table of answers. `side` is where A stood, `time` the response time in seconds, `kind` says whether
the trial is one of the pairs, a repeat, a catch trial or practice, `place` is its number in the session."""


@dataclass(frozen=True)
class SessionState:
    """How far a session is, and how its observer answers.

    Parameters
    ----------
    observer : str
    session : int
    code : str
    display : str
        As the observer or the laboratory calls it.
    steps : tuple of str
        What was done before the trials.
    answered, total : int
        Trials, of all kinds.
    catches, caught : int
        Catch trials answered, and those answered right.
    repeats, repeated : int
        Repeats answered, and those answered as the first time.
    last_answer_at : str or None
        Time of the last answer.
    """

    observer: str
    session: int
    code: str
    display: str
    steps: tuple[str, ...]
    answered: int
    total: int
    catches: int
    caught: int
    repeats: int
    repeated: int
    last_answer_at: str | None


def answer_rows(engine: Engine, *, kinds: Iterable[str] | None = None) -> list[dict[str, Any]]:
    """Return a row for each answer, in the order of observers, sessions and trials.

    Parameters
    ----------
    engine : Engine
    kinds : iterable of str, optional
        Which kinds of trials; all by default.

    Returns
    -------
    list of dict
        With the keys `COLUMNS`.
    """
    query = (
        select(sessions, trials, steps.c.data.label("stated"))
        .join(trials, trials.c.session_id == sessions.c.id)
        .outerjoin(steps, (steps.c.session_id == sessions.c.id) & (steps.c.name == "viewing"))
        .where(trials.c.choice.is_not(None))
        .order_by(sessions.c.observer, sessions.c.run, trials.c.position)
    )
    if kinds is not None:
        query = query.where(trials.c.kind.in_(list(kinds)))
    with reading(engine) as connection:
        return [_answer_row(row) for row in connection.execute(query)]


def _answer_row(row: Row[Any]) -> dict[str, Any]:
    return {
        "observer": row.observer,
        "session": row.run,
        "sample": row.sample,
        "angle": row.angle,
        "condition_A": row.condition_a,
        "condition_B": row.condition_b,
        "side": "left" if row.a_left else "right",
        "choice": row.choice,
        "time": round(row.response_s, 3),
        "display": (row.stated or row.viewing)["display"],
        "kind": row.kind,
        "place": row.position + 1,
        "answered_at": row.answered_at.strftime("%Y-%m-%dT%H:%M:%SZ"),
    }


def answers_csv(rows: Iterable[dict[str, Any]]) -> str:
    """Return rows of answers as CSV, with a line of the columns' names.

    Texts that a spreadsheet would take for a formula begin with an apostrophe.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _no_formula(value) for key, value in row.items()} for row in rows)
    return text.getvalue()


def _no_formula(value: Any) -> Any:
    # Angles such as -30 are numbers, and names of displays come from outside.
    if isinstance(value, str) and value[:1] in "=+-@\t\r" and not _is_number(value):
        return f"'{value}"
    return value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def answers_json(engine: Engine, experiment: Experiment) -> dict[str, Any]:
    """Return the experiment, each session with its steps, and each answer, as JSON can hold them."""
    with reading(engine) as connection:
        rows = connection.execute(select(sessions).order_by(sessions.c.observer, sessions.c.run)).all()
        found = connection.execute(select(steps)).all()
        windows = {
            (row.session_id, row.position + 1): row.window
            for row in connection.execute(select(trials.c.session_id, trials.c.position, trials.c.window))
        }
    answers = answer_rows(engine)
    by_session: dict[tuple[str, int], list[dict[str, Any]]] = {}
    for answer in answers:
        by_session.setdefault((answer.pop("observer"), answer.pop("session")), []).append(answer)
    return {
        "experiment": experiment.model_dump(mode="json"),
        "sessions": [
            {
                "observer": row.observer,
                "session": row.run,
                "number": row.number,
                "viewing": row.viewing,
                "steps": {step.name: step.data for step in found if step.session_id == row.id},
                "answers": [
                    {**answer, "window": windows[row.id, answer["place"]]}
                    for answer in by_session.get((row.observer, row.run), [])
                ],
            }
            for row in rows
        ],
    }


def session_states(engine: Engine) -> list[SessionState]:
    """Return how far each session is, in the order of observers."""
    counts = select(
        trials.c.session_id,
        func.count(trials.c.choice).label("answered"),
        func.count().label("total"),
        func.max(trials.c.answered_at).label("last"),
    ).group_by(trials.c.session_id)
    checks = select(trials).where(trials.c.choice.is_not(None)).order_by(trials.c.position)
    with reading(engine) as connection:
        rows = connection.execute(select(sessions).order_by(sessions.c.observer, sessions.c.run)).all()
        found = connection.execute(select(steps)).all()
        counted = {row.session_id: row for row in connection.execute(counts)}
        answered: dict[int, list[Row[Any]]] = {}
        for trial in connection.execute(checks):
            answered.setdefault(trial.session_id, []).append(trial)
    states = []
    for row in rows:
        own = {step.name: step.data for step in found if step.session_id == row.id}
        count = counted[row.id]
        given = answered.get(row.id, [])
        catches = [trial.choice == "A" for trial in given if trial.kind == "catch"]
        first = {_pair(trial): trial.choice for trial in given if trial.kind == "test"}
        repeats = [trial.choice == first.get(_pair(trial)) for trial in given if trial.kind == "repeat"]
        states.append(
            SessionState(
                observer=row.observer,
                session=row.run,
                code=row.code,
                display=own.get("viewing", row.viewing)["display"],
                steps=tuple(own),
                answered=count.answered,
                total=count.total,
                catches=len(catches),
                caught=sum(catches),
                repeats=len(repeats),
                repeated=sum(repeats),
                last_answer_at=count.last.strftime("%Y-%m-%d %H:%M:%SZ") if count.last else None,
            )
        )
    return states


def _pair(trial: Row[Any]) -> tuple[str, str, str, str]:
    return trial.sample, trial.angle, trial.condition_a, trial.condition_b
