"""An experiment to serve, on both databases."""

import os
import secrets
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from benchmarks.experiment_server import ADMIN_TOKEN, free_port
from laboratory import new_postgresql_database

import impasto
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import Experiment, Presentation, read_experiment
from impasto.psychophysics.experiment.server.limits import Limits
from impasto.psychophysics.experiment.server.state import Served


@pytest.fixture(scope="session")
def experiment_folder(painting, tmp_path_factory) -> Path:
    """Return a folder with an experiment of 4 comparisons and 10 trials; its database is another."""
    folder = tmp_path_factory.mktemp("experiment") / "experiment"
    impasto.experiment.create(
        [painting],
        out=folder,
        angles=4,
        presentation=Presentation(
            minimum_view_s=0.2,
            adaptation_s=0.5,
            practice=2,
            repeats=2,
            catch_every=3,
            break_every=3,
            ties=True,
        ),
    )
    return folder


@pytest.fixture(scope="session")
def experiment(experiment_folder) -> Experiment:
    return read_experiment(experiment_folder)


def _postgresql_programs() -> Path | None:
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    if found:
        return found[-1].parent
    initdb = shutil.which("initdb")
    return None if initdb is None else Path(initdb).parent


@pytest.fixture(scope="session")
def postgresql() -> Iterator[str]:
    """Return the address of a PostgreSQL server of our own, on loopback, that is gone after the tests."""
    programs = _postgresql_programs()
    if programs is None:
        reason = "PostgreSQL is not installed: make postgresql"
        # Where a machine tests every change, nothing may be left out unseen.
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    # Not in pytest's own folder, which it closes to all other accounts.
    with tempfile.TemporaryDirectory(prefix="impasto-postgresql-") as name:
        yield from _serve_postgresql(programs, Path(name))


def _serve_postgresql(programs: Path, folder: Path) -> Iterator[str]:
    password = secrets.token_urlsafe(12)
    (folder / "password").write_text(password)
    port = free_port()
    as_user: list[str] = []
    if os.geteuid() == 0:  # PostgreSQL refuses to run as root
        as_user = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"]
        subprocess.run(["chown", "-R", "postgres:postgres", folder], check=True)

    def run(*command):
        # Into a file: the server keeps what it is given open for as long as it runs.
        with (folder / "output").open("ab") as output:
            subprocess.run([*as_user, *command], check=True, stdout=output, stderr=output, cwd=folder)

    data = folder / "data"
    run(
        programs / "initdb", "-D", data, "-U", "impasto", "-A", "scram-sha-256", "--no-sync",
        "--pwfile", folder / "password", "-E", "UTF8",
    )  # fmt: skip
    options = f"-c listen_addresses=127.0.0.1 -c port={port} -c unix_socket_directories='' -c fsync=off"
    run(programs / "pg_ctl", "-D", data, "-w", "-l", folder / "log", "-o", options, "start")
    try:
        yield f"postgresql://impasto:{password}@127.0.0.1:{port}"
    finally:
        run(programs / "pg_ctl", "-D", data, "-w", "-m", "immediate", "stop")


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request, tmp_path) -> str:
    """Return the address of an empty database, of both kinds in turn."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'answers.sqlite'}"
    return new_postgresql_database(request.getfixturevalue("postgresql"))


@pytest.fixture
def engine(database, experiment, tmp_path):
    """Return the open database of the experiment."""
    engine = open_database(database_url(database, tmp_path), experiment)
    yield engine
    engine.dispose()


@pytest.fixture
def served(engine, experiment, experiment_folder) -> Served:
    """Return the experiment as a server has it, with limits that tests do not meet."""
    limits = Limits(per_second=1e6, at_once=1e6, guesses_per_second=1e6, guesses_at_once=1e6)
    return Served(experiment_folder, experiment, engine, ADMIN_TOKEN, limits)
