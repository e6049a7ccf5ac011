"""Whose the error is: each source switched on alone in the simulator, and all together."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

import impasto
from impasto.evaluate.held_out import spread_lights
from impasto.evaluate.shares import Photographed, error_shares
from impasto.fit import FitOptions
from impasto.geometry import Lights
from impasto.models import parse_model
from impasto.store import open_stack

MODEL = parse_model("torrance-sparrow")
HELD = 5
SOURCES = ("model", "lights", "shadows", "noise", "sampling")


@pytest.fixture(scope="module")
def photographed(tmp_path_factory):
    """Return what photographs swatches on a steep relief, with what is asked for, and holds five out."""

    def make(preset="swatches", relief_scale=3.0, exposure=0.02, lights=32, **options):
        folder = tmp_path_factory.mktemp("shares")
        impasto.simulate(
            folder / "photos",
            preset=preset,
            relief_scale=relief_scale,
            size=(48, 36),
            lights=lights,
            dome=True,
            exposure=exposure,
            calibration=False,
            **options,
        )
        impasto.stack(folder / "photos", folder / "p.zarr")
        stack = open_stack(folder / "p.zarr")
        count, height, width, channels = stack.shape
        row, column = np.divmod(np.arange(height * width), width)
        held = np.zeros(count, bool)
        held[spread_lights(stack.lights, HELD)] = True
        return Photographed(
            radiance=stack.radiance(slice(0, height), slice(0, width)).reshape(count, -1, channels),
            held_out=held,
            lights=stack.lights,
            camera=stack.camera,
            light_rgb=stack.light_rgb,
            clip_level=stack.clip_level,
            noise=stack.noise,
            row=row,
            column=column,
            size=(height, width),
        )

    return make


@pytest.fixture(scope="module")
def still_life(photographed):
    """Return what photographs a still life of the model's own materials under lights that tell all of it."""
    return lambda **options: photographed("still-life", exposure=0.1, lights=96, **options)


@pytest.fixture(scope="module")
def clean(still_life):
    return still_life(noise=False, cast_shadows=False)


def misstated(seen, gain=0.1, turn_deg=1.5):
    rng = np.random.default_rng(7)
    lights = seen.lights
    direction = lights.direction + np.radians(turn_deg) * rng.normal(size=lights.direction.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    intensity = lights.intensity * np.exp(gain * rng.normal(size=(len(lights), 1)))
    return replace(seen, lights=Lights(lights.names, direction, intensity=intensity))


def shares(seen, model=MODEL, **options):
    found = error_shares(model, seen, FitOptions(**options))
    assert sum(getattr(found, source) for source in SOURCES) == pytest.approx(1.0)
    assert all(getattr(found, source) >= 0 for source in SOURCES)
    assert found.photographs == HELD
    return found


def test_noise_alone_is_the_noise_s(still_life):
    assert shares(still_life(cast_shadows=False)).noise > 0.9


@pytest.mark.parametrize(("gain", "turn_deg"), [(0.1, 0.0), (0.0, 1.5), (0.1, 1.5)])
def test_lights_misstated_alone_are_the_lights(clean, gain, turn_deg):
    assert shares(misstated(clean, gain, turn_deg)).lights > 0.9


def test_cast_shadows_alone_are_the_shadows(photographed):
    found = shares(photographed(model="lambert", noise=False))
    assert found.shadows > 0.9
    assert 0.01 < found.shadowed < 0.1


def test_a_painting_that_casts_none_has_none(clean):
    assert shares(clean).shadowed == 0.0


def test_a_model_that_lacks_the_highlight_has_the_error(clean):
    assert shares(clean, parse_model("lambert")).model > 0.9


def test_highlights_that_only_photographs_held_out_show_are_their_number_s(photographed):
    options = {"noise": False, "cast_shadows": False}
    few, many = (shares(photographed(lights=lights, **options)) for lights in (32, 96))
    assert few.sampling > 0.9
    assert many.rms < few.rms / 5


def test_an_unknown_material_is_not_taken_for_the_lights(photographed, shared):
    measured = shared / "reference" / "measured_brdf.npz"
    seen = photographed(
        "still-life", 1.0, 0.25, lights=48, measured=measured, noise=False, cast_shadows=False
    )
    right, off = shares(seen), shares(misstated(seen))
    assert right.model > 0.8
    assert right.lights < 0.1
    added = 1.0 - (right.rms / off.rms) ** 2
    assert off.lights == pytest.approx(added, abs=0.1)


def test_all_together_each_has_a_part(photographed):
    found = shares(misstated(photographed()))
    assert found.lights > 0.05
    assert found.shadows > 0.2
    lambert = shares(misstated(photographed()), parse_model("lambert"))
    assert lambert.model > found.model + 0.1


def test_a_fit_by_the_residual_is_judged_without_it(clean):
    assert shares(misstated(clean), residual=True) == shares(misstated(clean))


def test_evaluate_keeps_the_shares_and_the_report_shows_them(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    summary = impasto.evaluate(store, held_out=2, baselines=False)
    found = {entry.model: entry.shares for entry in summary.models}
    assert all(entry.pixels > 0 and entry.photographs == 2 for entry in found.values())
    page = tmp_path / "report.html"
    written = impasto.report(store, page)
    assert "Where the error comes from" in written.sections
    text = page.read_text(encoding="utf-8")
    assert "on the photographs kept out of the fit" in text
    for entry in found.values():
        for source in SOURCES:
            assert f"<td>{100 * getattr(entry, source):.1f}\u00a0%</td>" in text
