"""Published stores: what is in them, how exact it is, and how they are read again."""

import gzip
import http.client
import json
import shutil
import threading

import numpy as np
import OpenImageIO as oiio
import pytest
import zarr
from tests.store_files import contents

import impasto
from impasto.errors import OptionError, OutputError, StoreError
from impasto.fit import FitOptions
from impasto.fit.light_process import hull_of
from impasto.geometry import dome_direction
from impasto.maps.integration import integrate_normals
from impasto.publish.publication import Publication
from impasto.publish.residual import PackedResidual
from impasto.residual import ZERO, ResidualTerm
from impasto.store import open_fit, open_published
from impasto.store.packing import Parameter, linear, logarithmic, pack, parameter_columns
from impasto.view import serve

MODEL = "torrance-sparrow"
WHOLE = slice(None)


@pytest.fixture(scope="module")
def site(web, painting, tmp_path_factory):
    """Return a published folder of the small painting, with three photographs."""
    out = tmp_path_factory.mktemp("published") / "site"
    impasto.publish(painting, out, photographs=3)
    return out


def whole(fit):
    height, width = fit.shape
    return fit.read(slice(0, height), slice(0, width))


def test_codes_keep_values_to_the_stated_error():
    values = np.geomspace(2e-6, 9e5, 10_001)
    for coarse, bound in ((False, 2.2e-4), (True, 1.4e-2)):
        column = logarithmic("c", 0, "1", "c", coarse=coarse)
        error = np.abs(column.decode(column.encode(values)) / values - 1).max()
        assert bound / 2 < error < bound
    column = linear("normal", 0, -1, 1, "1", "x")
    values = np.linspace(-1, 1, 10_001)
    assert np.abs(column.decode(column.encode(values)) - values).max() < 1.6e-5


def test_codes_say_zero_and_nothing_exactly():
    column = logarithmic("specular", 0, "1", "specular magnitude")
    given = np.array([0.0, np.nan, 1e-9, -0.5, 1e12])
    codes = column.encode(given)
    assert codes.tolist() == [1, 0, 1, 1, 65535]
    np.testing.assert_array_equal(column.decode(codes)[:4], np.float32([0, np.nan, 0, 0]))
    status = Parameter("status", 0, "linear", 1.0, -1.0, "1", "status")
    assert status.decode(status.encode(np.array([0.0, 5.0, 255.0]))).tolist() == [0, 5, 255]


def test_a_normal_that_faces_away_has_no_value(painting):
    fit = open_fit(painting, MODEL)
    maps = fit.read(slice(0, 4), slice(0, 4), ["normal"])
    maps["normal"][0, 0] = [0.6, 0.0, -0.8]
    packed = pack(maps, parameter_columns(fit, ["normal"]))
    assert (packed[0, 0] == 0).all()
    assert (packed[1:] > 0).all()


def test_a_published_fit_is_the_fit_to_the_stated_error(painting, site):
    published, stack = open_published(site / "painting.zarr", MODEL)
    fit = open_fit(painting, MODEL)
    assert published.shape == fit.shape
    assert stack.camera.mm_per_px == impasto.store.open_stack(painting).camera.mm_per_px
    got, want = whole(published), whole(fit)
    assert set(got) == {"normal", "diffuse", "specular", "c"}
    for name in ("diffuse", "specular", "c"):
        assert got[name].shape == want[name].shape
        small = want[name] < 1e-6
        np.testing.assert_allclose(got[name][~small], want[name][~small], rtol=2.2e-4)
        np.testing.assert_allclose(got[name][small], 0, atol=1e-6)
    np.testing.assert_allclose(got["normal"][..., :2], want["normal"][..., :2], atol=1.6e-5)
    np.testing.assert_allclose(got["normal"][..., 2], want["normal"][..., 2], atol=1e-3)


