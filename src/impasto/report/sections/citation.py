"""How to cite the program, the paper it starts from, and the models used."""

from __future__ import annotations

import impasto
from impasto.models import parse_model
from impasto.page import Section
from impasto.report.subject import Subject


def section(subject: Subject) -> Section:
    """Return the entries for a list of references."""
    page = Section("How to cite")
    page.items(
        [
            "The impasto maintainers, impasto: per-pixel reflectance of painted surfaces from photographs "
            f"under a moving light, version {impasto.__version__}.",
            "Y. Chen, R. S. Berns, L. A. Taplin, “Model evaluation for computer graphics renderings of "
            "artist paint surfaces”, Proc. IS&T 15th Color and Imaging Conference, 2007, pp. 54–59, "
            "doi:10.2352/CIC.2007.15.1.art00011.",
        ]
    )
    named = [(spec.title, ", ".join(spec.citations)) for spec in map(parse_model, subject.models)]
    page.table(
        ("model", "sources, by their keys in docs/references.md"), named, caption="The models", words=True
    )
    return page
