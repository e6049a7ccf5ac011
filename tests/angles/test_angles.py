"""The study of a capture: chosen photographs, their verified error, groups, files and what is refused."""

import csv
import json

import numpy as np
import pytest

import impasto
from impasto.angles.photographed import sample_stack
from impasto.angles.refit import Refit, Score
from impasto.angles.study import Study
from impasto.capture.light_files import read_light_file
from impasto.errors import OptionError, StoreError
from impasto.fit import FitOptions
from impasto.models import MODELS
from impasto.psychophysics.experiment.groups import read_groups
from impasto.store import open_stack


@pytest.fixture(scope="module")
def summary(arm_store, interleaved, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return impasto.angles(
        arm_store,
        held_out_lights=interleaved,
        sizes=[6, 9, 12, 16, 24],
        pixels=1500,
        draws=5,
        image=True,
        out=folder,
        groups=folder / "groups.json",
        show_progress=False,
    )


def test_fewer_chosen_photographs_serve_than_evenly_spaced_ones(summary):
    """Judged by interleaved angles, within 5 % of the RMS of all 37."""
    whole = summary.models[0].regions[0]
    best, even = whole.recommended["optimal"], whole.recommended["even"]
    assert best.errors.rms <= 1.05 * whole.full.rms
    assert best.size <= 12
    assert best.size < even.size


def test_the_choice_never_sees_what_judges_it(summary, interleaved):
    assert not set(summary.candidates) & set(interleaved)
    for point in summary.models[0].points:
        assert not set(point.photographs) & set(interleaved)
        assert len(set(point.photographs)) == point.size


def test_what_is_expected_is_found(summary):
    """Where all fits find their way, the expected error is the verified one within a third."""
    study = summary.models[0]
    near = [p for p in study.points if p.errors.rms < 2 * study.regions[0].full.rms]
    assert len(near) >= 6
    for point in near:
        assert point.expected == pytest.approx(point.errors.rms, rel=1 / 3)


def test_random_sets_are_a_band_above_the_chosen(summary):
    study = summary.models[0]
    chosen = {p.size: p.errors.rms for p in study.points if p.strategy == "optimal"}
    for each in study.random:
        assert each.low <= each.median <= each.high
        if 9 <= each.size < 37:
            assert chosen[each.size] < each.median


def test_the_image_has_the_error_of_its_sample(summary):
    study = summary.models[0]
    best = study.regions[0].best
    assert study.image_rms[f"{best.strategy} {best.size}"] == pytest.approx(best.errors.rms, rel=0.1)


def test_files_can_be_read_again(summary, arm_store):
    best = summary.models[0].regions[0].best
    names = {path.name: path for path in summary.files}
    assert set(names) == {
        "torrance-sparrow.png",
        "torrance-sparrow.csv",
        "torrance-sparrow-recommended.lp",
        "torrance-sparrow-recommended.csv",
        "groups.json",
    }
    lights = open_stack(arm_store).lights
    for ending in (".lp", ".csv"):
        file = read_light_file(names[f"torrance-sparrow-recommended{ending}"])
        assert not file.problems
        assert tuple(row.file for row in file.rows) == best.photographs
        for row in file.rows:
            assert row.direction == pytest.approx(lights.direction[lights.names.index(row.file)], abs=1e-4)
    with names["torrance-sparrow.csv"].open() as table:
        rows = list(csv.DictReader(table))
    assert {row["strategy"] for row in rows} == {"optimal", "even", "informed", "random"}


def test_groups_are_what_experiments_read(summary, arm_store):
    groups = read_groups([summary.files[-1]], {"h": open_stack(arm_store)})["h"]
    best = summary.models[0].regions[0].best
    assert [len(group.photographs) for group in groups.groups] == [6, 9, 12, 16, 24]
    (recommended,) = [group for group in groups.groups if group.recommended]
    assert len(recommended.photographs) >= best.size
    assert tuple(groups.test_lights) == summary.scored


def test_groups_alone_hold_out_seven_test_lights(arm_store, tmp_path):
    file = tmp_path / "groups.json"
    impasto.angles(arm_store, groups=file, pixels=200, draws=1, show_progress=False)
    content = json.loads(file.read_text())
    assert len(content["test_lights"]) == 7
    assert len(content["groups"]) == 5
    assert sum(group["recommended"] for group in content["groups"]) == 1
    for group in content["groups"]:
        assert not set(group["photographs"]) & set(content["test_lights"])


def test_pixels_without_a_fit_count_as_black(arm_store):
    stack = open_stack(arm_store)
    pixels = sample_stack(stack, 200)[0]
    refit, every = Refit(MODELS["torrance-sparrow"], FitOptions()), range(73)
    score = Score(pixels, every)
    fitted = refit(pixels, every)
    lost = refit(pixels, [0, 1])
    assert lost.missing.all()
    assert score.rms(lost) > 1 > score.rms(fitted)


def test_regions_have_numbers_of_their_own(arm_store, tmp_path):
    from PIL import Image

    drawn = np.zeros((48, 64), np.uint8)
    drawn[:, :20], drawn[:, 40:] = 100, 200
    Image.fromarray(drawn).save(tmp_path / "drawn.png")
    found = impasto.angles(
        arm_store, regions=tmp_path / "drawn.png", sizes=[8, 20], pixels=300, draws=1, show_progress=False
    )
    assert [region.name for region in found.models[0].regions] == ["whole painting", "100", "200"]
    assert all(100 <= region.pixels <= 300 for region in found.models[0].regions)


def test_few_lights_of_a_dome_are_compared_with_the_best_of_all_sets(painting):
    found = impasto.angles(painting, sizes=[6, 10], pixels=400, draws=2, show_progress=False)
    study = found.models[0]
    expected = {(p.strategy, p.size): p.expected for p in study.points}
    assert expected["exhaustive", 6] <= expected["optimal", 6] * (1 + 1e-9)
    assert expected["optimal", 6] < expected["even", 6]
    assert not found.in_plane


def test_a_study_is_the_same_each_time(arm_store, interleaved):
    stack = open_stack(arm_store)
    names = stack.lights.names
    scored = [names.index(name) for name in interleaved]
    candidates = [light for light in range(73) if light not in scored]
    refit = Refit(MODELS["torrance-sparrow"], FitOptions())
    first, second = (
        Study(sample_stack(stack, 300)[0], refit, candidates, scored).point("optimal", 9) for _ in range(2)
    )
    assert first == second


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"sizes": [99]}, "--sizes 99"),
        ({"pixels": 3}, "--pixels"),
        ({"measure": "ssim"}, "--measure"),
        ({"limit": -1.0}, "--tolerance"),
        ({"models": ["phongg"]}, "model 'phongg'"),
        ({"held_out": 69}, "--model torrance-sparrow"),
        ({"held_out": 3, "held_out_lights": ["light-001"]}, "--held-out and --held-out-lights"),
    ],
)
def test_what_cannot_be_used_is_refused(arm_store, options, told):
    with pytest.raises(OptionError) as caught:
        impasto.angles(arm_store, show_progress=False, **options)
    assert any(problem.where.startswith(told) for problem in caught.value.problems)


def test_no_store_is_a_store_error(tmp_path):
    with pytest.raises(StoreError):
        impasto.angles(tmp_path / "nothing.zarr")
