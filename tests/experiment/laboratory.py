"""What the tests of the server share."""

import secrets
from pathlib import Path

from sqlalchemy import create_engine, text

from impasto.psychophysics.experiment.database import database_url

WINDOW = {"width": 1280, "height": 800, "device_pixel_ratio": 1, "full_screen": True, "input": "key"}


def new_postgresql_database(server: str) -> str:
    """Make an empty database on a server, and return its address."""
    name = f"test_{secrets.token_hex(6)}"
    engine = create_engine(database_url(f"{server}/postgres", Path()), isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    engine.dispose()
    return f"{server}/{name}"
