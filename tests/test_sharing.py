"""Reflectance sharing: who is heard, what follows for whom, and what a fit with it gains."""

import numpy as np
import pytest

from impasto import _core, store
from impasto.errors import OptionError
from impasto.fit import FitOptions, fit, streaming
from impasto.fit.sharing import Sharing, sharing_problems
from impasto.fit.tile import Belief, fit_tile
from impasto.geometry import Camera, Lights, dome_direction
from impasto.models import parse_model
from impasto.stack import stack
from reference_models import MODELS, TYPICAL, radiance
from store_files import contents, write_capture

MODEL = parse_model("torrance-sparrow")
SIDE = 192
NOISE = (5e-4, 0.0, 0.006)
WEAK = np.array([[np.log(0.15), 1.2], [0.0, 1.0]])


def places(side=SIDE):
    return np.mgrid[0:side, 0:side].reshape(2, -1)


def fitted(count, c=0.1, c_sd=0.002, kappa=1.0, colour=(0.5, 0.3, 0.1)):
    """Return maps of pixels that show their highlight, or not, as a fit gives them."""
    c, c_sd = (np.broadcast_to(np.float32(values), count) for values in (c, c_sd))
    specular = np.float32(kappa) / (4 * c**2)
    return {
        "normal": np.tile(np.float32([0, 0, 1]), (count, 1)),
        "diffuse": np.broadcast_to(np.float32(colour), (count, 3)),
        "specular": specular,
        "c": c,
        "c_sd": c_sd,
        "specular_sd": specular * c_sd / c,
        "status": np.zeros(count, np.uint8),
    }


@pytest.mark.parametrize("model", [name for name in MODELS if name not in ("lambert", "oren-nayar")])
def test_the_scale_of_the_magnitude_is_that_of_a_smooth_interface(model):
    shape = np.array([[TYPICAL[name] for name in MODELS[model][0]]])
    scale = _core.specular_scale(model, shape)
    assert scale.shape == (1, parse_model(model).lobes)
    if model.startswith("torrance-sparrow"):
        np.testing.assert_allclose(scale, 1 / shape**2)


def test_a_paint_passes_on_what_it_shows():
    row, column = places(64)
    rng = np.random.default_rng(1)
    c = 0.08 * np.exp(0.3 * rng.standard_normal(len(row)))
    shown = Sharing(MODEL)
    shown.add(fitted(len(row), c, 0.05 * c, kappa=2.0), row, column)
    assert shown.attributes == {"pixels": len(row), "shown": 1.0}
    belief = shown.belief(fitted(1, colour=(0.5, 0.31, 0.1)), np.array([30]), np.array([70]))
    np.testing.assert_allclose(belief.mean, [[np.log(0.08), 0.5]], rtol=0.02)
    # The spread of the paint, without the pixels' own errors, and the least that a paint is taken to have.
    np.testing.assert_allclose(belief.deviation[0, 0], np.hypot(0.3, 0.1), rtol=0.05)
    np.testing.assert_allclose(belief.deviation[0, 1], 0.02, rtol=0.1)


@pytest.mark.parametrize(
    ("maps", "at"),
    [
        ({}, (30, 200)),  # far away
        ({"colour": (0.1, 0.2, 0.5)}, (30, 30)),  # another paint
        ({"c_sd": 0.05}, (30, 30)),  # knows nothing
    ],
)
def test_who_is_far_or_unlike_or_knows_nothing_is_not_heard(maps, at):
    row, column = places(64)
    shown = Sharing(MODEL)
    shown.add(fitted(len(row), **maps), row, column)
    belief = shown.belief(fitted(1), *np.array(at)[:, None])
    np.testing.assert_allclose(belief.mean[0], WEAK[:, 0], atol=1e-6)
    np.testing.assert_allclose(belief.deviation[0], WEAK[:, 1], rtol=0.01)


def test_what_is_believed_does_not_depend_on_the_cut():
    row, column = places(128)
    rng = np.random.default_rng(2)
    maps = fitted(len(row), 0.1 * np.exp(0.2 * rng.standard_normal(len(row))))
    maps["diffuse"] = np.exp(rng.normal(-1, 0.3, (len(row), 1)) * [1, 1.1, 0.9]).astype(np.float32)
    whole, parts = Sharing(MODEL), Sharing(MODEL)
    whole.add(maps, row, column)
    cuts = [(row < 64) & (column < 96), (row < 64) & (column >= 96), row >= 64]
    for cut in cuts[::-1]:
        parts.add({name: values[cut] for name, values in maps.items()}, row[cut], column[cut])
    expected = whole.belief(maps, row, column)
    for cut in cuts:
        found = parts.belief({name: values[cut] for name, values in maps.items()}, row[cut], column[cut])
        np.testing.assert_array_equal(found.mean, expected.mean[cut])
        np.testing.assert_array_equal(found.deviation, expected.deviation[cut])


