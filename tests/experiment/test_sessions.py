"""Sessions on both databases: nothing is lost, nothing counts twice, and nobody sees another's."""

import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import pytest
from laboratory import WINDOW

from impasto.psychophysics.experiment.answers import (
    COLUMNS,
    answer_rows,
    answers_csv,
    answers_json,
    session_states,
)
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import ExperimentError, session_trials
from impasto.psychophysics.experiment.sessions import (
    Refused,
    Session,
    forget_observer,
    invite_observers,
)


def opened(engine, experiment, invitation, consent=True):
    session = Session.by_code(engine, experiment, invitation.code)
    assert session is not None
    if consent:
        session.record_step("consent", {"agreed": True})
    return session


@pytest.fixture
def session(engine, experiment):
    return opened(engine, experiment, *invite_observers(engine, experiment))


def run_to_the_end(session, side="left"):
    shown = []
    while trial := session.next_trial():
        shown.append(trial)
        session.answer(trial.token, side, 0.9, WINDOW)
    return shown


def test_a_session_shows_what_was_planned(session, engine, experiment):
    planned = session_trials(experiment, 0)
    pictures = experiment.pictures()
    shown = run_to_the_end(session)
    assert [trial.number for trial in shown] == list(range(1, len(planned) + 1))
    for trial, plan in zip(shown, planned, strict=True):
        pair = plan.pair
        left, right = [pair.condition_a, pair.condition_b][:: 1 if plan.a_left else -1]
        expected = [pictures[pair.sample, pair.angle, name] for name in ("photograph", left, right)]
        assert [trial.reference, trial.left, trial.right] == expected
        assert trial.practice == (plan.kind == "practice")
    rows = answer_rows(engine)
    assert [row["choice"] for row in rows] == ["A" if plan.a_left else "B" for plan in planned]
    assert [row["side"] for row in rows] == ["left" if plan.a_left else "right" for plan in planned]
    assert [row["kind"] for row in rows] == [plan.kind for plan in planned]


def test_pauses_come_after_every_third_trial(session):
    assert [trial.number for trial in run_to_the_end(session) if trial.pause] == [6, 9]


def test_coming_pictures_are_announced(session):
    shown = run_to_the_end(session)
    for trial, following in pairwise(shown):
        assert {following.reference, following.left, following.right} <= set(trial.ahead)


def test_an_answer_counts_once(session, engine):
    trial = session.next_trial()
    assert session.answer(trial.token, "left", 1.0, WINDOW)[:2] == ("left", False)
    assert session.answer(trial.token, "left", 1.0, WINDOW)[:2] == ("left", True)
    assert session.answer(trial.token, "right", 9.0, WINDOW)[:2] == ("left", True)
    (row,) = answer_rows(engine)
    assert row["time"] == 1.0


def test_an_answer_sent_many_times_at_once_counts_once(session, engine):
    trial = session.next_trial()
    start = threading.Barrier(8)

    def send(side):
        start.wait()
        return session.answer(trial.token, side, 1.0, WINDOW)[:2]

    with ThreadPoolExecutor(8) as pool:
        given = list(pool.map(send, ["left", "right"] * 4))
    assert [already for _, already in given].count(False) == 1
    assert len({side for side, _ in given}) == 1
    assert len(answer_rows(engine)) == 1


def test_the_same_trial_is_next_until_it_is_answered(session):
    first = session.next_trial()
    assert session.next_trial() == first
    _, _, following = session.answer(first.token, "tie", 1.0, WINDOW)
    assert session.next_trial() == following
    assert following.number == first.number + 1


def test_what_is_refused(session, engine, experiment):
    trial = session.next_trial()
    with pytest.raises(Refused, match="long enough"):
        session.answer(trial.token, "left", 0.1, WINDOW)
    with pytest.raises(Refused, match="no such trial"):
        session.answer("nothing", "left", 1.0, WINDOW)
    other = opened(engine, experiment, *invite_observers(engine, experiment))
    with pytest.raises(Refused, match="no such trial"):
        other.answer(trial.token, "left", 1.0, WINDOW)
    from sqlalchemy import select

    from impasto.psychophysics.experiment.database import trials

    with engine.connect() as connection:
        unseen = connection.scalar(
            select(trials.c.token).where(trials.c.session_id == session.id, trials.c.position == 5)
        )
    with pytest.raises(Refused, match="not shown yet"):
        session.answer(unseen, "left", 1.0, WINDOW)
    assert answer_rows(engine) == []


