"""The report: one file, readable without eyes or a mouse, with the figures that other stages give."""

import re
import shutil
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise

import numpy as np
import pytest

import impasto
from impasto.errors import OptionError, OutputError, StoreError
from impasto.evaluate.per_light import light_errors
from impasto.evaluate.sampling import PaintingSample
from impasto.pixels import read_pixels, render_pixels
from impasto.store import open_fit, open_stack

VOID = {"meta", "img"}


class Outline(HTMLParser):
    """Collect tags, and check that they are closed in the order in which they were opened."""

    def __init__(self, page):
        super().__init__()
        self.stack, self.tags = [], []
        self.feed(page)
        assert self.stack == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def store(painting, tmp_path_factory):
    """A store of its own, in which evaluations may come and go."""
    copy = tmp_path_factory.mktemp("report") / "painting.zarr"
    shutil.copytree(painting, copy)
    shutil.rmtree(copy / "evaluations", ignore_errors=True)
    impasto.evaluate(copy, held_out=2)
    return copy


@pytest.fixture(scope="module")
def made(store):
    summary = impasto.report(store, store.with_name("report.html"))
    return summary, summary.page.read_text(encoding="utf-8")


def test_the_page_loads_nothing_from_anywhere(made):
    _, page = made
    outline = Outline(page)
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _ in outline.tags}
    assert all(picture["src"].startswith("data:image/") for picture in outline.all("img"))
    assert not re.findall(r"(?:href|src)=.https?:|url\(", page)
    assert "default-src 'none'" in page


def test_the_page_can_be_read_without_eyes_and_without_a_mouse(made):
    _, page = made
    outline = Outline(page)
    assert outline.all("html") == [{"lang": "en"}]
    levels = [int(tag[1]) for tag, _ in outline.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(picture["alt"] for picture in outline.all("img"))
    assert all(cell["scope"] in ("row", "col") for cell in outline.all("th"))
    assert len(outline.all("caption")) == len(outline.all("table"))
    frames = [each for each in outline.all("div") if each.get("class") == "scroll"]
    assert all(each["tabindex"] == "0" and each["aria-label"] for each in frames)
    anchors = {each["id"] for each in outline.all("h2")}
    assert {link["href"] for link in outline.all("a")} == {f"#{anchor}" for anchor in anchors}
    named = {each["aria-labelledby"] for each in outline.all("section")}
    assert named == anchors


def luminance(colour):
    channels = np.array([int(colour[start : start + 2], 16) / 255 for start in (1, 3, 5)])
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


@pytest.mark.parametrize("theme", [0, 1])
def test_text_stands_out_from_its_ground(theme):
    """By 4.5 to 1, as WCAG 2.2 AA asks, on a light and on a dark display."""
    css = files("impasto.page").joinpath("page.css").read_text(encoding="utf-8")
    colours = dict(re.findall(r"--([\w-]+): (#\w{6})", css.split(":root {")[1 + theme].split("}")[0]))
    for ink in ("ink", "soft", "accent"):
        for ground in ("ground", "card", "warn"):
            high, low = sorted((luminance(colours[ink]), luminance(colours[ground])), reverse=True)
            assert (high + 0.05) / (low + 0.05) >= 4.5, (ink, ground)


def test_figures_are_those_of_the_other_stages(store, made):
    """This painting is small enough for the sample to be all of it."""
    summary, page = made
    assert summary.sampled_pixels == summary.pixels
    for model in impasto.compare(store).regions[0].models:
        assert f"<td>{model.rms:.4f}</td>" in page
        assert f"{model.ratio.mean:.4g} (" in page
    for model in impasto.evaluate(store, held_out=2).models:
        assert f"<td>{model.mean.rms_relative:.4f}</td>" in page
        assert f"<td>{model.mean.psnr_db:.2f}</td>" in page
    assert open_stack(store).sha256 in page
    assert impasto.__version__ in page


def test_errors_by_light_are_those_of_the_renderings(painting):
    stack, fit = open_stack(painting), open_fit(painting, "phong")
    sample = PaintingSample(stack, {"phong": fit})
    _, height, width, channels = stack.shape
    pixels = read_pixels(fit, slice(0, height), slice(0, width))
    radiance = stack.radiance(slice(0, height), slice(0, width)).reshape(len(stack.lights), -1, channels)
    assert len(sample) == height * width
    np.testing.assert_array_equal(sample.radiance, radiance)
    np.testing.assert_array_equal(sample.values("phong", "normal"), pixels.normal)
    found = light_errors(sample.pixels("phong"), stack, sample.radiance)
    error = render_pixels(pixels, stack.lights, stack.camera)[3] - radiance[3]
    usable = (radiance[3] < stack.clip_level) & np.isfinite(error)
    expected = np.sqrt(np.mean(error[usable].astype(float) ** 2)) / radiance[3][usable].mean()
    assert found[3] == pytest.approx(expected, rel=1e-5)


def test_a_store_that_was_not_evaluated_says_how_to(store, tmp_path):
    copy = tmp_path / "p.zarr"
    shutil.copytree(store, copy)
    shutil.rmtree(copy / "evaluations")
    page = impasto.report(copy, tmp_path / "r.html").page.read_text(encoding="utf-8")
    assert "No photographs were kept out" in page
    assert "impasto evaluate p.zarr" in page


def test_an_evaluation_of_an_earlier_fit_is_not_shown(store, tmp_path):
    copy = tmp_path / "p.zarr"
    shutil.copytree(store, copy)
    impasto.fit(copy, models=["phong"], options=impasto.FitOptions(loss="cauchy"), overwrite=True)
    page = impasto.report(copy, tmp_path / "r.html", models=["phong"]).page.read_text(encoding="utf-8")
    assert "phong: evaluated before" in page


def test_a_matte_model_has_neither_curves_nor_gloss(capture, tmp_path):
    impasto.stack(capture, tmp_path / "p.zarr")
    impasto.fit(tmp_path / "p.zarr", models=["lambert"])
    summary = impasto.report(tmp_path / "p.zarr", tmp_path / "r.html")
    assert not {"Radiance against angle", "Gloss"} & set(summary.sections)


def test_what_cannot_be_reported_is_refused_before_the_work(painting, tmp_path):
    with pytest.raises(OutputError, match="is a folder"):
        impasto.report(painting, tmp_path)
    with pytest.raises(OutputError, match="does not exist"):
        impasto.report(painting, tmp_path / "none" / "r.html")
    with pytest.raises(StoreError, match="no such fit"):
        impasto.report(painting, tmp_path / "r.html", models=["lambert"])
    with pytest.raises(OptionError, match="no reflectance model"):
        impasto.report(painting, tmp_path / "r.html", models=["gloss"])
    with pytest.raises(StoreError, match="no such store"):
        impasto.report(tmp_path / "none.zarr", tmp_path / "r.html")
    assert list(tmp_path.iterdir()) == []
