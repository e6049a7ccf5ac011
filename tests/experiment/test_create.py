"""Stimuli: reference and candidates alike but for the rendering, kept from run to run, and described."""

import json
from itertools import combinations

import numpy as np
import pytest
from tests.arm_scenes import make_scene

import impasto
from impasto.errors import OptionError, OutputError, StoreError
from impasto.psychophysics import stimuli
from impasto.psychophysics.experiment.angles import choose_angles, common_angles
from impasto.psychophysics.experiment.create import ANSWERS
from impasto.psychophysics.experiment.manifest import (
    DIMMED,
    PHOTOGRAPH,
    ExperimentError,
    read_experiment,
)
from impasto.render.display import requested_rendition
from impasto.store import open_stack

MODELS = ["torrance-sparrow", "phong"]


def picture(path):
    from PIL import Image

    with Image.open(path) as image:
        assert image.info["icc_profile"]
        return np.asarray(image)


@pytest.fixture(scope="module")
def made(painting, tmp_path_factory):
    folder = tmp_path_factory.mktemp("experiment") / "made"
    return impasto.experiment.create([painting], out=folder, angles=4), read_experiment(folder)


@pytest.fixture(scope="module")
def groups(painting, tmp_path_factory):
    names = open_stack(painting).lights.names
    file = tmp_path_factory.mktemp("groups") / "groups.json"
    content = {
        "groups": [
            {"name": "8 angles", "photographs": names[::2], "recommended": True},
            {"name": "15 angles", "photographs": names[:-1], "recommended": False},
        ],
        "test_lights": [names[1], names[-1]],
    }
    file.write_text(json.dumps(content))
    return file


def test_every_sample_angle_and_two_models_is_a_pair(made):
    summary, experiment = made
    assert (summary.pairs, len(experiment.pairs), summary.stimuli) == (4, 4, 16)
    assert {pair[2:] for pair in experiment.pairs} == {tuple(MODELS)}
    assert {pair[1] for pair in experiment.pairs} == set(summary.angles)
    assert 0 < len(summary.with_highlight) < 4
    assert any("used photographs that are references" in note for note in summary.notes)


def test_the_reference_is_the_photograph_through_the_display_chain(made, painting):
    summary, experiment = made
    stack = open_stack(painting)
    (sample,) = experiment.samples
    for angle in experiment.angles:
        light = stack.lights.names.index(angle.photographs["painting"])
        radiance = stack.radiance(slice(0, 44), slice(0, 60), [light])[0]
        options = {"display": "srgb", "white_point": None, "adaptation": "cat16", "highlights": "clip"}
        rendition = requested_rendition(
            stack, exposure=sample.exposure / stack.lights.intensity[light].mean(), **options
        )
        expected = np.rint(rendition(radiance).drive * 255)
        (entry,) = (
            stimulus
            for stimulus in experiment.stimuli
            if (stimulus.angle, stimulus.condition) == (angle.label, PHOTOGRAPH)
        )
        np.testing.assert_allclose(picture(summary.folder / entry.file), expected, atol=1)


def test_candidates_are_the_renderings_at_the_same_exposure(made, painting, tmp_path):
    summary, experiment = made
    stack, files = open_stack(painting), experiment.pictures()
    (sample,) = experiment.samples
    for angle in experiment.angles:
        light = stack.lights.names.index(angle.photographs["painting"])
        impasto.render(
            painting,
            model="phong",
            lights=stack.lights.select([light]),
            out=tmp_path,
            exposure=sample.exposure / stack.lights.intensity[light].mean(),
        )
        expected = picture(tmp_path / f"{angle.photographs['painting']}.png").astype(int)
        (file,) = (
            stimulus.file
            for stimulus in experiment.stimuli
            if stimulus.sha256 == files["painting", angle.label, "phong"]
        )
        np.testing.assert_allclose(picture(summary.folder / file), expected, atol=1)


