"""The room's light, lamps that are on by mistake, and what the photographs say of the highlights."""

from dataclasses import replace

import numpy as np
import pytest
from stands import faulty_camera, quiet, write_plan

from impasto import stand
from impasto.angles.surfaces import assumed_surface
from impasto.errors import CaptureError
from impasto.geometry import Camera, Lights, arm_direction
from impasto.pixels import render_pixels
from impasto.stand.checks.coverage import coverage
from impasto.stand.drivers import open_camera


def test_a_room_that_is_not_dark_is_named(tmp_path):
    """A twentieth of a lamp's light comes from the room; limits say a hundredth."""
    path = write_plan(tmp_path, times=(1,), replace=[("ambient = 0.001", "ambient = 0.05")])
    with pytest.raises(CaptureError, match=r"ambient: the room gives [3-7]\.\d% of the light of a lamp"):
        stand.run(path, tmp_path / "photos", say=quiet)
    assert not (tmp_path / "photos" / "capture.toml").exists()


def test_light_that_comes_on_during_the_capture_is_named_at_its_end(tmp_path):
    """Somebody opens the door: it was dark before, and is not in the last photograph."""
    cameras = []

    def opened(made):
        cameras.append(open_camera(made))
        return cameras[-1]

    path = write_plan(tmp_path, times=(1,))

    def say(line):
        if line.startswith("arm+040: painting"):
            cameras[-1]._settings.ambient = 0.1

    with pytest.raises(CaptureError, match="ambient-after: ambient: the room gives"):
        stand.run(path, tmp_path / "photos", open_camera=opened, say=say)


def test_a_second_lamp_is_named(tmp_path):
    """All lamps of a dome at once are far brighter than one."""
    from test_faults import altered

    def fault(shot, path, times):
        brighter = shot.name == "arm+010" and times == 0
        return altered(lambda image: image * 8)(path) if brighter else path

    said = []
    path = write_plan(tmp_path, times=(0.25,), calibration=())
    assert stand.run(path, tmp_path / "p", open_camera=faulty_camera(fault), say=said.append).complete
    assert any("times as bright as lamps near it" in line for line in said)


def test_a_cap_that_is_forgotten_is_named(tmp_path):
    from test_faults import altered

    def fault(shot, path, times):
        uncapped = shot.kind == "dark" and times == 0
        return altered(lambda image: image + 9000)(path) if uncapped else path

    said = []
    path = write_plan(tmp_path, arm=(0, 10), times=(0.25,))
    assert stand.run(path, tmp_path / "p", open_camera=faulty_camera(fault), say=said.append).complete
    assert any("dark frame reads 13.7% of full scale" in line for line in said)


def test_photographs_without_a_lamp_are_checked_afterwards_too(tmp_path):
    from test_faults import altered

    photos = tmp_path / "photos"
    path = write_plan(tmp_path, times=(1,), calibration=("dark", "ambient", "white"))
    stand.run(path, photos, say=quiet)
    assert stand.check(photos).findings == ()
    for name in ("dark", "ambient-after", "white"):
        brighter = 65535 if name == "white" else 3000
        altered(lambda image, by=brighter: image + by)(photos / "calibration" / f"{name}.tif")
    found = stand.check(photos).findings
    assert {(finding.check, *finding.photographs) for finding in found} == {
        ("dark", "calibration/dark"),
        ("ambient", "calibration/ambient-after"),
        ("clipped", "calibration/white"),
    }


def test_few_lights_leave_narrow_highlights_uncovered_and_many_cover_them(tmp_path):
    """A glossy sample under lamps 12° and 4° apart, fitted coarsely."""
    found = {}
    for step in (12, 4):
        folder = tmp_path / str(step)
        folder.mkdir()
        path = write_plan(
            folder, sample="h", arm=range(-60, 61, step), times=(1, 0.0625), calibration=(),
            replace=[("moved_px = 0.33", "moved_px = 2")],  # steep relief moves its edges with the lamp
        )  # fmt: skip
        found[step] = stand.run(path, folder / "photos", say=quiet).coverage
    assert found[12].gap_deg > found[4].gap_deg
    assert found[12].gap_deg == pytest.approx(12, abs=1.5)
    assert not found[12].enough
    assert found[4].enough


@pytest.mark.parametrize("c", [0.01, 0.02, 0.04])
@pytest.mark.parametrize("mirror_deg", [0, 3, 6])
def test_highlights_that_fall_between_lamps_are_not_taken_for_broad_ones(c, mirror_deg):
    """Nearly flat paint whose highlights, 1.5° to 6° wide, lie so far from a lamp; lamps 12° apart."""
    rng = np.random.default_rng(5)
    usual = assumed_surface().pixels
    along, across = np.radians(rng.normal([[mirror_deg / 2], [0]], 1, (2, len(usual))))
    normal = np.stack([np.sin(along), np.sin(across), np.cos(along) * np.cos(across)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pixels = replace(usual, normal=normal.astype(np.float32), shape=np.full_like(usual.shape, c))
    angle = np.radians(np.arange(-60, 61, 12))
    lights = Lights(tuple(map(str, range(len(angle)))), arm_direction(angle))
    camera = Camera(np.array([0.0, 0.0, 1.0]))
    seen = render_pixels(pixels, lights, camera)
    seen = seen * rng.normal(1, 0.01, seen.shape) + rng.normal(0, 0.001, seen.shape)
    found = coverage(seen.astype(np.float32), lights, camera)
    assert found.narrowest_deg < found.gap_deg
    assert not found.enough


def test_a_glossy_painting_under_lamps_far_apart_is_not_said_to_be_blurred(tmp_path):
    """Its highlights come and go from field to field of the frame; a blur is everywhere."""
    path = write_plan(tmp_path, sample="e", arm=range(-60, 61, 12), times=(1, 0.0625), calibration=())
    assert stand.run(path, tmp_path / "photos", say=quiet).again == 0