@pytest.mark.parametrize("spread", [1.0, 30.0])
def test_a_residual_is_published_to_the_stated_error(spread):
    """Coefficients of 6 components with long tails, from a hundredth of a display's step on."""
    rng = np.random.default_rng(2)
    direction = dome_direction(np.arccos(rng.uniform(0.3, 1, 30)), rng.uniform(0, 2 * np.pi, 30))
    found = {
        "components": 6,
        "zero": ZERO,
        "step": (np.array([4, 3, 2, 2, 1, 1]) * 1e-5 * spread).tolist(),
        "toe": 0.004,
        "direction": direction.tolist(),
        "length": 0.4,
        "weights": rng.normal(0, 0.05, (6, 3, 30)).tolist(),
        "hull": hull_of(direction).tolist(),
        "fade": 0.17,
    }
    packed = PackedResidual({"residual": found})
    before, after = (ResidualTerm.of({"residual": each}) for each in (found, packed.attributes))

    small = np.clip(rng.normal(0, 300 / spread, (4000, 6)), -ZERO, ZERO - 1).astype(int)
    large = np.clip(rng.standard_t(2, (4000, 6)) * 3000, -ZERO, ZERO - 1).astype(int)

    def moved_by_packing(steps):
        return after.table[packed.pack((steps + ZERO).astype(np.uint16))] - steps * before.step

    error = np.einsum("pk,lkc->plc", moved_by_packing(small), before.basis(direction))
    stated = packed.attributes["quantisation"]
    assert 0.7 * stated["rounding"] < np.sqrt(np.mean(np.square(error))) < 1.1 * stated["rounding"]
    coefficient = large * before.step
    moved = np.abs(moved_by_packing(large))
    finest = after.table[129]
    assert (moved <= 0.51 * finest + 1.01 * stated["relative"] * np.abs(coefficient)).all()
    assert (packed.pack(np.full((1, 6), ZERO, np.uint16)) == 128).all()


def test_a_published_store_renders_as_the_store_does(painting, site, tmp_path):
    for name, store in (("store", painting), ("published", site / "painting.zarr")):
        impasto.render(store, model=MODEL, light=[(40, 120)], out=tmp_path / name)
    pictures = [oiio.ImageBuf(str(tmp_path / name / "1.exr")).get_pixels() for name in ("store", "published")]
    difference = np.abs(pictures[0] - pictures[1])
    # A narrow highlight moves a little with its normal.
    assert np.median(difference) < 1e-4
    assert difference.max() < 0.02 * pictures[0].max()
    assert difference.max() > 0


def test_xarray_and_zarr_read_it_without_impasto(site):
    root = zarr.open_group(site / "painting.zarr", mode="r")
    array = root[f"models/{MODEL}/0/parameters"]
    assert array.dtype == np.uint16
    assert array.metadata.dimension_names == ("y", "x", "parameter")
    columns = next(entry for entry in root.attrs["models"] if entry["name"] == MODEL)["parameters"]
    red = next(index for index, column in enumerate(columns) if column["name"] == "diffuse")
    codes = array[WHOLE, WHOLE, red].astype(float)
    value = 2 ** (columns[red]["offset"] + columns[red]["scale"] * codes)
    published, _ = open_published(site / "painting.zarr", MODEL)
    np.testing.assert_allclose(value, whole(published)["diffuse"][..., 0], rtol=1e-5)


def test_the_page_is_small(site):
    """All that is published beside the painting, codecs included."""
    files = [path for path in site.rglob("*") if path.is_file() and "painting.zarr" not in path.parts]
    assert (site / "index.html") in files
    assert sum(len(gzip.compress(path.read_bytes())) for path in files) < 300_000


def test_photographs_are_published_with_their_lights(painting, site):
    root = zarr.open_group(site / "painting.zarr", mode="r")
    kept = root.attrs["photographs"]
    stack = impasto.store.open_stack(painting)
    names = list(stack.lights.names)
    assert len(kept["lights"]) == 3
    for index, light in enumerate(kept["lights"]):
        number = names.index(light["name"])
        assert light["direction"] == pytest.approx(stack.lights.direction[number])
        height, width = root.attrs["size"]
        radiance = stack.radiance(slice(0, height), slice(0, width), [number])[0]
        codes = root["photographs/0"][index].astype(float)
        got = np.where(codes == 1, 0, 2 ** (kept["offset"] + kept["scale"] * codes))
        np.testing.assert_allclose(got, radiance, rtol=2.2e-4, atol=1e-6)


def test_photographs_are_published_as_strong_as_a_fit_found_them(painting, tmp_path):
    """By the first of the models that looked for it; the others are as stated."""
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    stated = Publication(store).attributes["photographs"]["lights"]
    shutil.rmtree(store / "fits" / "phong")
    impasto.fit(store, models=["phong"], options=FitOptions(self_calibrate=True))
    found = open_fit(store, "phong").attributes["self_calibration"]
    published = Publication(store).attributes["photographs"]["lights"]
    strength = np.array(found["gain"]) / found["trend"]
    assert np.abs(strength - 1).max() > 1e-3
    for before, light, factor in zip(stated, published, strength, strict=True):
        assert light["intensity"] == pytest.approx(before["intensity"] * factor)


