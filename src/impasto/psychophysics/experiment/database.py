"""Where answers are kept: SQLite by default, PostgreSQL by its URL; the same tables in both."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sqlalchemy import (
    JSON,
    URL,
    Boolean,
    Column,
    Connection,
    DateTime,
    Engine,
    Float,
    ForeignKey,
    Integer,
    MetaData,
    String,
    Table,
    UniqueConstraint,
    create_engine,
    event,
    insert,
    make_url,
    select,
)
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, SQLAlchemyError

from impasto.errors import Problem
from impasto.psychophysics.experiment.manifest import Experiment, ExperimentError

ANSWERS = "answers.sqlite"
"""The database within an experiment's folder, where no other is named."""

_BUSY_S = 30
_POOL = {"pool_size": 8, "max_overflow": 40, "pool_timeout": _BUSY_S, "pool_pre_ping": True}

_READS = "reads"

_METADATA = MetaData()

about = Table(
    "about",
    _METADATA,
    Column("key", String(40), primary_key=True),
    Column("value", String(200), nullable=False),
)
"""Which experiment the answers belong to, and how many observers were ever invited."""

sessions = Table(
    "session",
    _METADATA,
    Column("id", Integer, primary_key=True),
    Column("number", Integer, nullable=False, unique=True),  # decides sides and order
    Column("observer", String(20), nullable=False),
    Column("run", Integer, nullable=False),  # 1 for an observer's first session
    Column("code", String(40), nullable=False, unique=True),
    Column("viewing", JSON, nullable=False),
    Column("created_at", DateTime(timezone=True), nullable=False),
    UniqueConstraint("observer", "run"),
)

steps = Table(
    "step",
    _METADATA,
    Column("session_id", ForeignKey("session.id", ondelete="CASCADE"), primary_key=True),
    Column("name", String(20), primary_key=True),
    Column("data", JSON, nullable=False),
    Column("recorded_at", DateTime(timezone=True), nullable=False),
)
"""What precedes the trials: consent, viewing conditions, checks."""

trials = Table(
    "trial",
    _METADATA,
    Column("id", Integer, primary_key=True),
    Column("session_id", ForeignKey("session.id", ondelete="CASCADE"), nullable=False),
    Column("position", Integer, nullable=False),
    Column("token", String(40), nullable=False, unique=True),
    Column("kind", String(10), nullable=False),
    Column("sample", String(200), nullable=False),
    Column("angle", String(200), nullable=False),
    Column("condition_a", String(200), nullable=False),
    Column("condition_b", String(200), nullable=False),
    Column("a_left", Boolean, nullable=False),
    Column("shown_at", DateTime(timezone=True)),
    Column("answered_at", DateTime(timezone=True)),
    Column("choice", String(3)),  # A, B or tie
    Column("response_s", Float),
    Column("window", JSON),
    UniqueConstraint("session_id", "position"),
)


def now() -> datetime:
    """Return the time, with its zone."""
    return datetime.now(UTC)


def database_url(database: str | None, folder: Path) -> URL:
    """Return the address of the answers.

    Parameters
    ----------
    database : str or None
        Such as ``postgresql://user:password@host/name`` or ``sqlite:///answers.sqlite``; None for a file in
        the experiment's folder.
    folder : Path

    Raises
    ------
    ExperimentError
        If it is none, or of another kind of database.
    """
    if database is None:
        return URL.create("sqlite", database=str(folder / ANSWERS))
    do = "Give postgresql://USER:PASSWORD@HOST/NAME, or leave it out for a file in the experiment's folder"
    try:
        url = make_url(database)
    except ArgumentError as error:
        raise ExperimentError(Problem("--database", "is not the address of a database", do)) from error
    if url.drivername in ("postgresql", "postgres"):
        return url.set(drivername="postgresql+pg8000")
    if url.drivername not in ("sqlite", "postgresql+pg8000"):
        raise ExperimentError(Problem("--database", f"{url.drivername} is not supported", do))
    return url


def open_database(url: URL, experiment: Experiment) -> Engine:
    """Open the answers to an experiment; the tables are made if they are not there.

    Parameters
    ----------
    url : URL
    experiment : Experiment

    Raises
    ------
    ExperimentError
        If the database cannot be reached, or holds answers to another experiment.
    """
    engine = create_engine(url, **_POOL)
    if engine.dialect.name == "sqlite":
        _make_safe(engine)
    where = url.render_as_string(hide_password=True)
    try:
        _METADATA.create_all(engine)
        with engine.begin() as connection:
            found = connection.scalar(select(about.c.value).where(about.c.key == "design"))
            if found is None:
                rows = [("design", experiment.design_sha256), ("observers", "0")]
                connection.execute(insert(about), [{"key": key, "value": value} for key, value in rows])
    except IntegrityError:  # another process made it in this moment
        return open_database(url, experiment)
    except (SQLAlchemyError, OSError) as error:
        reason = str(error.orig if isinstance(error, DBAPIError) else error).splitlines()[0]
        do = "See that it runs, exists and may be written by this account"
        raise ExperimentError(Problem(where, f"cannot be used: {reason}", do)) from error
    if found not in (None, experiment.design_sha256):
        what = "holds answers to another experiment, or to other pictures of this one"
        raise ExperimentError(Problem(where, what, "Name another database with --database"))
    return engine


def reading(engine: Engine) -> Connection:
    """Return a connection for reading only, which waits for no writer."""
    return engine.execution_options(**{_READS: True}).connect()


def _make_safe(engine: Engine) -> None:
    """Have SQLite write what is acknowledged to the disk first, and have writers wait for each other."""

    @event.listens_for(engine, "connect")
    def _connect(connection: Any, record: Any) -> None:
        connection.isolation_level = None  # transactions begin as said below, not when the driver sees fit
        for setting in (
            "journal_mode = WAL",
            "synchronous = FULL",
            "foreign_keys = ON",
            f"busy_timeout = {_BUSY_S * 1000}",
        ):
            connection.execute(f"PRAGMA {setting}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Any) -> None:
        # A transaction that reads first and writes later would fail where another wrote in between.
        reads = connection.get_execution_options().get(_READS)
        connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")
