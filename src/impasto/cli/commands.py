"""The application with all its subcommands."""

from __future__ import annotations

from importlib import import_module

from impasto.cli import COMMANDS
from impasto.cli.app import app

__all__ = ["app"]

for _name in COMMANDS:
    import_module(f"impasto.cli.{_name}")
