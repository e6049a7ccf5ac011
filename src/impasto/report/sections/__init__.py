"""The sections of the report, one module each, in the order in which they are read.

A section is a function `section` that takes the subject of the report and returns its part of the page, or
None where the store holds nothing for it. To add one, write its module and put its name into `SECTIONS`.
"""

from __future__ import annotations

from importlib import import_module

from impasto.page import Section
from impasto.report.subject import Subject

SECTIONS = (
    "warnings",
    "capture",
    "calibration",
    "maps",
    "uncertainty",
    "curves",
    "comparison",
    "per_light",
    "held_out",
    "shares",
    "gloss",
    "provenance",
    "citation",
)


def section_of(name: str, subject: Subject) -> Section | None:
    """Return the section that a module writes, or None where the store holds nothing for it."""
    section: Section | None = import_module(f"{__name__}.{name}").section(subject)
    return section
