"""The measured maps of the first model."""

from __future__ import annotations

from impasto.maps.preview import draw_map, draw_statuses, map_title, preview_fit
from impasto.models import parse_model
from impasto.page import Picture, Section
from impasto.report.subject import PICTURE_PX, Subject, drawn, title
from impasto.store import STATUS_MEANING
from impasto.summaries.words import percent

_MEANINGS = {
    "normal": "the direction in which each place faces: the relief",
    "diffuse": "colour without highlights and shading",
    "specular": "strength of the highlight",
    "specular_rgb": "over that of the light; white but for metals",
    "ambient": "light that depends on no direction",
    "status": "where the fit can be trusted",
    "residual_rms": "what the model leaves unexplained",
}


def section(subject: Subject) -> Section:
    """Return the maps as pictures, and how the fit of each model's pixels ended."""
    model = subject.models[0]
    page = Section("What was measured")
    page.text(f"Maps of the {title(model)} model.")
    page.pictures(map_pictures(subject, model, deviations=False), columns=2)
    statuses = dict.fromkeys(status for fit in subject.fits.values() for status in fit.attributes["pixels"])
    rows = []
    for name, fit in subject.fits.items():
        pixels = fit.attributes["pixels"]
        total = max(sum(pixels.values()), 1)
        rows.append((name, *(percent(pixels.get(status, 0) / total) for status in statuses)))
    page.table(("model", *statuses), rows, caption="How the fit of each pixel ended")
    return page


def map_pictures(subject: Subject, model: str, *, deviations: bool) -> list[Picture]:
    """Return a model's maps as pictures: its parameters and residual, or their standard deviations."""
    fit = subject.fits[model]
    small = preview_fit(subject.store, model, fit.shape, PICTURE_PX)
    shape = parse_model(model).shape_names
    parameters = ["normal", "diffuse", "specular", "specular_rgb", *shape, "ambient"]
    names = [f"{name}_sd" for name in parameters] if deviations else [*parameters, "residual_rms", "status"]
    pictures = []
    for name in names:
        if name not in fit.names:
            continue
        values = small.read(slice(0, small.shape[0]), slice(0, small.shape[1]), [name])[name]
        if name == "status":
            codes = {meaning: code for code, meaning in STATUS_MEANING.items()}
            counts = {codes[text]: number for text, number in fit.attributes["pixels"].items()}
            data = drawn(draw_statuses, values, counts, model=model)
        else:
            data = drawn(draw_map, name, values, model=model)
        words = _MEANINGS.get(name) or ("how widely highlights spread" if name in shape else "")
        caption = map_title(name) + (f": {words}" if words else "")
        pictures.append(Picture(data, caption, alt=f"Map with a legend. {caption}."))
    return pictures
