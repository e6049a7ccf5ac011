"""Observers, their sessions, and the way of a session: steps, trials one by one, answers."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import Connection, Engine, Row, delete, func, insert, select, update
from sqlalchemy.dialects import postgresql, sqlite

from impasto.errors import Problem
from impasto.psychophysics.experiment.database import about, now, reading, sessions, steps, trials
from impasto.psychophysics.experiment.manifest import (
    PHOTOGRAPH,
    Experiment,
    ExperimentError,
    Viewing,
    session_trials,
)
from impasto.psychophysics.scaling.trials import SIMULATED

Side = Literal["left", "right", "tie"]

# Without letters and digits that look alike; 16 of 32 are 80 bits.
_ALPHABET = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"
_CODE_LENGTH = 16
_AHEAD = 2


@dataclass(frozen=True)
class Invitation:
    """A session that waits for its observer.

    Parameters
    ----------
    observer : str
        Such as ``O007``.
    run : int
        1 for the observer's first session.
    code : str
        Opens the session, and no other.
    """

    observer: str
    run: int
    code: str


@dataclass(frozen=True)
class Trial:
    """A trial as the page may know it: pictures by their digest, and not what they are.

    Parameters
    ----------
    token : str
        Names it when it is answered.
    number, total : int
        Its place in the session, from 1.
    practice : bool
    pause : bool
        Whether a pause is due before it.
    reference, left, right : str
        Digests of the pictures.
    ahead : tuple of str
        Pictures that come soon.
    """

    token: str
    number: int
    total: int
    practice: bool
    pause: bool
    reference: str
    left: str
    right: str
    ahead: tuple[str, ...]


class Refused(Exception):
    """An answer or a request that the session does not allow.

    Parameters
    ----------
    reason : str
    unknown : bool
        Whether there is no such trial in the session, rather than one that cannot be answered now.
    """

    def __init__(self, reason: str, unknown: bool = False) -> None:
        super().__init__(reason)
        self.unknown = unknown


def invite_observers(
    engine: Engine,
    experiment: Experiment,
    *,
    observers: int = 1,
    runs: int = 1,
    again: str | None = None,
    simulated: bool = False,
    viewing: Viewing | None = None,
) -> list[Invitation]:
    """Make sessions and plan their trials.

    A session takes the lowest number that is free, so that sides and order stay even when the data of some
    observers were deleted.

    Parameters
    ----------
    engine : Engine
    experiment : Experiment
    observers : int, optional
        How many new ones.
    runs : int, optional
        Sessions of each.
    again : str, optional
        An observer who comes again, instead of new ones.
    simulated : bool, optional
        Whether they are no persons; their names say so in all results.
    viewing : Viewing, optional
        Conditions of these sessions, where they differ from the experiment's.

    Raises
    ------
    ExperimentError
        If there is no such observer.
    """
    with engine.begin() as connection:
        # Whoever invites at the same time waits here.
        last = int(
            connection.execute(
                select(about.c.value).where(about.c.key == "observers").with_for_update()
            ).scalar_one()
        )
        if again is None:
            prefix = f"{SIMULATED}-" if simulated else "O"
            names = [f"{prefix}{last + index + 1:03d}" for index in range(observers)]
            first_run = 1
            counted = update(about).where(about.c.key == "observers").values(value=str(last + observers))
            connection.execute(counted)
        else:
            names = [again]
            found = connection.scalar(select(func.max(sessions.c.run)).where(sessions.c.observer == again))
            if found is None:
                do = "The list of observers has their names"
                raise ExperimentError(Problem(f"observer {again}", "is not known", do))
            first_run = found + 1
        taken = set(connection.scalars(select(sessions.c.number)))
        made = []
        for name in names:
            for run in range(first_run, first_run + runs):
                number = next(number for number in range(len(taken) + 1) if number not in taken)
                taken.add(number)
                code = "".join(secrets.choice(_ALPHABET) for _ in range(_CODE_LENGTH))
                made.append(Invitation(name, run, code))
                _insert_session(connection, experiment, made[-1], number, viewing or experiment.viewing)
    return made


def _insert_session(
    connection: Connection, experiment: Experiment, invitation: Invitation, number: int, viewing: Viewing
) -> None:
    row = {
        "number": number,
        "observer": invitation.observer,
        "run": invitation.run,
        "code": invitation.code,
        "viewing": viewing.model_dump(),
        "created_at": now(),
    }
    (session_id,) = connection.execute(insert(sessions), row).inserted_primary_key  # type: ignore[misc]
    planned = [
        {
            "session_id": session_id,
            "position": position,
            "token": secrets.token_urlsafe(18),
            "kind": trial.kind,
            "sample": trial.pair.sample,
            "angle": trial.pair.angle,
            "condition_a": trial.pair.condition_a,
            "condition_b": trial.pair.condition_b,
            "a_left": trial.a_left,
        }
        for position, trial in enumerate(session_trials(experiment, number))
    ]
    connection.execute(insert(trials), planned)


def forget_observer(engine: Engine, observer: str) -> int:
    """Delete everything about an observer; return how many sessions that were."""
    with engine.begin() as connection:
        return connection.execute(delete(sessions).where(sessions.c.observer == observer)).rowcount


class Session:
    """A session, opened by its code.

    Parameters
    ----------
    engine : Engine
    experiment : Experiment
    row : Row
        Of the table of sessions.
    """

    def __init__(self, engine: Engine, experiment: Experiment, row: Row[Any]) -> None:
        self._engine = engine
        self._experiment = experiment
        self._pictures = experiment.pictures()
        self.id: int = row.id
        self.observer: str = row.observer
        self.viewing: dict[str, Any] = row.viewing

    @classmethod
    def by_code(cls, engine: Engine, experiment: Experiment, code: str) -> Session | None:
        """Return the session that a code opens, if there is one."""
        with reading(engine) as connection:
            row = connection.execute(select(sessions).where(sessions.c.code == code)).one_or_none()
        return None if row is None else cls(engine, experiment, row)

    def progress(self) -> tuple[list[str], int, int]:
        """Return the names of the steps that are done, the trials that are answered, and all trials."""
        with reading(self._engine) as connection:
            done = connection.scalars(select(steps.c.name).where(steps.c.session_id == self.id)).all()
            answered, total = connection.execute(
                select(func.count(trials.c.answered_at), func.count()).where(trials.c.session_id == self.id)
            ).one()
        return list(done), answered, total

    def record_step(self, name: str, data: dict[str, Any]) -> None:
        """Keep what a step before the trials found; a later one of the same name takes its place."""
        make = postgresql.insert if self._engine.dialect.name == "postgresql" else sqlite.insert
        values = {"data": data, "recorded_at": now()}
        statement = make(steps).values(session_id=self.id, name=name, **values)
        with self._engine.begin() as connection:
            connection.execute(
                statement.on_conflict_do_update(index_elements=["session_id", "name"], set_=values)
            )

    def next_trial(self) -> Trial | None:
        """Return the first trial without an answer, which counts as shown from now on; None after the last.

        Raises
        ------
        Refused
            If the observer has not consented.
        """
        with self._engine.begin() as connection:
            return self._next(connection)

    def answer(
        self, token: str, side: Side, response_s: float, window: dict[str, Any]
    ) -> tuple[Side, bool, Trial | None]:
        """Store an answer, unless the trial has one, and show the next trial, both in one transaction.

        Parameters
        ----------
        token : str
            Of the trial.
        side : {'left', 'right', 'tie'}
            Which candidate was chosen.
        response_s : float
            How long the pictures were seen.
        window : dict
            In which the pictures were seen.

        Returns
        -------
        side : {'left', 'right', 'tie'}
            The answer that the trial has now: the first that was given.
        already : bool
            Whether it had that one before.
        following : Trial or None
            As `next_trial` returns it.

        Raises
        ------
        Refused
            If the session has no such trial, it was not shown, or the answer is not allowed.
        """
        presentation = self._experiment.presentation
        if side == "tie" and not presentation.ties:
            raise Refused("this experiment asks for a choice")
        if response_s < presentation.minimum_view_s:
            raise Refused("the pictures were not seen for long enough")
        with self._engine.begin() as connection:
            own = (trials.c.token == token, trials.c.session_id == self.id)
            trial = connection.execute(select(trials).where(*own).with_for_update()).one_or_none()
            if trial is None:
                raise Refused("there is no such trial in this session", unknown=True)
            if trial.shown_at is None:
                raise Refused("this trial was not shown yet")
            if trial.choice is not None:
                return _side(trial.choice, trial.a_left), True, self._next(connection)
            values = {
                "choice": "tie" if side == "tie" else "AB"[(side == "left") != trial.a_left],
                "answered_at": now(),
                "response_s": response_s,
                "window": window,
            }
            connection.execute(update(trials).where(trials.c.id == trial.id).values(values))
            return side, False, self._next(connection)

    def _next(self, connection: Connection) -> Trial | None:
        consent = select(steps.c.name).where(steps.c.session_id == self.id, steps.c.name == "consent")
        if connection.scalar(consent) is None:
            raise Refused("the observer has not consented yet")
        rows = connection.execute(
            select(trials)
            .where(trials.c.session_id == self.id, trials.c.answered_at.is_(None))
            .order_by(trials.c.position)
            .limit(1 + _AHEAD)
        ).all()
        if not rows:
            return None
        trial, *later = rows
        if trial.shown_at is None:
            connection.execute(update(trials).where(trials.c.id == trial.id).values(shown_at=now()))
        total, rehearsals = connection.execute(
            select(func.count(), func.count().filter(trials.c.kind == "practice")).where(
                trials.c.session_id == self.id
            )
        ).one()
        every = self._experiment.presentation.break_every
        counted = trial.position - rehearsals
        reference, left, right = self._shown(trial)
        return Trial(
            token=trial.token,
            number=trial.position + 1,
            total=total,
            practice=trial.kind == "practice",
            pause=bool(every) and counted > 0 and counted % every == 0,
            reference=reference,
            left=left,
            right=right,
            ahead=tuple(dict.fromkeys(picture for row in later for picture in self._shown(row))),
        )

    def _shown(self, trial: Row[Any]) -> Sequence[str]:
        a, b = trial.condition_a, trial.condition_b
        conditions = (PHOTOGRAPH, *((a, b) if trial.a_left else (b, a)))
        return [self._pictures[trial.sample, trial.angle, condition] for condition in conditions]


def _side(choice: str, a_left: bool) -> Side:
    if choice == "tie":
        return "tie"
    return "left" if (choice == "A") == a_left else "right"