@pytest.mark.parametrize("name", ["lambert", "gtr", "torrance-sparrow-2"])
def test_models_without_one_plain_lobe_are_refused(name):
    (problem,) = sharing_problems(parse_model(name))
    assert name in str(problem)


class Painting:
    """Two paints that differ in colour and gloss, in squares of 24 pixels on a relief, under few lights."""

    def __init__(self):
        rng = np.random.default_rng(5)
        self.row, self.column = row, column = places()
        self.paint = (row // 24 + column // 24) % 2
        waves = rng.normal(size=(2, 5, 3)) * [0.025, 1, 1]
        tilts = [
            sum(a * np.cos(p * row / 4 + q * column / 4 + number) for number, (a, p, q) in enumerate(wave))
            for wave in waves
        ]
        self.normal = np.stack([*tilts, np.ones(len(row))], axis=-1)
        self.normal /= np.linalg.norm(self.normal, axis=1, keepdims=True)
        varnish = 0.2 * np.cos(row / 40) * np.sin(column / 55 + 1)
        self.c = np.array([0.025, 0.07])[self.paint] * np.exp(varnish)
        self.specular = np.array([1.0, 0.7])[self.paint] / (4 * self.c**2)
        self.diffuse = np.array([[0.55, 0.3, 0.1], [0.1, 0.17, 0.4]])[self.paint]
        self.diffuse = self.diffuse * np.exp(0.03 * rng.standard_normal((len(row), 1)))
        zenith = np.radians(68) * np.sqrt((np.arange(18) + 0.5) / 18)
        direction = dome_direction(zenith, 2.4 * np.arange(18))
        self.lights = Lights(tuple(map(str, range(18))), direction)
        seen = radiance(
            "torrance-sparrow", self.normal, self.diffuse, self.specular, self.c, light_direction=direction
        )
        noise = np.hypot(NOISE[0], NOISE[2] * seen)
        self.values = (seen + noise * rng.standard_normal(seen.shape)).astype(np.float32)

    def fit(self, belief=None):
        return fit_tile(
            MODEL,
            self.values,
            lights=self.lights,
            camera=Camera(np.array([0.0, 0.0, 1.0])),
            light_rgb=np.ones(3),
            clip_level=np.full(3, np.inf),
            noise=NOISE,
            belief=belief,
        )

    def errors(self, maps):
        """Return the errors of ln c, ln As and the normal, in radians."""
        normal = np.linalg.norm(maps["normal"] - self.normal, axis=1)
        return [np.abs(np.log(maps["c"] / self.c)), np.abs(np.log(maps["specular"] / self.specular)), normal]

    @property
    def near_border(self):
        return np.minimum(*((place + 3) % 24 for place in (self.row, self.column))) < 6


@pytest.fixture(scope="module")
def painting():
    """Return a painting, its fit pixel by pixel, and the one that shares."""
    painting = Painting()
    first = painting.fit()
    shown = Sharing(MODEL)
    shown.add(painting.fit(shown.doubt(first)), painting.row, painting.column)
    return painting, first, painting.fit(shown.belief(first, painting.row, painting.column))


def test_believing_the_weak_priors_is_the_ordinary_fit(painting):
    scene, first, _ = painting
    mean, deviation = (np.tile(np.float32(values), (len(scene.row), 1)) for values in WEAK.T)
    again = scene.fit(Belief(first["normal"], first["c"][:, None], mean, deviation))
    moved = np.abs(np.log(again["c"] / first["c"])) / (first["c_sd"] / first["c"])
    assert np.median(moved) < 0.002
    assert np.percentile(moved, 99) < 0.15
    np.testing.assert_allclose(again["chi2_reduced"], first["chi2_reduced"], rtol=0.05)


def test_a_narrow_belief_is_kept_where_nothing_was_seen(painting):
    scene, first, _ = painting
    unseen = first["c_sd"] > 0.5 * first["c"]
    mean = np.tile(np.float32([np.log(0.04), 0.2]), (len(scene.row), 1))
    again = scene.fit(Belief(first["normal"], first["c"][:, None], mean, np.full_like(mean, 1e-3)))
    np.testing.assert_allclose(again["c"][unseen], 0.04, rtol=0.01)
    np.testing.assert_allclose((again["specular"] * again["c"] ** 2)[unseen], 0.2, rtol=0.03)


def test_highlights_that_were_not_seen_come_out_several_times_better(painting):
    scene, first, second = painting
    unseen = first["c_sd"] > 0.5 * first["c"]
    assert 0.1 < unseen.mean() < 0.3
    for before, after in list(zip(scene.errors(first), scene.errors(second), strict=True))[:2]:
        assert np.median(after[unseen]) < np.median(before[unseen]) / 8
        assert np.percentile(after[unseen], 95) < np.percentile(before[unseen], 95) / 6


def test_nothing_bleeds_across_borders_of_paints_and_no_normal_suffers(painting):
    scene, first, second = painting
    seen = first["c_sd"] < 0.1 * first["c"]
    for pixels in (scene.near_border & seen, scene.near_border & ~seen, seen, ~seen):
        for before, after in zip(scene.errors(first), scene.errors(second), strict=True):
            assert np.median(after[pixels]) <= 1.01 * np.median(before[pixels])
            assert np.percentile(after[pixels], 95) <= 1.01 * np.percentile(before[pixels], 95)


def test_what_is_known_well_hardly_changes_and_deviations_describe_the_errors(painting):
    scene, first, second = painting
    known = first["c_sd"] < 0.03 * first["c"]
    assert known.mean() > 0.02
    assert np.mean(np.abs(second["c"] - first["c"])[known] < first["c_sd"][known]) > 0.99
    error = np.abs(second["c"] - scene.c) / second["c_sd"]
    assert np.median(error) < 0.7
    assert np.percentile(error, 95) < 2.0


@pytest.fixture
def photographs(tmp_path):
    """Return a folder with photographs of a glossy relief, one unit and a bit large."""
    rng = np.random.default_rng(3)
    height, width, count = 70, 1025, 9
    y, x = np.mgrid[0:height, 0:width]
    normal = np.stack([0.1 * np.sin(x / 5), 0.1 * np.cos(y / 4), np.ones((height, width))], -1).reshape(-1, 3)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    step = np.arange(count)
    direction = dome_direction(0.2 + 0.8 * step / (count - 1), 2.4 * step)
    grey = np.full((len(normal), 1), 0.3)
    c = np.full(len(normal), 0.15)
    seen = radiance("torrance-sparrow", normal, grey, 0.6 / (4 * c**2), c, light_direction=direction)
    seen = seen * (1 + 0.005 * rng.standard_normal(seen.shape)) + 1e-3 * rng.standard_normal(seen.shape)
    images = np.clip(65535 * 0.5 * seen, 0, 65000).astype(np.uint16).reshape(count, height, width)
    return write_capture(tmp_path / "photos", list(images))


def test_a_fit_that_shares_gives_the_same_bytes_however_it_is_cut_and_stopped(
    photographs, tmp_path, monkeypatch
):
    options = FitOptions(share_reflectance=True)
    paths = [tmp_path / name for name in ("whole.zarr", "cut.zarr")]
    for path in paths:
        stack(photographs, path)
    (done,) = fit(paths[0], models=["torrance-sparrow"], options=options).models
    assert any("reflectance sharing" in note for note in done.notes)
    found = store.open_fit(paths[0], "torrance-sparrow").attributes
    assert found["options"]["share_reflectance"] is True
    assert found["reflectance_sharing"]["pixels"] == 35 * 512
    assert 0.2 < found["reflectance_sharing"]["shown"] <= 1

    monkeypatch.setattr(streaming, "_TILE_BYTES", 9 * 512 * 2 * 32)
    write = store.MapsWriter.write

    def stop(self, tile, values):
        if self.group.startswith("fits") and tile.columns.start == 1024:
            raise KeyboardInterrupt
        write(self, tile, values)

    with monkeypatch.context() as patch:
        patch.setattr(store.MapsWriter, "write", stop)
        with pytest.raises(KeyboardInterrupt):
            fit(paths[1], models=["torrance-sparrow"], options=options)
    (continued,) = fit(paths[1], models=["torrance-sparrow"], options=options).models
    assert continued.continued
    assert contents(paths[1] / "fits") == contents(paths[0] / "fits")


def test_the_papers_procedure_does_not_share(photographs, tmp_path):
    stack(photographs, tmp_path / "s.zarr")
    with pytest.raises(OptionError, match="--share-reflectance"):
        fit(tmp_path / "s.zarr", procedure="paper", options=FitOptions(share_reflectance=True))
