"""A whole session in a real browser on a real server, through everything that goes wrong in a laboratory."""

import itertools
import json

import pytest
from benchmarks.experiment_server import Observer, ServerProcess

import impasto
from impasto.psychophysics.experiment.answers import answer_rows
from impasto.psychophysics.experiment.database import database_url, open_database
from impasto.psychophysics.experiment.manifest import session_trials

OFFLINE_MS = 10_000
# Notes in each frame where the pictures are, and whether the buttons are there.
WATCH = """
window.frames_seen = [];
const watch = () => {
  const pictures = [...document.querySelectorAll(".picture")];
  if (pictures.length === 3) {
    const boxes = pictures.map((picture) => {
      const { x, y, width, height } = picture.getBoundingClientRect();
      return [picture.className, x, y, width, height, picture.complete];
    });
    const asked = getComputedStyle(document.querySelector(".choices")).visibility === "visible";
    window.frames_seen.push([asked, JSON.stringify(boxes)]);
  }
  requestAnimationFrame(watch);
};
watch();
"""


@pytest.fixture
def server(experiment_folder, database, web):
    with ServerProcess(experiment_folder, database) as server:
        yield server


@pytest.fixture
def page(browser):
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    context.add_init_script(WATCH)
    yield context.new_page()
    context.close()


def test_a_session_survives_reload_lost_network_and_kill(
    server, page, experiment, experiment_folder, database, tmp_path
):
    (invitation,) = impasto.experiment.invite(experiment_folder, database=database)
    observer = Observer(page, server.address)
    observer.open(invitation.code)
    observer.reach_the_trials()

    sides = itertools.cycle(["left", "right", "right", "tie"])
    for number in itertools.count(1):
        if not observer.wait_until_asked():
            break
        side = next(sides)
        if number == 3:  # in mid-trial
            before = observer.number
            page.reload()
            observer.reach_the_trials()
            observer.wait_until_asked()
            assert observer.number == before
        if number == 5:
            page.context.set_offline(True)
            observer.answer(side)
            page.locator("#notice").wait_for()
            page.wait_for_timeout(OFFLINE_MS)
            assert len(rows(database, experiment, tmp_path)) == 4
            page.context.set_offline(False)
        elif number == 7:  # the answer is given while nobody is there to take it, and the page is closed
            server.kill()
            observer.answer(side, key=False)
            page.locator("#notice").wait_for()
            page.close()
            server.start()
            page = page.context.new_page()
            given = observer.given
            observer = Observer(page, server.address)
            observer.open(invitation.code)
            observer.given = given
            observer.reach_the_trials()
        elif number == 8:  # the server comes back while the page waits
            server.kill()
            observer.answer(side)
            page.locator("#notice").wait_for()
            server.start()
        else:
            observer.answer(side, key=number % 2 == 0)
        observer.wait_for_the_next()

    page.locator("#thanks").wait_for()
    planned = session_trials(experiment, 0)
    answers = rows(database, experiment, tmp_path)
    assert [row["place"] for row in answers] == list(range(1, len(planned) + 1))
    for row, plan in zip(answers, planned, strict=True):
        side = observer.given[row["place"]]
        expected = "tie" if side == "tie" else "AB"[(side == "left") != plan.a_left]
        assert row["choice"] == expected
        assert row["display"] == "a display of no make"
        assert 0.2 <= row["time"] < 60
    assert observer.elsewhere == observer.faults == []
    frames = page.evaluate("window.frames_seen")
    assert {asked for asked, _ in frames} == {True, False}
    # Nothing moves when the buttons appear, nor from trial to trial, and no part of a picture is missing.
    (boxes,) = {boxes for _, boxes in frames}
    (_, left_x, *left), (_, middle_x, *middle), (_, right_x, *right) = json.loads(boxes)
    assert left == middle == right == [378, 60, 44, True]
    assert (left_x, middle_x, right_x) == (530, 610, 690)
    page.reload()
    page.locator("#thanks").wait_for()


def rows(database, experiment, folder):
    engine = open_database(database_url(database, folder), experiment)
    try:
        return answer_rows(engine)
    finally:
        engine.dispose()