def test_catch_trials_have_an_obvious_answer(made):
    summary, experiment = made
    assert len(experiment.catches) == 4
    for pair in experiment.catches:
        assert (pair.condition_a, pair.condition_b) == (PHOTOGRAPH, DIMMED)
    brightness = {
        condition: np.mean([
            picture(summary.folder / entry.file).mean()
            for entry in experiment.stimuli
            if entry.condition == condition
        ])
        for condition in (PHOTOGRAPH, DIMMED)
    }  # fmt: skip
    assert brightness[DIMMED] < 0.85 * brightness[PHOTOGRAPH]


def test_pictures_are_made_once_and_again_when_damaged(made, painting):
    summary, experiment = made
    again = impasto.experiment.create([painting], out=summary.folder, angles=4)
    assert again.rendered == 0
    assert read_experiment(summary.folder) == experiment
    damaged = summary.folder / experiment.stimuli[3].file
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[:-20])
    with pytest.raises(ExperimentError, match="is not the picture"):
        read_experiment(summary.folder)
    assert impasto.experiment.create([painting], out=summary.folder, angles=4).rendered == 1
    assert damaged.read_bytes() == whole


def test_groups_of_angles_compete_with_the_real_image(painting, groups, tmp_path):
    summary = impasto.experiment.create(
        [painting], out=tmp_path / "e", design="angle-groups", groups=[groups], models=["phong"]
    )
    experiment = read_experiment(tmp_path / "e")
    assert summary.conditions == ("8 angles", "15 angles", PHOTOGRAPH)
    assert len(summary.angles) == 2
    assert [pair[2:] for pair in experiment.pairs] == 2 * list(combinations(summary.conditions, 2))
    eight, fifteen, real = experiment.conditions
    assert (len(eight.photographs["painting"]), eight.recommended, eight.reference_in_fit) == (8, True, False)
    assert (len(fifteen.photographs["painting"]), fifteen.recommended) == (15, False)
    assert fifteen.reference_in_fit
    assert real.model is None
    files = experiment.pictures()
    for angle in summary.angles:
        assert len({files["painting", angle, condition] for condition in summary.conditions}) == 3
    # The fits in the store and the folder it lies in stay as they were.
    assert not list(painting.parent.glob(".painting.zarr.*"))
    again = impasto.experiment.create(
        [painting], out=tmp_path / "e", design="angle-groups", groups=[groups], models=["phong"]
    )
    assert again.rendered == 0


def test_a_group_is_rendered_as_a_fit_without_the_other_photographs(painting, groups, tmp_path):
    from impasto.store.borrow import borrowed_stack

    folder = tmp_path / "e"
    impasto.experiment.create(
        [painting], out=folder, design="angle-groups", groups=[groups], models=["phong"], exposure=2.0
    )
    experiment = read_experiment(folder)
    stack = open_stack(painting)
    angle = experiment.angles[0]
    light = stack.lights.names.index(angle.photographs["painting"])
    with borrowed_stack(painting) as second:
        options = impasto.FitOptions(exclude=stack.lights.names[1::2])
        impasto.fit(second, models=["phong"], procedure="joint", options=options)
        impasto.render(
            second,
            model="phong",
            lights=stack.lights.select([light]),
            out=tmp_path,
            exposure=2.0 / stack.lights.intensity[light].mean(),
        )
    digest = experiment.pictures()["painting", angle.label, "8 angles"]
    (file,) = (entry.file for entry in experiment.stimuli if entry.sha256 == digest)
    expected = picture(tmp_path / f"{angle.photographs['painting']}.png").astype(int)
    np.testing.assert_allclose(picture(folder / file), expected, atol=1)


