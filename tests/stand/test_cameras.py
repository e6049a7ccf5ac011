"""Files that come from cameras: through libgphoto2 and through a watched folder."""

import shutil
import threading
import time

import numpy as np
import pytest
import tifffile
from stands import quiet, stand_of, write_plan

from impasto import stand
from impasto.stand.desk import Desk
from impasto.stand.drivers import DriverError, open_camera
from impasto.stand.run import unattended
from impasto.stand.steps import shots

gphoto2 = pytest.importorskip("gphoto2", reason="the package gphoto2 is not installed")


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    """Return the photographs of a simulated capture of nine angles, in the order in which they were taken."""
    folder = tmp_path_factory.mktemp("taken")
    plan = write_plan(folder, arm=range(-32, 33, 8), times=(1,), calibration=())
    stand.run(plan, folder / "photos", say=quiet)
    return sorted((folder / "photos").glob("arm*.tif"), key=lambda path: int(path.stem[3:]))


def directory_plan(folder, card):
    """Write a plan of libgphoto2's own camera, which shows a folder as if it were a card."""
    replace = [('model = ""', 'model = "Directory Browse"'), ('port = ""', f'port = "disk:{card}"'),
               ('release = "cable"', 'release = "hand"'), ("timeout_s = 60", "timeout_s = 1.5")]  # fmt: skip
    return write_plan(folder, camera="gphoto2", arm=range(-32, 33, 8), times=(1,), calibration=(),
                      replace=replace)  # fmt: skip


def test_photographs_are_fetched_through_libgphoto2(photographs, tmp_path):
    """Somebody releases the camera when the program asks: a file appears on its card, in a subfolder."""
    card = tmp_path / "card" / "DCIM"
    card.mkdir(parents=True)
    shutil.copyfile(photographs[0], card / "OLD_0001.TIF")  # what was there before is not taken
    plan = directory_plan(tmp_path, card.parent)
    desk = unattended()
    left = iter(photographs)
    show = desk.show

    def release(**state):
        show(**state)
        if state.get("waiting"):
            path = next(left)
            shutil.copyfile(path, card / f"DSC_{photographs.index(path):04d}.TIF")

    desk.show = release
    summary = stand.run(plan, tmp_path / "photos", desk=desk, say=quiet)
    assert summary.complete
    taken = sorted((tmp_path / "photos").glob("arm*.tif"), key=lambda path: int(path.stem[3:]))
    assert [path.read_bytes() for path in taken] == [path.read_bytes() for path in photographs]
    assert len(list(card.iterdir())) == 10  # all stay on the card


def test_a_camera_that_does_not_release_is_named(tmp_path):
    (tmp_path / "card").mkdir()
    made = stand_of(directory_plan(tmp_path, tmp_path / "card"), Desk())
    camera = open_camera(made)
    with pytest.raises(DriverError, match=r"no photograph has arrived for 1\.5 s"):
        camera.take(shots(made.plan)[0], tmp_path)
    camera.close()


def test_a_camera_whose_shutter_the_cable_cannot_set_is_named(tmp_path):
    (tmp_path / "card").mkdir()
    path = directory_plan(tmp_path, tmp_path / "card")
    path.write_text(path.read_text().replace('release = "hand"', 'release = "cable"'))
    with pytest.raises(DriverError, match="exposure time cannot be set by cable"):
        open_camera(stand_of(path, Desk()))


def test_a_camera_that_is_not_there_is_named(tmp_path):
    path = write_plan(tmp_path, camera="gphoto2", arm=(0, 8), times=(1,))
    with pytest.raises(DriverError, match="does not answer"):
        open_camera(stand_of(path, Desk()))


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1/60", 1 / 60),
        ("0.5s", 0.5),
        ("13/10", 1.3),
        ("30", 30),
        ("Bulb", None),
        ("1/4 s", 0.25),
        ("0", None),
    ],
)
def test_exposure_times_are_read_as_cameras_write_them(text, seconds):
    from impasto.stand.cameras.gphoto2 import seconds_of

    assert seconds_of(text) == (None if seconds is None else pytest.approx(seconds))


@pytest.fixture
def watched(tmp_path):
    folder = tmp_path / "tethered"
    folder.mkdir()
    replace = [("rest_s = 0.5", "rest_s = 0.15"), ("timeout_s = 300", "timeout_s = 2")]
    path = write_plan(tmp_path, camera="folder", arm=(0, 8), times=(1,), calibration=(), replace=replace)
    made = stand_of(path, Desk())
    incoming = tmp_path / "incoming"
    incoming.mkdir()
    return folder, made, incoming


def arrive(*steps):
    """Run steps one after the other, with pauses in seconds between them, in the background."""

    def run():
        for step in steps:
            time.sleep(step) if isinstance(step, int | float) else step()

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def test_a_file_that_appears_slowly_is_taken_whole(watched, photographs):
    folder, made, incoming = watched
    data, slow = photographs[0].read_bytes(), folder / "IMG_0001.TIF"
    parts = [data[at : at + len(data) // 4 + 1] for at in range(0, len(data), len(data) // 4 + 1)]

    def add(part):
        with slow.open("ab") as file:
            file.write(part)

    camera = open_camera(made)
    # The second pause is longer than the rest after which a file counts as written.
    thread = arrive(0.1, lambda: add(parts[0]), 0.05, lambda: add(parts[1]), 0.4, lambda: add(parts[2]), 0.1,
                    lambda: add(parts[3]))  # fmt: skip
    path = camera.take(shots(made.plan)[0], incoming)
    thread.join()
    assert path.read_bytes() == data
    assert slow.read_bytes() == data


def test_temporary_names_are_not_taken(watched, photographs):
    folder, made, incoming = watched
    camera = open_camera(made)
    hidden, part = folder / ".IMG_0001.TIF", folder / "IMG_0001.TIF.part"

    def appear():
        shutil.copyfile(photographs[1], hidden)
        shutil.copyfile(photographs[1], folder / "~IMG_0001.TIF")
        shutil.copyfile(photographs[0], part)

    thread = arrive(0.1, appear, 0.5, lambda: part.rename(folder / "IMG_0001.TIF"))
    path = camera.take(shots(made.plan)[0], incoming)
    thread.join()
    assert path.name == "IMG_0001.TIF"
    assert path.read_bytes() == photographs[0].read_bytes()


def test_what_was_there_before_is_not_taken(watched, photographs):
    folder, made, incoming = watched
    shutil.copyfile(photographs[0], folder / "IMG_0001.TIF")
    camera = open_camera(made)
    thread = arrive(0.2, lambda: shutil.copyfile(photographs[1], folder / "IMG_0002.TIF"))
    assert camera.take(shots(made.plan)[0], incoming).name == "IMG_0002.TIF"
    thread.join()


def test_a_file_that_never_gets_whole_is_named(watched):
    folder, made, incoming = watched
    camera = open_camera(made)
    tifffile.imwrite(folder / "IMG_0001.TIF", np.zeros((64, 96, 3), np.uint16), photometric="rgb")
    data = (folder / "IMG_0001.TIF").read_bytes()
    (folder / "IMG_0001.TIF").write_bytes(data[: len(data) // 2])
    with pytest.raises(DriverError, match=r"IMG_0001\.TIF"):
        camera.take(shots(made.plan)[0], incoming)


def test_a_folder_that_is_not_there_is_named(watched):
    folder, made, _ = watched
    folder.rmdir()
    with pytest.raises(DriverError, match="is no folder to watch"):
        open_camera(made)
