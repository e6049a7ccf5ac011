"""A choice between ways of fitting, made by lights that are left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

WORTH_DB = 0.1
"""How much closer lights left out have to be met for another than the usual way to be used."""


@dataclass(frozen=True)
class Choice:
    """What was chosen, and why.

    Parameters
    ----------
    used : str
    left_out_db : dict of str to float
        To how many decibels each way meets lights left out one by one; see `remainder.left_out_db`.
    """

    used: str
    left_out_db: dict[str, float]

    def attributes(self) -> dict[str, Any]:
        """Return the choice, for the attributes of a fit."""
        return {"used": self.used, "left_out_db": self.left_out_db}

    def note(self, what: str) -> str:
        """Return the choice in words."""
        errors = ", ".join(f"{way} to {error:.2f} dB" for way, error in self.left_out_db.items())
        return f"{what}: lights left out one by one are met by {errors}; {self.used} is used"


def choose(ways: Sequence[str], left_out_db: Callable[[str], float], worth_db: float = WORTH_DB) -> Choice:
    """Choose the way that meets lights left out best, or the first if none is better by `worth_db`.

    Parameters
    ----------
    ways : sequence of str
        The usual one first.
    left_out_db : callable
        What each makes of lights left out; more is better.
    worth_db : float, optional
    """
    errors = {way: left_out_db(way) for way in ways}
    best = max(ways, key=lambda way: errors[way])
    return Choice(best if errors[best] - errors[ways[0]] > worth_db else ways[0], errors)
