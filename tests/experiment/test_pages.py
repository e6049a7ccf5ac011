"""Every page at two sizes of the window: pictures centred on neutral grey, text readable, focus visible.

`python -m benchmarks.experiment_pages` takes pictures of the same pages, to be looked at.
"""

import io

import numpy as np
from benchmarks.experiment_pages import WINDOWS, make_experiments, show, walk
from PIL import Image

from impasto.psychophysics.differences import read_picture
from impasto.psychophysics.experiment.manifest import read_experiment

GREY = 119  # sRGB; L* 50
# Returns what is wrong with the page that is shown.
LOOK = """() => {
  const wrong = [];
  const levels = (text) => text.match(/[\\d.]+/g).map(Number);
  const luminance = (colour) => {
    const [r, g, b] = levels(colour).map((v) => {
      const s = v / 255;
      return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const colour = getComputedStyle(at).backgroundColor;
      if ((levels(colour)[3] ?? 1) === 1) return colour;
    }
    return getComputedStyle(document.documentElement).backgroundColor;
  };
  if (document.documentElement.scrollWidth > innerWidth) wrong.push("is wider than the window");
  const field = levels(getComputedStyle(document.documentElement).backgroundColor);
  if (new Set(field.slice(0, 3)).size !== 1) wrong.push(`stands on ${field}, which is not neutral`);
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const text = texts.currentNode.textContent.trim();
    const element = texts.currentNode.parentElement;
    if (!text || element.closest(":disabled, option, script, style")) continue;
    if (!element.checkVisibility({ visibilityProperty: true })) continue;
    const style = getComputedStyle(element);
    if (parseFloat(style.fontSize) < 14) wrong.push(`"${text}" is small: ${style.fontSize}`);
    const [dark, light] = [luminance(style.color), luminance(behind(element))].sort((a, b) => a - b);
    const contrast = (light + 0.05) / (dark + 0.05);
    if (contrast < 4.5) wrong.push(`"${text}" has a contrast of ${contrast.toFixed(2)}`);
    const box = element.getBoundingClientRect();
    if (box.left < 0 || box.right > innerWidth) wrong.push(`"${text}" is cut off`);
  }
  if (document.querySelector("form.card")) {
    const focus = getComputedStyle(document.activeElement);
    const seen = focus.outlineStyle !== "none" && parseFloat(focus.outlineWidth) >= 2;
    if (document.activeElement === document.body || !seen) wrong.push("shows no focus");
  }
  return wrong;
}"""
PICTURES = """() => [...document.querySelectorAll(".picture")].map((picture) => {
  const { x, y, width, height } = picture.getBoundingClientRect();
  return [x, y, width, height, getComputedStyle(picture).visibility];
})"""


def pixels(page):
    with Image.open(io.BytesIO(page.screenshot())) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def check_pictures(page, window, stimuli, alternating):
    """Check that what is seen is the stimuli, pixel for pixel, where they should stand."""
    width, height = window
    places = page.evaluate(PICTURES)
    left, reference, right = sorted(places)
    assert len(places) == 3
    assert left[2:4] == reference[2:4] == right[2:4]
    assert {place[1] + place[3] / 2 for place in places} == {height / 2}
    across = [place[0] + place[2] / 2 for place in (left, reference, right)]
    assert across[1] == width / 2
    assert across[0] + across[2] == width
    assert (across[0] == across[2]) == alternating
    seen = pixels(page)
    assert seen.shape[:2] == (height, width)
    rest = np.ones((height, width), dtype=bool)
    for x, y, across, down, visibility in places:
        part = slice(int(y), int(y + down)), slice(int(x), int(x + across))
        rest[part] = False
        if visibility == "visible":
            # Colours go through the browser's conversion from the profile of the picture.
            assert min(np.abs(seen[part] - stimulus).max() for stimulus in stimuli) <= 2
    # Nothing but the field around the pictures; below them are the buttons.
    rest[int(reference[1] + reference[3]) :] = False
    assert np.all(seen[rest] == GREY)


def test_every_page_can_be_read_and_every_picture_stands_where_it_should(painting, browser, web, tmp_path):
    experiments = make_experiments(painting, tmp_path)
    folder = experiments["ties"]
    stimuli = [read_picture(folder / entry.file).astype(int) for entry in read_experiment(folder).stimuli]
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    wrong, stops = [], []
    for stop in walk(page, experiments):
        stops.append(stop.name)
        for window in stop.windows:
            show(page, window)
            wrong += [f"{stop.name}, {window}: {found}" for found in page.evaluate(LOOK)]
            if stop.name.startswith("trial-"):
                check_pictures(page, window, stimuli, alternating="alternating" in stop.name)
            if stop.name == "trial-forced":
                assert page.evaluate("getComputedStyle(document.activeElement).outlineWidth") == "3px"
    page.context.close()
    assert wrong == []
    assert len(stops) == len(set(stops)) == 25
    assert {"consent", "plate-tritan", "adaptation", "trial-ties", "pause", "thanks", "laboratory"} < {*stops}
    assert WINDOWS == ((1280, 800), (2560, 1440))
