"""Requests made up from the interface's own description: none makes the server fail."""

import pytest
import schemathesis
from benchmarks.experiment_server import ADMIN_TOKEN
from hypothesis import HealthCheck, Phase, given, settings
from laboratory import new_postgresql_database
from schemathesis import GenerationMode

from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.server.app import make_app
from impasto.psychophysics.experiment.server.limits import Limits
from impasto.psychophysics.experiment.server.state import Served
from impasto.psychophysics.experiment.sessions import Session, invite_observers

UNLIMITED = Limits(per_second=1e9, at_once=1e9, guesses_per_second=1e9, guesses_at_once=1e9)

FUZZING = settings(
    max_examples=10,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)


@pytest.fixture(scope="module")
def fuzzed(request, experiment, experiment_folder, postgresql, tmp_path_factory):
    """Return the application on PostgreSQL, which takes less than SQLite does, and the code of a session."""
    web = tmp_path_factory.mktemp("web")
    engine = open_database(database_url(new_postgresql_database(postgresql), web), experiment)
    served = Served(experiment_folder, experiment, engine, ADMIN_TOKEN, UNLIMITED)
    (invitation,) = invite_observers(engine, experiment, observers=1)
    opened = Session.by_code(engine, experiment, invitation.code)
    opened.record_step("consent", {"agreed": True})
    app = make_app(served, web)
    yield app, invitation.code, opened.next_trial()
    engine.dispose()


@pytest.mark.parametrize("mode", list(GenerationMode))
def test_nothing_that_can_be_asked_makes_the_server_fail(fuzzed, mode):
    """Both what the description allows and what it does not."""
    app, code, trial = fuzzed
    statuses = set()
    for found in schemathesis.openapi.from_asgi("/api/openapi.json", app).get_all_operations():
        operation = found.ok()

        @FUZZING
        @given(case=operation.as_strategy(generation_mode=mode))
        def ask(case):
            token = ADMIN_TOKEN if "/admin/" in case.path else code
            if isinstance(case.body, dict) and "token" in case.body:
                case.body["token"] = trial.token  # so that some answers reach the database
            response = case.call(headers={"Authorization": f"Bearer {token}"})
            statuses.add(response.status_code)
            assert response.status_code < 500

        ask()
    assert {200, 422} <= statuses
    # What is made up to be wrong may replace the header with the code.
    assert not statuses & ({429} if mode is GenerationMode.NEGATIVE else {401, 429})
