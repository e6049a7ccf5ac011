"""With which program, versions and settings everything was made, and from which files."""

from __future__ import annotations

import json

from impasto.console import versions
from impasto.page import Section
from impasto.report.subject import Subject
from impasto.store import noted_digest


def section(subject: Subject) -> Section:
    """Return the exact versions, the options of every fit, and the digest of every photograph."""
    page = Section("Versions and settings")
    stack = subject.stack.attributes
    page.table(
        ("part", "made by", "digest of its settings"),
        [
            ("stack", f"{stack['program']} {stack['version']}", str(stack["settings_sha256"])),
            *(
                (f"fit {model}", f"{made['program']} {made['version']}", str(made["settings_sha256"]))
                for model, made in ((model, fit.attributes) for model, fit in subject.fits.items())
            ),
        ],
        caption="What made the parts of the store",
        words=True,
    )
    page.text(f"This page: {versions()}.")
    rows = []
    for model, fit in subject.fits.items():
        made = fit.attributes
        settings = {
            "procedure": made["procedure"],
            "index of refraction": made["index_of_refraction"],
            "Fresnel's angle": made["fresnel"],
            **made["options"],
        }
        rows += [(model, name, _said(value)) for name, value in settings.items()]
    page.table(("fit", "option", "value"), rows, caption="Options of the fits", words=True)
    page.text(f"Digest of the stack, its settings and all photographs: {subject.stack.sha256}")
    page.table(
        ("photograph", "BLAKE3" if "blake3" in stack["inputs"][0] else "SHA-256"),
        [(entry["file"], str(noted_digest(entry))) for entry in stack["inputs"]],
        caption="The photographs",
        words=True,
    )
    return page


def _said(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(str(item) for item in value) or "none"
    return value if isinstance(value, str) else json.dumps(value)