def test_nothing_is_shown_before_consent(engine, experiment):
    session = opened(engine, experiment, *invite_observers(engine, experiment), consent=False)
    with pytest.raises(Refused, match="consented"):
        session.next_trial()


def test_ties_are_refused_where_a_choice_is_asked_for(session, experiment):
    forced = experiment.presentation.model_copy(update={"ties": False})
    session._experiment = experiment.model_copy(update={"presentation": forced})
    with pytest.raises(Refused, match="asks for a choice"):
        session.answer(session.next_trial().token, "tie", 1.0, WINDOW)


def test_observers_come_again_and_are_forgotten(engine, experiment):
    first, second = invite_observers(engine, experiment, observers=2)
    (again,) = invite_observers(engine, experiment, again=first.observer)
    assert [(first.observer, first.run), (again.observer, again.run)] == [("O001", 1), ("O001", 2)]
    run_to_the_end(opened(engine, experiment, first))
    run_to_the_end(opened(engine, experiment, second))
    states = session_states(engine)
    assert [(state.observer, state.session, state.answered) for state in states] == [
        ("O001", 1, 10),
        ("O001", 2, 0),
        ("O002", 1, 10),
    ]
    assert forget_observer(engine, "O001") == 2
    assert {row["observer"] for row in answer_rows(engine)} == {"O002"}
    assert Session.by_code(engine, experiment, first.code) is None
    # The free place is taken again, so that sides stay even; the name is not.
    (next_one,) = invite_observers(engine, experiment)
    assert next_one.observer == "O003"
    shown = run_to_the_end(opened(engine, experiment, next_one))
    assert shown[0].practice
    numbers = [entry["number"] for entry in answers_json(engine, experiment)["sessions"]]
    assert sorted(numbers) == [0, 1]
    with pytest.raises(ExperimentError, match="not known"):
        invite_observers(engine, experiment, again="O001")


def test_observers_invited_at_the_same_time_get_places_of_their_own(engine, experiment):
    with ThreadPoolExecutor(6) as pool:
        made = list(pool.map(lambda _: invite_observers(engine, experiment, observers=2), range(6)))
    assert len({entry.observer for group in made for entry in group}) == 12
    numbers = [entry["number"] for entry in answers_json(engine, experiment)["sessions"]]
    assert sorted(numbers) == list(range(12))


def test_states_tell_careful_observers_from_careless_ones(engine, experiment):
    (invitation,) = invite_observers(engine, experiment)
    session = opened(engine, experiment, invitation)
    kinds = [plan.kind for plan in session_trials(experiment, 0)]
    run_to_the_end(session, side="left")
    (state,) = session_states(engine)
    assert (state.catches, state.repeats) == (kinds.count("catch"), 2)
    # The sides of a repeat are exchanged: who always answers left contradicts himself.
    assert state.repeated == 0


def test_simulated_observers_are_named_so(engine, experiment):
    (invitation,) = invite_observers(engine, experiment, simulated=True)
    assert invitation.observer == "simulated-001"


def test_the_table_of_answers(session, engine, experiment):
    session.record_step("viewing", {**session.viewing, "display": "=EIZO, second shelf"})
    run_to_the_end(session)
    header, *lines = answers_csv(answer_rows(engine)).splitlines()
    assert tuple(header.split(",")) == COLUMNS
    assert len(lines) == 10
    # A spreadsheet must not compute what somebody typed.
    assert all('"\'=EIZO, second shelf"' in line for line in lines)
    data = answers_json(engine, experiment)
    (entry,) = data["sessions"]
    assert entry["answers"][0]["window"] == WINDOW
    assert entry["steps"]["consent"] == {"agreed": True}


def test_answers_to_another_experiment_are_refused(engine, database, experiment, tmp_path):
    other = experiment.model_copy(update={"seed": 99})
    with pytest.raises(ExperimentError, match="another experiment"):
        open_database(database_url(database, tmp_path), other)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("nonsense", "not the address"),
        ("mysql://localhost/x", "not supported"),
        ("postgresql://nobody:secret@127.0.0.1:9/none", "cannot be used"),
        ("sqlite:////nowhere/at/all.sqlite", "cannot be used"),
    ],
)
def test_databases_that_cannot_be_used(experiment, tmp_path, address, message):
    with pytest.raises(ExperimentError, match=message) as raised:
        open_database(database_url(address, tmp_path), experiment)
    assert "secret" not in str(raised.value)
