"""The demo runs the whole pipeline, and its page needs nothing but itself."""

import re
from html.parser import HTMLParser

import pytest

import impasto
from impasto.errors import OutputError
from impasto.page import Page, Picture


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    said = []
    summary = impasto.demo(tmp_path_factory.mktemp("demo") / "out", size=(48, 36), say=said.append)
    return summary, said


class Balance(HTMLParser):
    """Check that tags are closed in the order in which they were opened."""

    def __init__(self):
        super().__init__()
        self.open = []
        self.seen = []

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_loads_nothing_from_anywhere(made):
    page = made[0].page.read_text(encoding="utf-8")
    parser = Balance()
    parser.feed(page)
    assert parser.open == []
    pictures = [attributes for tag, attributes in parser.seen if tag == "img"]
    assert len(pictures) > 12
    assert all(picture["src"].startswith("data:image/") and picture["alt"] for picture in pictures)
    assert not {"script", "link", "iframe"} & {tag for tag, _ in parser.seen}
    assert not re.findall(r"(?:href|src)=.https?:|url\(", page)


def test_the_page_holds_the_errors_that_were_found(made):
    summary, _ = made
    page = summary.page.read_text(encoding="utf-8")
    for model in summary.evaluated.models:
        assert not model.refitted
        assert f"<td>{model.mean.psnr_db:.2f}</td>" in page
        assert f"<td>{model.mean.ssim:.4f}</td>" in page


def test_each_step_is_announced_as_the_command_that_does_it(made):
    summary, said = made
    commands = [line.split()[2] for line in said if line.strip().startswith("$ impasto")]
    steps = ["simulate", "calibrate", "stack", "fit", "evaluate", "render", "maps", "experiment"]
    assert list(dict.fromkeys(commands)) == [*steps, "scale"]
    assert list(summary.steps) == steps


def test_the_photographs_are_read_with_what_the_calibration_shots_told(made):
    summary, _ = made
    found = summary.calibrated
    assert (len(found.lights.spheres), len(found.lights.names)) == (2, 45)
    assert found.off_deg < 1  # of spheres of a few pixels
    assert found.response.linear
    stack = impasto.open(summary.store)["stack"].attrs
    assert set(stack["calibration"]) == {"dark", "flat", "white", "colour", "steadiness"}
    assert all(entry["brackets"] == [[entry["file"], 0.25]] for entry in stack["inputs"])
    assert found.glare.share == pytest.approx([0.01] * 3, abs=2e-3)
    assert found.steadiness.corrected == ()
    assert stack["light_rgb_source"] == "white reference"
    assert found.white.radiance == pytest.approx([0.25] * 3, rel=0.01)
    assert f"{found.off_deg:.2f}° off the simulated lamps" in summary.page.read_text(encoding="utf-8")


def test_simulated_observers_judge_by_lights_that_no_fit_has_seen_and_are_named_simulated(made):
    summary, said = made
    compared = summary.compared
    assert compared.created.angles == summary.evaluated.held_out
    assert not any("used photographs that are references" in note for note in compared.created.notes)
    assert compared.scaled.simulated == len(compared.simulated.observers) == 18
    pooled = compared.scaled.groups[0]
    assert pooled.answers == 18 * 5
    page = summary.page.read_text(encoding="utf-8")
    assert f"<td>{pooled.scale[0]:+.3f}</td>".replace("-", "−") in page
    for match in re.finditer("observers", page):
        assert "simulated" in page[max(0, match.start() - 200) : match.end() + 200].lower()
    assert any(line.startswith("SIMULATED") for line in said)


def test_a_demo_replaces_a_demo_and_nothing_else(made, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputError, match="not made by impasto demo"):
        impasto.demo(folder)
    assert [path.name for path in folder.iterdir()] == ["thesis.txt"]


def test_words_on_a_page_are_words():
    page = Page("a < b", "& so on", contents=True)
    section = page.section("1 < 2")
    section.table(("<i>",), [("x & y",)], caption="<u>")
    section.pictures([Picture(b"png", '"quoted" <b>')])
    html = page.html()
    assert "<i>" not in html
    assert "<b>" not in html
    assert "<u>" not in html
    assert "x &amp; y" in html
