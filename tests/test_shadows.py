"""Cast shadows found per pixel and left out, on simulated paintings of which they are known."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import impasto
from impasto.capture.simulate.capture import set_up
from impasto.capture.simulate.settings import Settings
from impasto.errors import OptionError
from impasto.fit import FitOptions, fit_tile
from impasto.fit.deviating import deviating, tell_deviating
from impasto.fit.shadows import shadow_warnings
from impasto.models import parse_model
from impasto.pixels import pixels_of_maps, render_pixels
from impasto.store import Stack, open_fit, open_stack

LIGHTS = 40


@dataclass
class Capture:
    """A simulated painting under a dome of lights, pixels in a row."""

    store: object
    stack: Stack
    radiance: np.ndarray  # (L, P, C)
    visible: np.ndarray  # (L, P), of each light
    normal: np.ndarray
    c: np.ndarray

    def fit(self, *, model="torrance-sparrow", radiance=None, lights=None, left_out=None, **options):
        return fit_tile(
            parse_model(model),
            self.radiance if radiance is None else radiance,
            lights=lights or self.stack.lights,
            camera=self.stack.camera,
            light_rgb=self.stack.light_rgb,
            clip_level=self.stack.clip_level,
            noise=self.stack.noise,
            options=FitOptions(**options),
            left_out=left_out,
        )

    @property
    def shadowed(self):
        return self.visible < 0.5

    @property
    def telling(self):
        """Samples in a shadow that takes something away: the light would come from 10° above the surface."""
        cosine = (self.normal @ self.stack.lights.direction.T).T
        return self.shadowed & (cosine > np.sin(np.radians(10)))

    def normal_errors_deg(self, maps):
        chord = np.linalg.norm(maps["normal"] - self.normal, axis=1)
        return np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1)))


@pytest.fixture(scope="module")
def photographed(tmp_path_factory):
    """Return what photographs a painting, swatches on a steep relief unless something else is asked for."""

    def make(**options):
        options = {"preset": "swatches", "relief_scale": 3.0, "size": (96, 72), "seed": 11, **options}
        options = {"dome": True, "lights": LIGHTS, "calibration": False, **options}
        folder = tmp_path_factory.mktemp("shadows")
        impasto.simulate(folder / "photos", **options)
        impasto.stack(folder / "photos", folder / "p.zarr")
        scene, lights = set_up(Settings(**options))
        stack = open_stack(folder / "p.zarr")
        height, width = stack.shape[1:3]
        return Capture(
            store=folder / "p.zarr",
            stack=stack,
            radiance=stack.radiance(slice(0, height), slice(0, width)).reshape(
                len(lights), height * width, -1
            ),
            visible=np.stack([scene.visible(lights, light).ravel() for light in range(len(lights))]),
            normal=scene.surface.normal.reshape(-1, 3),
            c=scene.surface.alpha.ravel(),
        )

    return make


@pytest.fixture(scope="module")
def steep(photographed):
    return photographed()


@pytest.mark.parametrize(("bits", "recall"), [(16, 0.95), (8, 0.8)])
def test_shadows_are_found_and_hardly_anything_else(photographed, steep, bits, recall):
    """In 8 bits, shadows on dark paint are no darker than the rounding."""
    seen = steep if bits == 16 else photographed(bits=8, format="png")
    found = seen.fit(shadows=True)["shadowed"].T > 0
    assert 0.01 < seen.telling.mean() < 0.05
    assert seen.shadowed[found].mean() > 0.99
    assert found[seen.telling].mean() > recall


def test_without_shadows_hardly_any_are_found_and_the_fit_stays_what_it_was(photographed):
    seen = photographed(cast_shadows=False)
    plain, found = seen.fit(), seen.fit(shadows=True)
    assert found["shadowed"].mean() < 0.001
    alone = found["shadowed"].max(axis=1) == 0
    assert alone.mean() > 0.98
    apart = np.linalg.norm(plain["normal"] - found["normal"], axis=1)[alone]
    assert np.degrees(np.percentile(apart, 99)) < 0.05


def test_normals_and_widths_are_nearly_those_that_known_shadows_would_give(steep):
    plain, robust, found = steep.fit(), steep.fit(loss="cauchy"), steep.fit(shadows=True)
    best = steep.fit(left_out=steep.shadowed)

    def normals(maps):
        return steep.normal_errors_deg(maps).mean()

    def widths(maps):
        return np.abs(np.log(maps["c"] / steep.c)).mean()

    assert normals(plain) > 2
    assert normals(found) < min(0.1 * normals(plain), 0.5 * normals(robust), 1.6 * normals(best))
    assert widths(found) < min(0.5 * widths(plain), 1.15 * widths(best))


def test_measured_materials_are_not_taken_for_shadows(photographed, shared):
    """No model describes them; still nothing but their shadows is left out."""
    measured = shared / "reference" / "measured_brdf.npz"
    seen = photographed(preset="still-life", relief_scale=2.5, measured=measured)
    plain, maps = seen.fit(), seen.fit(shadows=True)
    found = maps["shadowed"].T > 0
    assert seen.shadowed[found].mean() > 0.97
    assert found[seen.telling].mean() > 0.95
    assert seen.normal_errors_deg(maps).mean() < seen.normal_errors_deg(plain).mean()


@pytest.mark.parametrize(
    "options", [{"model": "torrance-sparrow-ambient"}, {"model": "phong"}, {"loss": "cauchy"}], ids=str
)
def test_shadows_are_found_beside_an_ambient_term_and_a_robust_loss(steep, options):
    found = steep.fit(shadows=True, **options)["shadowed"].T > 0
    assert steep.shadowed[found].mean() > 0.97
    assert found[steep.telling].mean() > 0.9


def test_a_pixel_is_fitted_alike_whatever_its_neighbours(steep):
    order = np.random.default_rng(3).permutation(steep.radiance.shape[1])
    maps = steep.fit(shadows=True)
    shuffled = steep.fit(shadows=True, radiance=np.ascontiguousarray(steep.radiance[:, order]))
    for name, values in maps.items():
        np.testing.assert_array_equal(shuffled[name], values[order], err_msg=name)


def test_of_no_pixel_most_lights_are_left_out(steep):
    dark = np.array(steep.radiance)
    dark[: LIGHTS * 3 // 4] *= 0.02
    assert steep.fit(shadows=True, radiance=dark)["shadowed"].mean(axis=1).max() <= 0.5


def test_the_store_keeps_the_share_of_the_lights(steep):
    summary = impasto.fit(steep.store, models=["torrance-sparrow"], options=FitOptions(shadows=True))
    fitted = open_fit(steep.store, "torrance-sparrow")
    height, width = fitted.shape
    share = fitted.read(slice(0, height), slice(0, width))["shadowed"].ravel()
    expected = steep.fit(shadows=True)["shadowed"].mean(axis=1)
    np.testing.assert_allclose(share, expected, atol=1e-6)
    found = fitted.attributes["shadowed"]
    assert found["samples"] == pytest.approx(share.mean(), abs=1e-5)
    assert found["pixels"] == pytest.approx((share > 0).mean(), abs=1e-5)
    (note,) = [note for note in summary.models[0].notes if note.startswith("shadows:")]
    assert f"{100 * share.mean():.2g} % of the samples" in note


def test_a_light_much_weaker_than_stated_is_named(photographed):
    seen = photographed(relief_scale=1.0, size=(48, 36))
    stated = seen.stack.lights
    intensity = np.array(stated.intensity)
    intensity[7] *= 3
    assert shadow_warnings(seen.fit(shadows=True)["shadowed"], stated.names) == ()
    shadowed = seen.fit(shadows=True, lights=replace(stated, intensity=intensity))["shadowed"]
    (note,) = shadow_warnings(shadowed, stated.names)
    assert stated.names[7] in note
    assert stated.names[6] not in note


def soiled(seen):
    """Return the radiance with dust on samples drawn at random and on much of photograph 5, and which."""
    rng = np.random.default_rng(9)
    radiance = np.array(seen.radiance)
    dirty = rng.random(radiance.shape[:2]) < 0.003
    dirty[5, : radiance.shape[1] // 10] = True
    radiance[dirty] *= rng.uniform(1.6, 4.0, (dirty.sum(), 1)).astype(np.float32)
    return radiance, dirty


def found_deviating(seen, radiance):
    maps = seen.fit(shadows=True, radiance=radiance)
    row, column = np.divmod(np.arange(radiance.shape[1]), seen.stack.shape[2])
    attributes = {"model": "torrance-sparrow", "light_rgb": seen.stack.light_rgb}
    attributes |= {"index_of_refraction": 1.5, "fresnel": "facet"}
    pixels = pixels_of_maps(attributes, seen.stack.shape[1:3], row, column, maps)
    rendered = render_pixels(pixels, seen.stack.lights, seen.stack.camera)
    measured = np.where(radiance < seen.stack.clip_level, radiance, np.float32(np.nan))
    return deviating(measured, rendered, seen.stack.noise, maps["shadowed"].T > 0)


def test_dirt_is_told_from_shadows_and_from_what_the_model_does_not_know(photographed, shared):
    measured = shared / "reference" / "measured_brdf.npz"
    seen = photographed(preset="still-life", relief_scale=2.5, measured=measured)
    names = seen.stack.lights.names
    clean = found_deviating(seen, seen.radiance)
    assert clean.mean() < 1e-4
    assert tell_deviating(clean, names).notes == ()
    radiance, dirty = soiled(seen)
    found = found_deviating(seen, radiance)
    assert dirty[found].mean() > 0.97
    assert found[dirty].mean() > 0.7
    (note,) = tell_deviating(found, names).notes
    assert f"most in {names[5]} (" in note


def test_the_papers_procedure_has_no_such_option(painting):
    with pytest.raises(OptionError, match="--shadows"):
        impasto.fit(painting, procedure="paper", options=FitOptions(shadows=True), overwrite=True)
