"""Checks of photographs: faults put into real photographs are found, and nothing in the originals."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, shift
from stands import faulty_light, quiet, write_plan

from impasto import stand
from impasto.calibrate.shots import read_shot
from impasto.capture import read_capture
from impasto.errors import CaptureError
from impasto.geometry import Camera, arm_direction, tilt_direction
from impasto.images import write_png
from impasto.stand.checks.exposure import as_planned
from impasto.stand.checks.movement import shift_px
from impasto.stand.checks.order import exchanged
from impasto.stand.checks.spheres import check_spheres, faults, highlight
from impasto.stand.judge import Judge
from impasto.stand.look import look_at
from impasto.stand.plan_file import Limits
from impasto.stand.steps import Shot

# Every so many photographs of a series get each fault: all of them would take minutes.
SERIES = {"icon": ("icon", None, 18), "cat": ("cat/Objects", "cat/light_directions.txt", 4)}


@dataclass
class Series:
    capture: object
    looks: dict
    judge: Judge
    step: int

    def altered(self, folder, change):
        """Yield name, finding checks and shift of every so many photographs, each altered."""
        for number, name in enumerate(self.capture.lights.names):
            if number % self.step == 2:
                shot, look = self.looks[name]
                codes = read_shot(look.photograph.path).codes.astype(np.float64)
                image = np.clip(np.rint(change(codes, number)), 0, 255).astype(np.uint8)
                write_png(folder / "altered.png", image, None)
                other = look_at(folder / "altered.png", "srgb")
                self.judge.forget(name)
                checks = {finding.check for finding in self.judge.judge(shot, other)}
                self.judge.accept(shot, look)
                yield name, checks, self.judge.shift_px[shot.name]


@pytest.fixture(scope="module", params=SERIES)
def series(request, shared):
    folder, lights, step = SERIES[request.param]
    captures = shared / "captures"
    capture = read_capture(captures / folder, lights and captures / lights)
    judge = Judge(capture.lights, capture.camera, Limits(clipped=1))
    looks = {}
    for name, photograph in zip(capture.lights.names, capture.photographs, strict=True):
        looks[name] = Shot(name, "painting", name, 1.0, 0, True), look_at(photograph.path, "srgb").thinned()
        judge.accept(*looks[name])
    return Series(capture, looks, judge, step)


def test_nothing_is_found_in_the_originals_as_they_come_one_by_one(series):
    judge = Judge(series.capture.lights, series.capture.camera, Limits(clipped=1))
    for shot, look in series.looks.values():
        assert judge.judge(shot, look) == []
        judge.accept(shot, look)


@pytest.mark.parametrize("pixels", [0.5, 2, 10])
def test_a_shift_is_found(series, tmp_path, pixels):
    def moved(codes, number):
        # Another direction for each photograph.
        down, right = pixels * np.sin(number), pixels * np.cos(number)
        return shift(codes, (down, right, 0), order=3, mode="nearest")

    for name, checks, found in series.altered(tmp_path, moved):
        assert "moved" in checks, name
        assert abs(np.hypot(*found) - pixels) < 0.3


@pytest.mark.parametrize("pixels", [1, 2, 3])
def test_a_blur_is_found(series, tmp_path, pixels):
    def blurred(codes, number):
        return gaussian_filter(codes, (pixels, pixels, 0))

    for name, checks, _ in series.altered(tmp_path, blurred):
        assert "blurred" in checks, name


def test_exchanged_lamps_are_found_and_no_others(series):
    names = list(series.capture.lights.names)
    looks = [look for _, look in series.looks.values()]
    direction = series.capture.lights.direction
    assert exchanged(names, looks, direction) == []
    angle = np.degrees(np.arccos(np.clip(direction @ direction.T, -1, 1)))
    rng = np.random.default_rng(3)
    for _ in range(6):
        a = int(rng.integers(len(names)))
        b = int(rng.choice(np.flatnonzero(angle[a] > 28)))
        order = list(range(len(names)))
        order[a], order[b] = b, a
        found = exchanged(names, [looks[number] for number in order], direction)
        assert [set(finding.photographs) for finding in found] == [{names[a], names[b]}]


def test_clipping_and_movement_of_a_real_capture_are_reported(shared):
    """2.5 % of the icon's samples are clipped, as its description says; it lies still."""
    found = stand.check(shared / "captures" / "icon")
    assert found.photographs == 72
    assert found.clipped.mean() == pytest.approx(0.025, abs=0.001)
    assert np.nanmax(np.hypot(*found.shift_px.T)) < 0.3
    assert {finding.check for finding in found.findings} == {"clipped"}
    assert found.coverage.lights == 72


