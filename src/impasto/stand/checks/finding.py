"""What a check has to say."""

from __future__ import annotations

from dataclasses import dataclass

from impasto.errors import Problem


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a photograph, or with several.

    Parameters
    ----------
    check : str
        Which check says so: ``clipped``, ``dark``, ``blurred``, ``moved``, ``light``, ``order``, ``ambient``,
        ``duplicate``, ``exposure``, ``sphere`` or ``coverage``.
    photographs : tuple of str
        Those that would have to be taken again.
    what : str
        What is wrong, with what was found against what was expected.
    do : str
        What the person can do about it.
    """

    check: str
    photographs: tuple[str, ...]
    what: str
    do: str

    def __str__(self) -> str:
        return f"{', '.join(self.photographs)}: {self.what}"

    @property
    def problem(self) -> Problem:
        """The finding as a problem."""
        return Problem(", ".join(self.photographs) or "the capture", f"{self.check}: {self.what}", self.do)
