"""Every photograph held out once, in rounds of fits."""

import shutil

import numpy as np
import pytest

import impasto
from impasto.errors import OptionError
from impasto.evaluate.held_out import fold_lights
from impasto.geometry import zenith_azimuth
from impasto.store import open_stack
from impasto.summaries.evaluate import evaluate_tables
from impasto.summaries.words import percent
from store_files import contents


def test_folds_part_the_lights_and_are_spread(painting):
    lights = open_stack(painting).lights
    folds = fold_lights(lights, 3)
    assert sorted(index for fold in folds for index in fold) == list(range(len(lights)))
    zenith, _ = zenith_azimuth(lights.direction)
    for fold in folds:
        assert abs(len(fold) - len(lights) / 3) < 1
        assert np.degrees(abs(zenith[fold].mean() - zenith.mean())) < 10


@pytest.mark.parametrize("count", [1, 1000])
def test_folds_have_to_be_possible(painting, count):
    with pytest.raises(OptionError, match="--folds"):
        impasto.evaluate(painting, folds=count)
    with pytest.raises(OptionError, match="every photograph once"):
        impasto.evaluate(painting, folds=2, held_out=3)


def test_the_rounds_are_those_of_single_evaluations(painting, tmp_path):
    before = contents(painting)
    whole = impasto.evaluate(painting, models=["phong"], folds=2)
    stack = open_stack(painting)
    names = stack.lights.names
    assert sorted(whole.held_out) == sorted(names)
    (model,) = whole.models
    assert tuple(entry.name for entry in model.lights) == whole.held_out
    assert contents(painting) == before
    assert len(whole.baselines[0].lights) == len(names)
    assert model.mean.psnr_db == pytest.approx(np.mean([entry.errors.psnr_db for entry in model.lights]))
    store = tmp_path / "p.zarr"  # which keeps what is found of single rounds
    shutil.copytree(painting, store)
    halves = []
    for fold in fold_lights(stack.lights, 2):
        chosen = [names[index] for index in fold]
        alone = impasto.evaluate(store, models=["phong"], held_out_lights=chosen, baselines=False)
        halves.append(alone.models[0])
    assert model.lights == halves[0].lights + halves[1].lights
    squared = [half.shares.samples * half.shares.rms**2 for half in halves]
    for source in ("model", "lights", "shadows", "noise", "sampling"):
        parts = [getattr(half.shares, source) * error for half, error in zip(halves, squared, strict=True)]
        assert getattr(model.shares, source) == pytest.approx(sum(parts) / sum(squared))
    assert model.shares.samples * model.shares.rms**2 == pytest.approx(sum(squared))
    assert model.shares.photographs == len(names)
    told = "\n".join(" ".join((heading, *map(" ".join, rows))) for heading, _, rows in evaluate_tables(whole))
    assert f"phong {percent(model.shares.model)}" in told