def test_what_answers_refer_to_is_not_changed(painting, tmp_path):
    impasto.experiment.create([painting], out=tmp_path / "e", angles=2)
    (tmp_path / "e" / ANSWERS).touch()
    impasto.experiment.create([painting], out=tmp_path / "e", angles=2, title="Other words")
    with pytest.raises(ExperimentError, match="holds answers to other pictures"):
        impasto.experiment.create([painting], out=tmp_path / "e", angles=3)
    assert read_experiment(tmp_path / "e").texts.title == "Other words"


def test_a_folder_of_something_else_is_left_alone(painting, tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputError, match="not made by impasto experiment create"):
        impasto.experiment.create([painting], out=tmp_path)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"design": "models", "models": ["phong"]}, OptionError, "two are compared at least"),
        ({"models": ["phong", "ward"]}, StoreError, "no such fit"),
        ({"design": "angle-groups"}, OptionError, "needs a file of groups"),
        ({"angles": ["nowhere"]}, OptionError, "neither an angle nor a photograph"),
        ({"crop": (50, 0, 20, 20)}, OptionError, "does not lie within"),
        ({"display": "nothing"}, OptionError, "neither a display's name"),
        ({"longest": 4}, OptionError, "expected 32 to 4096"),
    ],
)
def test_what_cannot_be_shown_is_refused(painting, tmp_path, options, error, message):
    with pytest.raises(error, match=message):
        impasto.experiment.create([painting], out=tmp_path / "e", **options)


def test_views_are_reduced_in_linear_light(painting):
    stack = open_stack(painting)
    view = stimuli.choose_view((44, 60), (1, 2, 59, 41), 32)
    assert (view.factor, view.size, view.crop_px) == (2, (20, 29), (1, 2, 58, 40))
    (reduced,) = stimuli.photographs(stack, view, [3])
    whole = stack.radiance(slice(0, 44), slice(0, 60), [3])[0]
    expected = whole[2:42, 1:59].reshape(20, 2, 29, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(reduced, expected, rtol=1e-5)


def test_missing_samples_do_not_count_and_infinite_ones_stay_bright():
    reduced = stimuli._Reduced(1, stimuli.View(slice(0, 2), slice(0, 4), 2), 1)
    row = np.array([[np.nan, 0.5, np.inf, 0.5]], np.float32)
    reduced.add(slice(0, 1), row[None, :, :, None])
    reduced.add(slice(1, 2), np.full((1, 1, 4, 1), [[[0.7]]], np.float32))
    left, right = reduced.result()[0, 0, :, 0]
    assert left == pytest.approx((0.5 + 0.7 + 0.7) / 3)
    assert right > 1000


def test_angles_cover_both_kinds(painting):
    angles = common_angles({"painting": open_stack(painting)})
    assert len(angles) == 16
    shares = np.linspace(0, 0.4, 16)
    chosen = choose_angles(angles, shares, 7)
    with_highlight = [shares[angles.index(angle)] > 0.1 for angle in chosen]
    assert with_highlight.count(True) == 4
    # Where one kind is missing, the other fills up.
    assert len(choose_angles(angles, np.zeros(16), 7)) == 7
    assert len(choose_angles(angles, np.ones(16), 99)) == 16


def test_small_groups_on_an_arm_are_fitted_too(tmp_path):
    """The paper's procedure, by which the store is fitted, would refuse five lights."""
    store = make_scene(tmp_path / "photos").store
    impasto.fit(store, models=["torrance-sparrow"], show_progress=False)
    names = open_stack(store).lights.names
    content = {"groups": [{"name": "5 angles", "photographs": names[2::8]}], "test_lights": names[1:9:3]}
    (tmp_path / "groups.json").write_text(json.dumps(content))
    summary = impasto.experiment.create(
        [store], out=tmp_path / "e", design="angle-groups", groups=[tmp_path / "groups.json"]
    )
    assert summary.conditions == ("5 angles", PHOTOGRAPH)
    degrees = [float(angle) for angle in summary.angles]
    assert degrees == sorted(degrees)
    assert len(degrees) == 3
