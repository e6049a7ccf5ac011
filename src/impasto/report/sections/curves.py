"""Radiance against angle at pixels that tell the range."""

from __future__ import annotations

from impasto.evaluate.curve_plot import draw_curve
from impasto.evaluate.gonio import pixel_curve
from impasto.evaluate.telling import telling_pixels
from impasto.models import parse_model
from impasto.page import Picture, Section
from impasto.report.subject import Subject, drawn
from impasto.summaries.gonio import curve_rows


def section(subject: Subject) -> Section | None:
    """Return gonio curves with their errors by band, or None where no pixel has a highlight."""
    first = next((model for model in subject.models if parse_model(model).lobes), None)
    if first is None or not subject.sample.pixels(first).whole.any():
        return None
    places = telling_pixels(subject.sample.pixels(first), subject.fits[first], subject.stack)
    curves = [pixel_curve(name, *place, subject.stack, subject.fits) for name, place in places.items()]
    page = Section("Radiance against angle")
    page.text(
        f"Pixels with a high, a typical and a low highlight, and one that {first} describes poorly, chosen "
        f"from {subject.sampled}. Below each curve is the error of the models."
    )
    header, rows = curve_rows(curves)
    page.pictures(
        [
            Picture(
                drawn(draw_curve, curve, subject.fits),
                "{}, column {}, row {}".format(curve.name.capitalize(), *(curve.pixel or ("?", "?"))),
                alt=f"Plot of measured and modelled radiance against the {curve.angle_name}, {curve.name}; "
                "the errors stand in the table that follows.",
            )
            for curve in curves
        ],
        columns=1,
    )
    page.table(
        header,
        rows,
        caption="Model minus measurement in luminance, as share of the measured mean of the band: peak "
        "within one half-width of the highlight from the mirror direction, shoulder 1 to 3, rest beyond",
    )
    return page
