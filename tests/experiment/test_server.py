"""The server: what it stores, whom it lets in, and what it refuses."""

import re
from statistics import NormalDist

import pytest
from benchmarks.experiment_server import ADMIN_TOKEN
from laboratory import WINDOW
from starlette.testclient import TestClient

from impasto.psychophysics.experiment.answers import answer_rows
from impasto.psychophysics.experiment.database import trials
from impasto.psychophysics.experiment.manifest import session_trials
from impasto.psychophysics.experiment.server.app import make_app
from impasto.psychophysics.experiment.server.limits import Limits, Rate
from impasto.psychophysics.experiment.server.state import Served
from impasto.psychophysics.experiment.sessions import Session, invite_observers

ADMIN = {"Authorization": f"Bearer {ADMIN_TOKEN}"}


@pytest.fixture
def database(tmp_path):
    """Return one kind of database; that sessions are the same on both is tested beside."""
    return f"sqlite:///{tmp_path / 'answers.sqlite'}"


@pytest.fixture
def web(tmp_path):
    """Return a folder of pages as small as can be."""
    folder = tmp_path / "web"
    (folder / "assets").mkdir(parents=True)
    for name in ("experiment.html", "experiment-admin.html", "experiment.js", "assets/a-1.css", "secret.txt"):
        (folder / name).write_text(name)
    return folder


@pytest.fixture
def client(served, web):
    with TestClient(make_app(served, web), raise_server_exceptions=True) as client:
        yield client


@pytest.fixture
def codes(served):
    return [entry.code for entry in invite_observers(served.engine, served.experiment, observers=2)]


def bearer(code):
    return {"Authorization": f"Bearer {code}"}


def consent(client, code):
    step = {"name": "consent", "agreed": True}
    assert client.post("/api/session/steps", json=step, headers=bearer(code)).status_code == 204


def answer(token, choice="left", response_s=1.0):
    return {"token": token, "choice": choice, "response_s": response_s, "window": WINDOW}


def test_a_session_from_consent_to_the_last_answer(client, codes, served):
    headers = bearer(codes[0])
    before = client.get("/api/session", headers=headers).json()
    assert (before["done"], before["answered"], before["total"]) == ([], 0, 10)
    assert (before["width_px"], before["height_px"]) == (60, 44)
    consent(client, codes[0])
    trial = client.post("/api/session/next", headers=headers).json()["trial"]
    while trial:
        for name in ("reference", "left", "right"):
            picture = client.get(f"/api/session/pictures/{trial[name]}", headers=headers)
            assert picture.headers["content-type"] == "image/png"
            assert picture.content[:4] == b"\x89PNG"
        reply = client.post("/api/session/answers", json=answer(trial["token"]), headers=headers).json()
        assert (reply["choice"], reply["already"]) == ("left", False)
        trial = reply["trial"]
    after = client.get("/api/session", headers=headers).json()
    assert (after["done"], after["answered"]) == (["consent"], 10)
    assert len(answer_rows(served.engine)) == 10


def test_the_page_does_not_learn_what_it_shows(client, codes):
    consent(client, codes[0])
    replies = [
        client.get("/api/session", headers=bearer(codes[0])).text,
        client.post("/api/session/next", headers=bearer(codes[0])).text,
    ]
    assert not re.search(r"phong|torrance|condition_|catch|repeat\b|a_left", " ".join(replies))


def test_codes_may_be_typed_in_groups_and_small_letters(client, codes):
    typed = "-".join(re.findall("....", codes[0])).lower()
    assert client.get("/api/session", headers=bearer(typed)).status_code == 200


OBSERVER_REQUESTS = [
    ("GET", "/api/session", None),
    ("POST", "/api/session/steps", {"name": "consent", "agreed": True}),
    ("POST", "/api/session/next", None),
    ("POST", "/api/session/answers", answer("x")),
    ("GET", f"/api/session/pictures/{'0' * 64}", None),
]
ADMIN_REQUESTS = [
    ("GET", "/api/admin/experiment", None),
    ("GET", "/api/admin/sessions", None),
    ("GET", "/api/admin/scale", None),
    ("GET", "/api/admin/answers.csv", None),
    ("GET", "/api/admin/answers.json", None),
    ("POST", "/api/admin/observers", {}),
    ("DELETE", "/api/admin/observers/O001", None),
]


@pytest.mark.parametrize(("method", "path", "body"), OBSERVER_REQUESTS + ADMIN_REQUESTS)
def test_nobody_gets_in_without_a_code_or_token(client, codes, method, path, body):
    for headers in ({}, bearer("WRONG"), bearer(""), {"Authorization": "Basic dTpw"}, bearer("é" * 9)):
        headers = {key: value.encode("latin-1") for key, value in headers.items()}
        assert client.request(method, path, json=body, headers=headers).status_code == 401


