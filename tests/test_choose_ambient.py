"""The ambient term, fitted where lights left out bear it out."""

import shutil

import pytest
import zarr

import impasto
from impasto.errors import OptionError
from impasto.fit import FitOptions
from impasto.models import MODELS, with_ambient
from impasto.store import fitted_models, open_fit, open_stack


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Return a store of swatches under a dome of lights, without any light but theirs."""
    folder = tmp_path_factory.mktemp("ambient")
    impasto.simulate(
        folder / "photos", preset="swatches", dome=True, lights=32, size=(64, 48), seed=6, calibration=False
    )
    impasto.stack(folder / "photos", folder / "p.zarr")
    return folder / "p.zarr"


@pytest.fixture
def copy(plain, tmp_path):
    return shutil.copytree(plain, tmp_path / "p.zarr")


def lighten(store, share):
    """Add to every photograph what the room reflects: a share of the painting's mean radiance."""
    offset = open_stack(store).radiance(slice(0, 48), slice(0, 64)).mean() * share
    group = zarr.open_group(store / "stack", mode="r+")
    group.attrs["offset"] = group.attrs["offset"] + float(offset)


@pytest.mark.parametrize("share", [0.0, 0.05])
@pytest.mark.parametrize("name", ["torrance-sparrow", "torrance-sparrow-ambient", "lambert", "phong"])
def test_the_term_is_fitted_where_there_is_ambient_light(copy, name, share):
    lighten(copy, share)
    (done,) = impasto.fit(copy, models=[name], choose_ambient=True).models
    assert MODELS[done.model].ambient == (share > 0)
    assert fitted_models(copy) == [done.model]
    found = open_fit(copy, done.model).attributes["ambient_left_out_db"]
    assert (found["with"] - found["without"] > 0.1) == (share > 0)
    (note,) = [note for note in done.notes if note.startswith("ambient term:")]
    assert f"{found['with']:.2f} dB" in note


def test_the_same_again_is_already_there_and_is_what_the_name_alone_gives(copy):
    first = impasto.fit(copy, models=["torrance-sparrow"], choose_ambient=True).models[0]
    again = impasto.fit(copy, models=["torrance-sparrow-ambient"], choose_ambient=True).models[0]
    assert (again.model, again.already, again.notes) == (first.model, True, first.notes)
    assert impasto.fit(copy, models=[first.model]).models[0].already


def test_too_few_lights_for_one_more_unknown_leave_the_term_away(plain, copy):
    names = open_stack(plain).lights.names
    options = FitOptions(exclude=names[5:])
    (done,) = impasto.fit(copy, models=["torrance-sparrow"], choose_ambient=True, options=options).models
    assert done.model == "torrance-sparrow"


def test_the_papers_procedure_does_not_choose(tmp_path):
    impasto.simulate(tmp_path / "photos", sample="c", arm=True, lights=21, size=(32, 24), calibration=False)
    impasto.stack(tmp_path / "photos", tmp_path / "p.zarr")
    with pytest.raises(OptionError, match="--choose-ambient: is no option of the paper"):
        impasto.fit(tmp_path / "p.zarr", models=["phong"], choose_ambient=True)


@pytest.mark.parametrize("name", MODELS)
def test_every_model_has_both_forms(name):
    forms = [with_ambient(MODELS[name], ambient) for ambient in (False, True)]
    assert [form.ambient for form in forms] == [False, True]
    assert MODELS[name] in forms
    assert forms[0].shape == forms[1].shape == MODELS[name].shape
