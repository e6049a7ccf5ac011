"""How well the parameters are known, as the photographs' noise and the fit tell it."""

from __future__ import annotations

import numpy as np

from impasto.maps.preview import map_title
from impasto.page import Section
from impasto.report.sections.maps import map_pictures
from impasto.report.subject import Subject


def section(subject: Subject) -> Section | None:
    """Return the standard deviations of each model's parameters, or None if no fit has them."""
    known = [model for model, fit in subject.fits.items() if "normal_sd" in fit.names]
    if not known:
        return None
    page = Section("How certain it is")
    page.text(
        "Standard deviations follow from the residuals and from how strongly the photographs depend on each "
        "parameter. They do not know what the model itself gets wrong. Read them as the least that is "
        "uncertain."
    )
    rows = []
    for model in known:
        for name in (name for name in subject.fits[model].names if name.endswith("_sd")):
            values = subject.sample.values(model, name)
            values = np.degrees(values) if name == "normal_sd" else values
            finite = values[np.isfinite(values)]
            if finite.size:
                unit = "°" if name == "normal_sd" else ""
                low, high = np.percentile(finite, [50, 95])
                what = map_title(name).removesuffix(": standard deviation")
                rows.append((f"{model}: {what}", f"{low:.3g}{unit}", f"{high:.3g}{unit}"))
    page.table(
        ("standard deviation of", "median", "95th percentile"),
        rows,
        caption=f"Of {subject.sampled}; relative radiance is the unit of magnitudes",
    )
    page.pictures(map_pictures(subject, known[0], deviations=True), columns=2)
    return page
