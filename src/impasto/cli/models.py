"""The subcommand `models`."""

from __future__ import annotations

import impasto
from impasto.cli.app import Debug, Json, app
from impasto.console import reporting
from impasto.summaries.models import model_lines


@app.command(epilog="Example: impasto models")
def models(json: Json = None, debug: Debug = False) -> None:
    """List the reflectance models."""
    with reporting("models", json, debug) as report:
        for spec in impasto.models.MODELS.values():
            report.say_all(model_lines(spec))
        report.say()
        report.say("The papers behind them are listed in docs/references.md.")
        report.done({"models": list(impasto.models.MODELS.values())})