def test_the_relief_of_normals_is_that_of_the_surface():
    """A hill with known slopes, with a hole in the normals."""
    y, x = np.mgrid[0:90, 0:120].astype(float)
    hill = 6 * np.exp(-((x - 70) ** 2 + (y - 30) ** 2) / 300) + 0.02 * x - 0.01 * y
    down, across = np.gradient(hill)
    normal = np.stack([-across, down, np.ones_like(hill)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    np.testing.assert_allclose(integrate_normals(normal), hill - hill.mean(), atol=0.03)
    normal[60:62, 20:22] = np.nan
    np.testing.assert_allclose(integrate_normals(normal), hill - hill.mean(), atol=0.06)


def test_shards_hold_the_same_pixels(painting, site, tmp_path):
    impasto.publish(painting, tmp_path / "sharded", shards=True)
    plain, sharded = (
        zarr.open_array(folder / "painting.zarr" / "models" / MODEL / "0" / "parameters", mode="r")
        for folder in (site, tmp_path / "sharded")
    )
    assert sharded.shards is not None
    np.testing.assert_array_equal(plain[...], sharded[...])


def test_the_same_store_gives_the_same_bytes(painting, site, tmp_path):
    impasto.publish(painting, tmp_path / "again", photographs=3)
    assert contents(site) == contents(tmp_path / "again")


def test_nothing_else_is_overwritten(painting, site, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("years")
    with pytest.raises(OutputError, match="not published by impasto"):
        impasto.publish(painting, other, overwrite=True)
    with pytest.raises(OutputError, match="holds a published painting"):
        impasto.publish(painting, site)
    with pytest.raises(OptionError, match="no reflectance model"):
        impasto.publish(painting, tmp_path / "new", models=["gloss"])
    assert not (tmp_path / "new").exists()
    first = impasto.publish(painting, tmp_path / "new", models=["phong"])
    second = impasto.publish(painting, tmp_path / "new", models=[MODEL], overwrite=True)
    assert (first.models, second.models) == (("phong",), (MODEL,))
    assert not (tmp_path / "new" / "painting.zarr" / "models" / "phong").exists()


def test_a_published_store_that_cannot_be_read_says_why(painting, tmp_path):
    impasto.publish(painting, tmp_path / "site", models=[MODEL])
    store = tmp_path / "site" / "painting.zarr"
    with pytest.raises(StoreError, match="has no model phong"):
        impasto.render(store, model="phong", light=[(20, 0)], out=tmp_path)
    chunk = store / "models" / MODEL / "0" / "parameters" / "c" / "0" / "0" / "0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 0x10
    chunk.write_bytes(data)
    with pytest.raises(StoreError, match="is damaged"):
        impasto.render(store, model=MODEL, light=[(20, 0)], out=tmp_path)
    chunk.unlink()
    with pytest.raises(StoreError, match="lost a part"):
        impasto.render(store, model=MODEL, light=[(20, 0)], out=tmp_path)
    document = json.loads((store / "zarr.json").read_text())
    document["attributes"]["impasto_published"] = 99
    (store / "zarr.json").write_text(json.dumps(document))
    with pytest.raises(StoreError, match="schema 99"):
        impasto.render(store, model=MODEL, light=[(20, 0)], out=tmp_path)


def test_view_serves_what_publish_writes(painting, site):
    with serve(painting) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()

        def get(path, **headers):
            connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=10)
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.read()

        status, page = get("/")
        assert (status, page) == (200, (site / "index.html").read_bytes())
        key = f"painting.zarr/models/{MODEL}/0/parameters"
        array = json.loads(get(f"/{key}/zarr.json")[1])
        assert array == json.loads((site / key / "zarr.json").read_text())
        assert gzip.decompress(get(f"/{key}/c/0/0/0")[1]) == gzip.decompress(
            (site / key / "c/0/0/0").read_bytes()
        )
        for path in (f"/{key}/c/9/0/0", f"/{key}/c/0/0", "/painting.zarr/../zarr.json", "/../cli/app.py"):
            assert get(path)[0] == 404
        # A page elsewhere whose name leads here must not read the painting.
        assert get("/", Host="evil.example")[0] == 403
        server.shutdown()


def test_a_port_in_use_is_told(painting):
    with serve(painting) as server, pytest.raises(OptionError, match="cannot be used"):
        serve(painting, port=server.server_address[1])