def test_an_exposure_that_the_camera_says_was_another_is_named(tmp_path):
    """A shutter set by hand: 1/60 s where 1/8 s was planned, and 1/6 s."""
    write_png(tmp_path / "seen.png", np.full((16, 16, 3), 99, np.uint8), None)
    look = look_at(tmp_path / "seen.png")
    shot = Shot("arm", "painting", "arm", 1 / 8, 0, True)

    def noted(seconds):
        return replace(look, photograph=replace(look.photograph, exposure_s=seconds))

    assert as_planned(look, shot) == []  # the file does not say
    assert as_planned(noted(0.125), shot) == as_planned(noted(0.13), shot) == []
    (finding,) = as_planned(noted(1 / 60), shot)
    assert "exposed for 1/60 s by its EXIF data, planned are 1/8 s" in finding.what
    assert as_planned(noted(1 / 6), shot)


def test_photographs_of_nothing_are_no_copies_of_each_other(tmp_path):
    """Two dark frames without noise are equal, and two cards that are clipped all over."""
    plan = write_plan(tmp_path, arm=(0, 10), times=(4,), calibration=("dark", "white"))
    plan.write_text(plan.read_text().replace("exposure = 0.5", "exposure = 50"))
    with pytest.raises(CaptureError, match=r"calibration/white: clipped: 100\.00% of the samples"):
        stand.run(plan, tmp_path / "photos", say=quiet)


def test_what_cannot_be_told_is_not_told(tmp_path):
    """Two photographs of nothing but noise have no edges in common."""
    rng = np.random.default_rng(0)
    looks = []
    for number in range(5):
        write_png(tmp_path / "noise.png", rng.integers(60, 190, (64, 96, 3)).astype(np.uint8), None)
        looks.append(look_at(tmp_path / "noise.png"))
        assert number == 0 or shift_px(looks[-1], looks[:-1]) is None


@pytest.fixture(scope="module")
def spheres(tmp_path_factory):
    """Return photographs of two mirror spheres under five lamps."""
    folder = tmp_path_factory.mktemp("spheres")
    plan = write_plan(folder, arm=(-50, -25, 0, 25, 50), times=(1,), calibration=("spheres",))
    stand.run(plan, folder / "photos", say=quiet)
    return sorted((folder / "photos" / "calibration" / "spheres").glob("*.tif"))


def test_clean_spheres_are_not_complained_of_and_show_mirrored_lamps(spheres):
    """The plan's angles run the other way than the arm's: each photograph by itself is as it should be."""
    camera = Camera(tilt_direction(0.0, np.radians(5.0)))
    paths = {path.stem: path for path in spheres}
    planned = {name: arm_direction(np.radians(float(name[3:]))) for name in paths}
    assert check_spheres(paths, planned, camera) == []
    mirrored = {name: at * [-1, 1, 1] for name, at in planned.items()}
    (finding,) = check_spheres(paths, mirrored, camera)
    assert finding.check == "order"
    assert finding.photographs == ("arm+025", "arm+050", "arm-025", "arm-050")  # 0° is its own mirror image
    assert re.search(r"the lamp stands (4[89]|5[01]) to (9[89]|10[01])° from where", finding.what)


def test_an_arm_that_runs_the_other_way_is_named_before_the_painting_is_photographed(tmp_path):
    plan = write_plan(tmp_path, arm=(-50, -25, 0, 25, 50), times=(1,), calibration=("spheres",))
    other = str.maketrans("+-", "-+")
    open_light = faulty_light(lambda name, times: name if name == "arm+000" else name.translate(other))
    with pytest.raises(CaptureError, match="from where the plan has it, in 4 of 5 photographs"):
        stand.run(plan, tmp_path / "photos", open_light=open_light, say=quiet)
    assert list((tmp_path / "photos").glob("*.tif")) == []


def test_real_spheres_are_not_complained_of(shared):
    """Their lamps have odd shapes, their highlights are clipped, and they are scratched."""
    folder = shared / "captures" / "cat" / "LightProbe-2"
    paths = {path.stem: path for path in sorted(folder.glob("Image*.JPG"))}
    capture = read_capture(folder.parent / "Objects", folder.parent / "light_directions.txt")
    planned = dict(zip(capture.lights.names, capture.lights.direction, strict=True))
    assert check_spheres(paths, planned, Camera()) == []


def test_a_speck_on_a_highlight_is_named():
    """A lamp of 15 pixels in a sphere, whole, bitten into, and split by a hair."""
    rows, columns = np.mgrid[:120, :120]
    image = np.where(np.hypot(rows - 60, columns - 60) < 50, 0.05, 0.01)
    lamp = np.hypot(rows - 50, columns - 70) < 7.5
    bitten = lamp & (np.hypot(rows - 46, columns - 74) >= 6)
    hair = lamp & (np.abs(rows - 50) > 1)
    seen = [
        highlight(np.where(spot, 1.0, image), np.zeros_like(lamp), (60.0, 60.0, 50.0))
        for spot in (lamp, lamp, bitten, hair, lamp)
    ]
    said = faults(seen)
    assert [bool(what) for what in said] == [False, False, True, True, False]
    assert "has a speck in it" in said[2]
    assert "is split" in said[3]
