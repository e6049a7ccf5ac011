"""The page for a tablet at the stand, in a real browser, and the terminal."""

import contextlib
import io
import threading
import urllib.error
import urllib.request

import pytest
from playwright.sync_api import expect
from stands import faulty_camera, quiet, write_plan
from test_faults import FILE_FAULTS

from impasto import stand
from impasto.errors import OptionError
from impasto.stand.desk import Desk, StoppedError
from impasto.stand.page.server import serve_page
from impasto.stand.terminal import at_terminal, keys

TABLET = {"width": 1180, "height": 820}


class Capture:
    """A capture in a thread of its own, with the lamp moved by hand."""

    def __init__(self, folder, arm, **options):
        self.desk, self.photos = Desk(), folder / "photos"
        plan = write_plan(
            folder, arm=arm, replace=options.pop("replace", [("settle_s = 1", "settle_s = 0")]),
            **{"light": "hand", "times": (1,), "calibration": ("white",)} | options.pop("plan", {}),
        )  # fmt: skip
        self.summary = None
        self._options = options
        self._thread = threading.Thread(target=self._run, args=(plan,), daemon=True)
        self._thread.start()

    def _run(self, plan):
        self.summary = stand.run(plan, self.photos, desk=self.desk, say=quiet, **self._options)

    def end(self):
        self._thread.join(30)
        assert not self._thread.is_alive()
        return self.summary


@pytest.fixture
def page(browser):
    context = browser.new_context(viewport=TABLET, has_touch=True)
    context.set_default_timeout(10_000)
    yield context.new_page()
    context.close()


def press(page, words):
    """Touch a button once the question that has it is asked."""
    page.get_by_role("button", name=words).tap()


def test_a_capture_is_led_from_a_tablet_through_reload_and_lost_connection(page, tmp_path):
    capture = Capture(tmp_path, (-20, 0, 20))
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    with serve_page(capture.desk) as address:
        page.goto(address)
        question = page.locator("#text")
        expect(page.locator("#text")).to_contain_text("white card")
        press(page, "It is there")
        expect(page.locator("#text")).to_contain_text("+0° on the arm")
        press(page, "It stands there")
        expect(page.locator("#count")).to_have_text("1 of 4 photographs")
        width = "image => image.decode().then(() => image.naturalWidth)"
        assert page.locator("#photograph").evaluate(width) == 96
        assert page.locator("#histogram polyline").count() == 3

        asked = question.text_content()
        page.reload()
        expect(question).to_have_text(asked)
        press(page, "It is there")

        expect(page.locator("#text")).to_contain_text("-20° on the arm")
        page.context.set_offline(True)
        page.get_by_role("status").wait_for(state="visible", timeout=20_000)
        page.context.set_offline(False)
        page.get_by_role("status").wait_for(state="hidden")
        press(page, "It stands there")

        expect(page.locator("#text")).to_contain_text("+0° on the arm")
        page.keyboard.press("PageDown")  # a foot pedal
        expect(page.locator("#text")).to_contain_text("+20° on the arm")
        press(page, "It stands there")
        expect(page.locator("#now")).to_have_text("All photographs are taken")
    summary = capture.end()
    page.wait_for_timeout(1500)
    expect(page.get_by_role("status")).to_be_hidden()  # the page knows that the program has ended
    assert summary.complete
    assert summary.taken == 4
    assert faults == []


def test_a_bad_photograph_is_shown_and_taken_again_at_a_touch(page, tmp_path):
    def fault(shot, path, times):
        return FILE_FAULTS["moved"][1](path) if shot.name == "arm+020" and times == 0 else path

    plan = {"light": "simulated", "calibration": ()}
    options = {"plan": plan, "replace": (), "open_camera": faulty_camera(fault)}
    capture = Capture(tmp_path, (-20, 0, 20), **options)
    with serve_page(capture.desk) as address:
        page.goto(address)
        press(page, "It is there")
        page.locator("#question.problem").wait_for()
        assert "px off" in page.locator("#text").text_content()
        names = page.locator("#choices button").all_text_contents()
        assert names == ["Take it again", "Keep it as it is", "Stop here"]
        # Large enough for a finger in a glove, and nothing lies outside the screen's width.
        heights = page.locator("#choices button").evaluate_all("all => all.map((b) => b.offsetHeight)")
        assert min(heights) >= 48
        assert page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]
        press(page, "Take it again")
        expect(page.locator("#now")).to_have_text("All photographs are taken")
    assert capture.end().again == 1


def test_a_stop_from_the_tablet_ends_the_run_and_keeps_what_is_there(page, tmp_path):
    capture = Capture(tmp_path, (-20, 0, 20), plan={"calibration": ()})
    with serve_page(capture.desk) as address:
        page.goto(address)
        press(page, "It is there")
        press(page, "It stands there")
        expect(page.locator("#count")).to_have_text("1 of 3 photographs")
        press(page, "Stop here")
        summary = capture.end()
    assert not summary.complete
    assert (summary.taken, summary.photographs) == (1, 3)
    assert not (capture.photos / "capture.toml").exists()


def test_nothing_is_served_without_the_token():
    desk = Desk()
    with serve_page(desk) as address:
        root, token = address.rstrip("/").rsplit("/", 1)
        assert urllib.request.urlopen(address).status == 200
        for path in ("/", f"/{token[:-1]}/", f"/{'x' * len(token)}/state", f"/{token}/../state"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(root + path)
        with pytest.raises(urllib.error.HTTPError, match="409"):  # nothing is asked
            urllib.request.urlopen(urllib.request.Request(f"{address}answer", b"1 done"))


def test_the_first_answer_counts_and_late_ones_do_not():
    desk = Desk()
    found = []
    thread = threading.Thread(
        daemon=True, target=lambda: found.append(desk.ask("What?", {"a": "one", "b": "two"}))
    )
    thread.start()
    number = desk.seen_after(-1, 1)["question"]["number"]
    assert desk.answer(number, "b")
    desk.answer(number, "a")
    thread.join()
    assert found == ["b"]
    assert not desk.answer(number, "a")


def test_the_terminal_asks_and_takes_keys(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

        def __iter__(self):
            while line := self.readline():
                asked.wait(3)
                yield line

    asked = threading.Event()
    said = []

    def say(line):
        said.append(line)
        if "Where" in line:
            asked.set()

    monkeypatch.setattr("sys.stdin", Terminal("x\nk\n"))
    desk = Desk()
    desk.show(waiting="Release the shutter: painting, 1/8 s")
    with at_terminal(desk, say):
        assert desk.ask("Where?", {"again": "take it again", "keep": "keep it"}) == "keep"
    assert said[0] == "Release the shutter: painting, 1/8 s"
    assert "Where?\n  Enter = take it again,  k = keep it,  s = stop here" in said[1]
    assert said[2] == "That is none of the answers"
    assert keys({"stop": "stop", "start": "start"}) == {"": "stop", "s": "stop", "t": "start"}


def test_nobody_to_answer_is_said_before_anything_begins(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO())
    with pytest.raises(OptionError, match="no terminal"), at_terminal(Desk(), quiet):
        pass


def test_a_stopped_desk_stops_at_once():
    desk = Desk()
    desk.stop()
    with pytest.raises(StoppedError):
        desk.ask("Where?", {"a": "one"})
    with contextlib.suppress(StoppedError):
        desk.check_stop()
        pytest.fail("it did not stop")
