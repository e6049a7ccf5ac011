"""Held-out errors come from fits that have not seen the photographs."""

import importlib
import shutil
from pathlib import Path

import numpy as np
import pytest
import tifffile
import zarr

import impasto
from impasto.errors import OptionError
from impasto.fit import FitOptions
from impasto.light_strength import scale_lights
from impasto.store import open_stack, read_evaluation
from impasto.store.borrow import borrowed_stack

MODEL = "torrance-sparrow"
HELD = ("light-003", "light-009")
# The package; as an attribute of impasto, the name is the function.
MODULE = importlib.import_module("impasto.evaluate")


def listing(folder):
    return sorted((path, path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file())


def test_nothing_but_the_result_is_added_to_the_store(painting):
    def rest():
        return [entry for entry in listing(painting.parent) if "evaluations" not in entry[0].parts]

    before = rest()
    summary = impasto.evaluate(painting, models=["phong"], held_out=1)
    assert rest() == before
    kept = read_evaluation(painting, "phong")
    (entry,) = kept.attributes["lights"]
    assert entry["errors"]["rms_relative"] == summary.models[0].mean.rms_relative
    assert kept.attributes["options"]["exclude"] == list(summary.held_out)
    assert kept.attributes["stack_sha256"] == open_stack(painting).sha256


def test_a_store_that_may_only_be_read_is_judged_all_the_same(painting, tmp_path, monkeypatch):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    first = impasto.evaluate(store, models=["phong"], held_out=1, baselines=False)
    assert first.not_recorded == ""
    before, unlink = listing(store), Path.unlink

    def refuse(path, missing_ok=False):
        if path.is_relative_to(store):
            raise PermissionError(13, "Permission denied", str(path))
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    again = impasto.evaluate(store, models=["phong"], held_out=1, baselines=False)
    assert again.models == first.models
    assert "evaluations/phong/zarr.json: cannot be written" in again.not_recorded
    assert listing(store) == before


def test_the_renderings_that_are_kept_are_those_that_were_compared(painting):
    summary = impasto.evaluate(painting, models=["phong"], held_out=1)
    stack = open_stack(painting)
    _, height, width, _ = stack.shape
    light = stack.lights.names.index(summary.held_out[0])
    photograph = stack.radiance(slice(0, height), slice(0, width), [light])[0]
    rendering = read_evaluation(painting, "phong").renderings()[0]
    usable = np.isfinite(rendering) & (photograph < stack.clip_level)
    rms = np.sqrt(np.mean((rendering - photograph)[usable] ** 2)) / photograph[usable].mean()
    assert rms == pytest.approx(summary.models[0].mean.rms_relative, rel=1e-4)


def test_only_what_no_run_holds_any_more_is_swept(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    left, foreign = tmp_path / ".p.zarr.abcd_123.partial", tmp_path / ".q.zarr.abcd_123.partial"
    for folder in (left, foreign):
        (folder / "p.zarr").mkdir(parents=True)
        (folder / "p.zarr" / "stack").symlink_to(store / "stack")
    with borrowed_stack(store) as first:
        assert not left.exists()
        with borrowed_stack(store) as second:
            assert {first, second} == {folder / "p.zarr" for folder in tmp_path.glob(".p.zarr.*")}
        assert (first / "stack" / "zarr.json").is_file()
    assert foreign.is_dir()
    assert sorted(path.name for path in tmp_path.iterdir()) == [foreign.name, "p.zarr"]
    assert (store / "stack" / "zarr.json").is_file()


def test_held_out_photographs_do_not_enter_the_fit(capture, painting, tmp_path, monkeypatch):
    """Another picture in their place changes what is compared with, and not the renderings."""
    photos = tmp_path / "photos"
    shutil.copytree(capture, photos)
    for name in HELD:
        image = tifffile.imread(photos / f"{name}.tif")
        tifffile.imwrite(photos / f"{name}.tif", image[::-1, ::-1] // 3, photometric="rgb")
    spoilt = tmp_path / "spoilt.zarr"
    impasto.stack(photos, spoilt)

    rendered = []
    original = MODULE.render_bands

    def spy(*arguments, **options):
        for band in original(*arguments, **options):
            rendered.append(band.radiance)
            yield band

    monkeypatch.setattr(MODULE, "render_bands", spy)
    clean = impasto.evaluate(painting, models=[MODEL], held_out_lights=HELD)
    other = impasto.evaluate(spoilt, models=[MODEL], held_out_lights=[f"{name}.tif" for name in HELD])
    np.testing.assert_array_equal(rendered[0], rendered[1])
    assert clean.held_out == other.held_out == HELD
    assert clean.fitted == 14
    for before, after in zip(clean.models[0].lights, other.models[0].lights, strict=True):
        assert before.errors.psnr_db > after.errors.psnr_db + 5


def test_a_fit_that_has_not_seen_them_is_judged_itself(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    shutil.rmtree(store / "fits")
    impasto.fit(store, models=[MODEL], options=FitOptions(exclude=HELD))
    (judged,) = impasto.evaluate(store, held_out_lights=HELD).models
    (refitted,) = impasto.evaluate(painting, models=[MODEL], held_out_lights=HELD).models
    assert (judged.refitted, refitted.refitted) == (False, True)
    assert judged.lights == refitted.lights
    # It has seen this one.
    assert impasto.evaluate(store, held_out_lights=[*HELD, "light-000"]).models[0].refitted


def test_renderings_that_follow_the_lamps_strengths_are_judged_beside_those_that_do_not(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    shutil.rmtree(store / "fits")
    options = FitOptions(exclude=HELD, residual=True, residual_components=2, self_calibrate=False)
    impasto.fit(store, models=[MODEL], options=options)
    (plain,) = impasto.evaluate(store, held_out_lights=HELD, baselines=False).models
    assert plain.as_photographed is None
    group = zarr.open_group(store / "fits" / MODEL, mode="r+")
    term = dict(group.attrs["residual"])
    shape = len(term["weights"][0]), len(term["direction"])
    term["strength"] = {"length": 0.4, "weights": np.full(shape, 0.05).tolist()}
    group.attrs["residual"] = term
    (judged,) = impasto.evaluate(store, held_out_lights=HELD, baselines=False).models
    assert judged.mean == plain.mean
    stack = open_stack(store)
    _, height, width, _ = stack.shape
    held = [stack.lights.names.index(name) for name in HELD]
    stronger = scale_lights({"residual": term}, stack.lights.select(held)).intensity
    rms = []
    for photograph, rendering, strength in zip(
        stack.radiance(slice(0, height), slice(0, width), held),
        read_evaluation(store, MODEL).renderings(),
        stronger / stack.lights.intensity[held],
        strict=True,
    ):
        usable = np.isfinite(rendering) & (photograph < stack.clip_level)
        difference = (rendering * strength - photograph)[usable]
        rms.append(np.sqrt(np.mean(difference**2)) / photograph[usable].mean())
    assert np.mean(rms) == pytest.approx(judged.as_photographed.rms_relative, rel=1e-3)


def test_the_options_of_the_fit_in_the_store_are_kept(painting, tmp_path, monkeypatch):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    shutil.rmtree(store / "fits")
    options = FitOptions(loss="cauchy", index=1.6, exclude=("light-001",))
    impasto.fit(store, models=[MODEL], options=options)
    used = []
    original = MODULE.fit

    def spy(path, **arguments):
        used.append((path, arguments["options"]))
        return original(path, **arguments)

    monkeypatch.setattr(MODULE, "fit", spy)
    impasto.evaluate(store, held_out_lights=HELD)
    ((path, blind),) = used
    assert path != store
    assert (blind.loss, blind.index) == ("cauchy", 1.6)
    assert set(blind.exclude) == {"light-001", *HELD}


def test_errors_are_small_where_the_model_is_the_truth(painting):
    (model,) = impasto.evaluate(painting, models=[MODEL], held_out=3).models
    assert model.mean.psnr_db > 30
    assert model.mean.ssim > 0.95
    assert model.mean.predicted > 0.99


def test_one_way_to_choose_is_enough(painting):
    with pytest.raises(OptionError, match="one of them is expected"):
        impasto.evaluate(painting, held_out=2, held_out_lights=HELD)