@pytest.mark.parametrize(("method", "path", "body"), ADMIN_REQUESTS)
def test_an_observer_does_not_reach_the_laboratory_s_side(client, codes, method, path, body):
    assert client.request(method, path, json=body, headers=bearer(codes[0])).status_code == 401
    assert len(client.get("/api/admin/sessions", headers=ADMIN).json()) == 2


@pytest.mark.parametrize(("method", "path", "body"), OBSERVER_REQUESTS)
def test_the_laboratory_s_token_opens_no_session(client, method, path, body):
    assert client.request(method, path, json=body, headers=ADMIN).status_code == 401


def test_no_request_can_be_made_in_somebody_s_name(client, codes):
    """No cookie is ever set, and only a header that other sites cannot send lets anybody in."""
    consent(client, codes[0])
    reply = client.post("/api/session/next", headers=bearer(codes[0]))
    assert "set-cookie" not in reply.headers
    assert client.post("/api/session/next").status_code == 401
    preflight = {"Origin": "http://elsewhere", "Access-Control-Request-Method": "POST"}
    allowed = client.options("/api/session/next", headers=preflight).headers
    assert "access-control-allow-origin" not in allowed


def test_an_observer_cannot_answer_for_another(client, codes, served):
    mine, theirs = codes
    for code in codes:
        consent(client, code)
    token = client.post("/api/session/next", headers=bearer(theirs)).json()["trial"]["token"]
    reply = client.post("/api/session/answers", json=answer(token), headers=bearer(mine))
    assert reply.status_code == 404
    assert answer_rows(served.engine) == []
    assert client.get("/api/session", headers=bearer(mine)).json()["answered"] == 0


def test_a_trial_that_was_not_shown_cannot_be_answered(client, codes, served):
    from sqlalchemy import select

    consent(client, codes[0])
    first = client.post("/api/session/next", headers=bearer(codes[0])).json()["trial"]["token"]
    with served.engine.connect() as connection:
        later = connection.scalars(
            select(trials.c.token).where(trials.c.session_id == 1, trials.c.position > 0)
        ).all()
    for token in later:
        reply = client.post("/api/session/answers", json=answer(token), headers=bearer(codes[0]))
        assert reply.status_code == 409
    assert answer_rows(served.engine) == []
    assert client.post("/api/session/answers", json=answer(first), headers=bearer(codes[0])).is_success


def test_an_answer_before_the_minimum_time_is_refused(client, codes):
    consent(client, codes[0])
    token = client.post("/api/session/next", headers=bearer(codes[0])).json()["trial"]["token"]
    early = answer(token, response_s=0.1)
    assert client.post("/api/session/answers", json=early, headers=bearer(codes[0])).status_code == 409


@pytest.mark.parametrize(
    "step",
    [
        {"name": "consent", "agreed": False},
        {"name": "secrets"},
        {"name": "viewing", "display": "x" * 101},
        {"name": "viewing", "display": "\u0000"},
        {"name": "viewing", "display": "x", "name_and_age": "Ann, 33"},
        {"name": "acuity", "distance_mm": 700, "px_per_mm": 4, "rows": []},
    ],
)
def test_steps_hold_what_they_are_for_and_nothing_else(client, codes, step):
    assert client.post("/api/session/steps", json=step, headers=bearer(codes[0])).status_code == 422
    halves = b'{"name": "viewing", "display": "\\ud800"}'
    headers = {**bearer(codes[0]), "Content-Type": "application/json"}
    assert client.post("/api/session/steps", content=halves, headers=headers).status_code == 422


def test_pictures_are_found_by_their_digest_only(client, codes, served):
    for name in ("../experiment.json", "..%2fanswers.sqlite", "0" * 64, "%2e%2e/admin-token.txt"):
        reply = client.get(f"/api/session/pictures/{name}", headers=bearer(codes[0]))
        assert reply.status_code in {404, 422}


def test_pages_are_served_and_folders_are_not(client):
    assert client.get("/").text == "experiment.html"
    assert client.get("/admin").text == "experiment-admin.html"
    assert client.get("/experiment.js").headers["content-type"].startswith("text/javascript")
    assert "immutable" in client.get("/assets/a-1.css").headers["cache-control"]
    for path in (
        "/assets", "/assets/", "/secret.txt", "/experiment.json", "/answers.sqlite", "/admin-token.txt",
        "/stimuli/", "/../experiment.json", "/%2e%2e/experiment.json", "/docs", "/redoc",
    ):  # fmt: skip
        assert client.get(path).status_code == 404


@pytest.mark.parametrize("path", ["/", "/api/session", "/nowhere", "/api/openapi.json"])
def test_every_answer_has_the_headers_that_protect_the_page(client, path):
    headers = client.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self';" in policy
    assert "http" not in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"


def test_large_requests_are_refused_however_they_come(client, codes):
    headers = {**bearer(codes[0]), "Content-Type": "application/json"}
    body = b'{"name": "viewing", "display": "' + b"x" * 20_000 + b'"}'
    assert client.post("/api/session/steps", content=body, headers=headers).status_code == 413

    def pieces():
        for _ in range(100):
            yield b"x" * 1000

    assert client.post("/api/session/steps", content=pieces(), headers=headers).status_code == 413


