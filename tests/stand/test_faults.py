"""Faults at the stand: each is named, and none ends in a wrong stack or a lost photograph."""

import errno
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import tifffile
from scipy.ndimage import gaussian_filter, shift
from stands import faulty_camera, faulty_light, quiet, write_plan

import impasto
from impasto import stand
from impasto.errors import CaptureError, OutputError, Problem
from impasto.stand import journal as journals
from impasto.stand.drivers import DriverError
from impasto.store import open_stack


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """Return the plan of a stand, and the stack of a capture in which nothing went wrong."""
    folder = tmp_path_factory.mktemp("clean")
    plan = write_plan(folder)
    stand.run(plan, folder / "photos", say=quiet)
    impasto.stack(folder / "photos", folder / "store.zarr")
    return plan, open_stack(folder / "store.zarr")


def entries(photos, event):
    lines = (photos / "record" / "journal.jsonl").read_text().splitlines()
    return [entry for line in lines if (entry := json.loads(line))["event"] == event]


def is_right(photos, clean, folder):
    """Assert that a capture's stack is that of the clean one but for the sensor's noise."""
    impasto.stack(photos, folder / "store.zarr")
    made, whole = open_stack(folder / "store.zarr"), clean[1]
    assert made.lights.names == whole.lights.names
    rows, columns = slice(0, whole.shape[1]), slice(0, whole.shape[2])
    a, b = made.radiance(rows, columns), whole.radiance(rows, columns)
    assert np.abs(a - b).max() < 0.02
    for entry in entries(photos, "photograph"):
        # A photograph that was journalled is there, or was set aside, with every byte.
        places = [photos / entry["file"], *(photos / "record" / "set-aside").iterdir()]
        digests = {hashlib.sha256(path.read_bytes()).hexdigest() for path in places if path.is_file()}
        assert entry["sha256"] in digests


def altered(change):
    """Return what rewrites a photograph with its pixels changed."""

    def alter(path):
        image = change(tifffile.imread(path).astype(np.float64))
        codes = np.clip(np.rint(image), 0, 65535).astype(np.uint16)
        tifffile.imwrite(path, codes, photometric="rgb")
        return path

    return alter


def copy_of_an_earlier(path):
    earlier = sorted((path.parents[2]).glob("arm*.tif"))[0]
    shutil.copyfile(earlier, path)
    return path


def cut_off(path):
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    return path


# The photograph that goes wrong, what happens to its file, and the check and words that name it.
FILE_FAULTS = {
    "clipped": ("brackets/1/arm+010", altered(lambda image: image * 400), "at full scale"),
    "moved": ("arm+010", altered(lambda image: shift(image, (2, -1, 0), order=0, mode="nearest")), "px off"),
    "blurred": ("arm+010", altered(lambda image: gaussian_filter(image, (2, 2, 0))), "fine detail"),
    "duplicate": ("arm+010", copy_of_an_earlier, "same file"),
    "truncated": ("arm+010", cut_off, "damaged|cut off|truncated|cannot be read|incomplete"),
}


@pytest.mark.parametrize("name", FILE_FAULTS)
def test_a_photograph_that_went_wrong_is_named_and_taken_again(name, clean, tmp_path):
    photograph, spoil, words = FILE_FAULTS[name]
    said = []

    def fault(shot, path, times):
        return spoil(path) if shot.name == photograph and times == 0 else path

    photos = tmp_path / "photos"
    summary = stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=said.append)
    assert summary.complete
    assert summary.again == 1
    taken = f"{photograph}: painting under"
    named = [line for line in said if line.startswith(photograph) and not line.startswith(taken)]
    assert len(named) == 1
    assert any(word in named[0] for word in words.split("|")), named
    aside = entries(photos, "set-aside")
    assert [entry["refused"] for entry in aside] == [photograph]
    assert (photos / "record" / "set-aside" / aside[0]["file"]).is_file()
    is_right(photos, clean, tmp_path)


def test_of_two_exposures_that_lie_apart_both_are_taken_again(clean, tmp_path):
    """Which of them moved, nobody can tell from the two."""
    said = []

    def fault(shot, path, times):
        return FILE_FAULTS["moved"][1](path) if shot.name == "brackets/1/arm+010" and times == 0 else path

    photos = tmp_path / "photos"
    summary = stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=said.append)
    assert summary.complete
    assert summary.again == 2
    named = r"arm\+010, brackets/1/arm\+010: lies 2\.[12]\d px off arm\+010"
    assert any(re.search(named, line) for line in said)
    is_right(photos, clean, tmp_path)


