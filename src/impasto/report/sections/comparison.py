"""Which model describes the painting, and how well."""

from __future__ import annotations

import numpy as np

from impasto.evaluate.regions import WHOLE
from impasto.evaluate.tally import Tally, specular_ratio
from impasto.page import Section
from impasto.report.subject import Subject
from impasto.summaries.compare import comparison_rows


def section(subject: Subject) -> Section | None:
    """Return errors, As/Ad and the choice per pixel, or None where no pixel has all models' parameters."""
    fitted = [subject.sample.pixels(model) for model in subject.models]
    tally = Tally(subject.stack, subject.models, (WHOLE,))
    tally.add(subject.sample.radiance, fitted, np.zeros(len(subject.sample), np.uint16))
    ratios = {pixels.model.name: {WHOLE: specular_ratio(pixels.select(pixels.whole))} for pixels in fitted}
    (region,) = tally.result(ratios)
    if not region.pixels:
        return None
    page = Section("Which model describes it")
    page.text(
        "RMS / mean is the root mean square error of relative radiance over its mean, on the photographs "
        "that were fitted. A light counts as a highlight of a pixel where the specular part of "
        f"{subject.models[0]} makes more than a tenth of the radiance. As/Ad is the mean of the pixels' "
        "ratios, Ad in luminance, with their 5th and 95th percentile. Each pixel asks for the model with the "
        "least Bayesian information criterion."
    )
    header, rows = comparison_rows(region)
    page.table(header, rows, caption=f"From {subject.sampled}")
    return page