def test_guessing_is_slowed_down_and_observers_are_not(engine, experiment, experiment_folder, web):
    limits = Limits(guesses_per_second=0.001, guesses_at_once=5)
    served = Served(experiment_folder, experiment, engine, ADMIN_TOKEN, limits)
    (invitation,) = invite_observers(engine, experiment)
    with TestClient(make_app(served, web)) as client:
        statuses = [client.get("/api/session", headers=bearer("GUESS")).status_code for _ in range(8)]
        assert statuses == [401] * 5 + [429] * 3
        assert client.get("/api/admin/sessions", headers=bearer("guess")).status_code == 429
        assert client.get("/api/session", headers=bearer(invitation.code)).status_code == 200


def test_one_session_cannot_keep_the_server_busy(engine, experiment, experiment_folder, web):
    served = Served(experiment_folder, experiment, engine, ADMIN_TOKEN, Limits(per_second=0.001, at_once=5))
    one, other = invite_observers(engine, experiment, observers=2)
    with TestClient(make_app(served, web)) as client:
        statuses = [client.get("/api/session", headers=bearer(one.code)).status_code for _ in range(7)]
        assert statuses == [200] * 5 + [429] * 2
        assert client.get("/api/session", headers=bearer(other.code)).status_code == 200


def test_rates_recover():
    time = [0.0]
    rate = Rate(2.0, 3.0, clock=lambda: time[0])
    assert [rate.allows("a") for _ in range(4)] == [True, True, True, False]
    assert rate.allows("b")
    time[0] += 0.5
    assert [rate.allows("a") for _ in range(2)] == [True, False]


def test_the_laboratory_invites_watches_and_deletes(client, served):
    made = client.post("/api/admin/observers", json={"observers": 3, "sessions": 2}, headers=ADMIN).json()
    assert [(entry["observer"], entry["session"]) for entry in made[:3]] == [
        ("O001", 1),
        ("O001", 2),
        ("O002", 1),
    ]
    code = made[0]["code"]
    consent(client, code)
    token = client.post("/api/session/next", headers=bearer(code)).json()["trial"]["token"]
    client.post("/api/session/answers", json=answer(token), headers=bearer(code))
    first, *_ = client.get("/api/admin/sessions", headers=ADMIN).json()
    assert (first["observer"], first["answered"], first["total"]) == ("O001", 1, 10)
    table = client.get("/api/admin/answers.csv", headers=ADMIN)
    assert len(table.text.splitlines()) == 2
    assert client.get("/api/admin/answers.json", headers=ADMIN).json()["sessions"][0]["answers"]
    assert client.delete("/api/admin/observers/O001", headers=ADMIN).json() == {"sessions": 2}
    assert client.delete("/api/admin/observers/O001", headers=ADMIN).status_code == 404
    assert client.get("/api/session", headers=bearer(code)).status_code == 401
    assert len(client.get("/api/admin/answers.csv", headers=ADMIN).text.splitlines()) == 1


def test_the_laboratory_sees_the_scale_so_far(client, served):
    empty = client.get("/api/admin/scale", headers=ADMIN).json()
    assert (empty["answers"], empty["status"]) == (0, "disconnected")
    assert [entry["scale"] for entry in empty["conditions"]] == [None, None]
    # Fourteen of sixteen answers for the first model.
    for number, invitation in enumerate(invite_observers(served.engine, served.experiment, observers=4)):
        session = Session.by_code(served.engine, served.experiment, invitation.code)
        session.record_step("consent", {"agreed": True})
        plans = session_trials(served.experiment, number)
        others = 2 if number == 0 else 0
        trial = session.next_trial()
        while trial:
            plan = plans[trial.number - 1]
            first = True
            if plan.kind == "test" and others:
                first, others = False, others - 1
            side = "left" if plan.a_left == first else "right"
            *_, trial = session.answer(trial.token, side, 1.0, WINDOW)
    found = client.get("/api/admin/scale", headers=ADMIN).json()
    assert (found["answers"], found["observers"], found["status"]) == (16, 4, "converged")
    first, second = found["conditions"]
    assert (first["chosen"], first["asked"]) == (14, 16)
    # Case V of two conditions: the difference is the normal deviate of 14/16.
    assert first["scale"] - second["scale"] == pytest.approx(NormalDist().inv_cdf(14 / 16), abs=1e-6)


def test_a_database_that_is_away_is_said_to_be(client, codes, served, monkeypatch):
    from sqlalchemy.exc import OperationalError

    def away(*_):
        raise OperationalError("select", {}, OSError("gone"))

    monkeypatch.setattr("impasto.psychophysics.experiment.sessions.reading", away)
    reply = client.get("/api/session", headers=bearer(codes[0]))
    assert reply.status_code == 503
    assert reply.headers["retry-after"] == "2"