def test_what_stays_wrong_is_no_capture(clean, tmp_path):
    """Where nobody attends and three tries fail, there is an error, and nothing that `stack` would read."""
    photos = tmp_path / "photos"

    def fault(shot, path, times):
        return FILE_FAULTS["blurred"][1](path) if shot.name == "arm+010" else path

    with pytest.raises(CaptureError, match=r"arm\+010: blurred"):
        stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=quiet)
    with pytest.raises(CaptureError, match="no light file"):
        impasto.stack(photos, tmp_path / "store.zarr")
    assert stand.run(clean[0], photos, say=quiet).complete  # and the same command goes on
    is_right(photos, clean, tmp_path)


def test_a_lamp_that_does_not_fire_is_named(clean, tmp_path):
    said = []
    open_light = faulty_light(lambda name, times: None if name == "arm+010" and times == 0 else name)
    photos = tmp_path / "photos"
    summary = stand.run(clean[0], photos, open_light=open_light, say=said.append)
    assert summary.complete
    assert any(line.startswith("arm+010") and "did not fire" in line for line in said)
    is_right(photos, clean, tmp_path)


def test_exchanged_lamps_are_named_and_taken_again(clean, tmp_path):
    exchanged = {"arm-030": "arm+030", "arm+030": "arm-030"}
    said = []
    open_light = faulty_light(lambda name, times: exchanged.get(name, name) if times == 0 else name)
    photos = tmp_path / "photos"
    summary = stand.run(clean[0], photos, open_light=open_light, say=said.append)
    assert summary.complete
    assert any("arm-030" in line and "arm+030" in line and "exchanged" in line for line in said)
    assert summary.again == 4  # both, with their shorter exposures
    is_right(photos, clean, tmp_path)


def test_exchanged_lamps_are_named_even_if_the_run_was_cut_off_before_it_looked(clean, tmp_path, monkeypatch):
    """Power fails after the last photograph: the next run has nothing to take, and looks all the same."""
    from impasto.stand.session import Session

    exchanged = {"arm-030": "arm+030", "arm+030": "arm-030"}
    photos = tmp_path / "photos"

    def cut(self):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Session, "_look_at_all", cut)
        open_light = faulty_light(lambda name, times: exchanged.get(name, name))
        with pytest.raises(KeyboardInterrupt):
            stand.run(clean[0], photos, open_light=open_light, say=quiet)
    assert not (photos / "capture.toml").exists()
    said = []
    summary = stand.run(clean[0], photos, say=said.append)
    assert any("exchanged" in line for line in said)
    assert (summary.before, summary.again) == (summary.photographs, 4)
    is_right(photos, clean, tmp_path)


def test_a_camera_that_is_gone_is_named_and_the_run_goes_on(clean, tmp_path):
    def gone(shot, path, times):
        if shot.name == "arm+010" and times == 0:
            path.unlink()
            raise DriverError(Problem("camera", "does not answer", "See to its cable"))
        return path

    said = []
    photos = tmp_path / "photos"
    summary = stand.run(clean[0], photos, open_camera=faulty_camera(gone), say=said.append)
    assert summary.complete
    assert any("does not answer" in line for line in said)
    assert entries(photos, "failure")[0]["name"] == "arm+010"
    is_right(photos, clean, tmp_path)


def test_a_full_disk_is_named_and_the_same_command_goes_on(clean, tmp_path, monkeypatch):
    """The disk is full from the 13th photograph on; with room again, nothing is missing and nothing twice."""
    photos = tmp_path / "photos"
    written = 0
    append = journals.Journal._append

    def full(self, data):
        nonlocal written
        written += b'"photograph"' in data
        if written >= 13:
            self._file.write(data[:10])  # a part of the line gets there
            self._file.flush()
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        append(self, data)

    with monkeypatch.context() as patch:
        patch.setattr(journals.Journal, "_append", full)
        with pytest.raises(OutputError, match=r"No space left|no room left"):
            stand.run(clean[0], photos, say=quiet)
    with pytest.raises(CaptureError):
        impasto.stack(photos, tmp_path / "store.zarr")
    summary = stand.run(clean[0], photos, say=quiet)
    assert summary.complete
    assert summary.before == 12
    is_right(photos, clean, tmp_path)


def test_a_disk_that_is_full_while_a_file_is_fetched_is_named(clean, tmp_path):
    def full(shot, path, times):
        if shot.name == "arm+010":
            path.write_bytes(path.read_bytes()[:1000])  # as far as it got
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return path

    photos = tmp_path / "photos"
    with pytest.raises(OutputError, match="No space left"):
        stand.run(clean[0], photos, open_camera=faulty_camera(full), say=quiet)
    assert stand.run(clean[0], photos, say=quiet).complete
    is_right(photos, clean, tmp_path)


def test_a_run_that_is_killed_goes_on_where_it_was(clean, tmp_path):
    """Kill -9, twice, at moments that nobody chose."""
    photos = tmp_path / "photos"
    script = f"from impasto import stand; stand.run({str(clean[0])!r}, {str(photos)!r})"
    for least in (4, 11):
        process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.DEVNULL)
        path = photos / "record" / "journal.jsonl"
        while process.poll() is None and (
            not path.exists() or path.read_bytes().count(b'"photograph"') < least
        ):
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert not (photos / "capture.toml").exists()
    before = len(entries(photos, "photograph"))
    summary = stand.run(clean[0], photos, say=quiet)
    assert summary.complete
    assert summary.before + summary.taken >= summary.photographs
    assert before >= 11
    is_right(photos, clean, tmp_path)


@pytest.mark.parametrize("crash", ["_move", "_aside"])
def test_a_crash_while_files_are_moved_loses_none(crash, clean, tmp_path, monkeypatch):
    """Cut off after a photograph is journalled and before it has its name, and while one is set aside."""
    from impasto.stand.folder import CaptureFolder

    photos = tmp_path / "photos"
    whole = getattr(CaptureFolder, crash)
    calls = 0

    def cut(self, *arguments, **about):
        nonlocal calls
        calls += 1
        if calls == (1 if crash == "_aside" else 12):
            raise KeyboardInterrupt
        return whole(self, *arguments, **about)

    def fault(shot, path, times):
        spoiled = crash == "_aside" and shot.name == "arm+010" and times == 0
        return FILE_FAULTS["blurred"][1](path) if spoiled else path

    with monkeypatch.context() as patch:
        patch.setattr(CaptureFolder, crash, cut)
        with pytest.raises(KeyboardInterrupt):
            stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=quiet)
    assert stand.run(clean[0], photos, say=quiet).complete
    is_right(photos, clean, tmp_path)


def test_a_clock_that_is_set_is_named_and_changes_nothing(clean, tmp_path, monkeypatch):
    photos = tmp_path / "photos"
    real, jump = time.time, 0.0

    def fault(shot, path, times):
        nonlocal jump
        if shot.name == "arm+010":
            jump = -3600.0
        return path

    monkeypatch.setattr(journals.time, "time", lambda: real() + jump)
    summary = stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=quiet)
    assert summary.complete
    assert any("clock" in note and "-3600 s" in note for note in summary.notes)
    numbers = [json.loads(line)["number"] for line in (photos / "record/journal.jsonl").open()]
    assert numbers == list(range(1, len(numbers) + 1))
    is_right(photos, clean, tmp_path)


def test_a_second_run_into_the_same_folder_is_refused(clean, tmp_path):
    photos = tmp_path / "photos"

    def fault(shot, path, times):
        if shot.name == "arm+010" and times == 0:
            with pytest.raises(CaptureError, match="another process is capturing into it"):
                stand.run(clean[0], photos, say=quiet)
        return path

    assert stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=quiet).complete


def test_a_photograph_that_was_changed_afterwards_is_noticed_before_the_capture_counts(clean, tmp_path):
    photos = tmp_path / "photos"

    def fault(shot, path, times):
        if shot.kind == "ambient" and "after" in shot.name and times == 0:
            with (photos / "arm+010.tif").open("ab") as file:
                file.write(b"more")
        return path

    with pytest.raises(CaptureError, match=r"arm\+010: are missing or not as they were taken"):
        stand.run(clean[0], photos, open_camera=faulty_camera(fault), say=quiet)
    assert not (photos / "capture.toml").exists()
    assert stand.run(clean[0], photos, say=quiet).taken == 1
    impasto.stack(photos, tmp_path / "store.zarr")


def test_a_folder_of_something_else_is_left_alone(clean, tmp_path):
    (tmp_path / "letter.txt").write_text("Dear")
    with pytest.raises(CaptureError, match="something else than a capture"):
        stand.run(clean[0], tmp_path, say=quiet)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]
